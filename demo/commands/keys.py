"""`patchwalk keys`: every binding as the TOML file that changes them."""

import argparse

HELP = "print every key, gamepad and mouse binding as TOML, or write them where the window reads its own"
EXAMPLE = "patchwalk keys --write"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--write", action="store_true", help="write the file, unless there is one, and say where it is")


def run(args: argparse.Namespace) -> int:
    from demo.state import user_bindings
    from sim.io.atomic_write import atomic_write

    text = user_bindings.template(user_bindings.load())
    if not args.write:
        print(text, end="")
        return 0
    path = user_bindings.path()
    if path.exists():
        raise ValueError(f"{path} is there already: change it, or remove it to begin anew")
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"wrote {path}")
    return 0
