"""Learns a style from a clip of your own and walks in it: `python -m demo.examples.register_style limp.bvh limp`."""

import sys

import patchwalk as pw


def main(path: str, name: str) -> None:
    stylizer = pw.load_stylizer()
    print(*stylizer.bank.add(name, path).taken, sep="\n")
    session = pw.Session(pw.load_controller(), stylizer)
    for _ in range(60):
        frame = session.step(pw.Command(move=(0, 1), style={"all": name}))
    apart = abs(frame.styled.positions - frame.neutral.positions).max()
    print(f"after a second in {name} a joint is {100 * apart:.0f} cm from the neutral walk")


if __name__ == "__main__":
    if len(sys.argv) <= 2:
        sys.exit(__doc__)
    main(*sys.argv[1:3])
