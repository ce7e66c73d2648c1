"""The `patchwalk` command: a table of subcommands, and every user's mistake as one line on stderr and exit status 2."""

import argparse
import os
import re
import sys
import traceback
import warnings
from collections import Counter
from contextlib import contextmanager
from types import ModuleType
from typing import Any, Callable, Iterator, NoReturn, Sequence

from demo.commands import bench, doctor, evaluate, export, keys, live, replay, serve, styles, stylize, train
from sim.io.provenance import PERMISSIVE
from sim.io.user_dirs import cache_folder

# Each module has HELP (one line), EXAMPLE, add_arguments(parser) and run(args) -> exit status; what is heavy it imports
# inside run, so that --help and a mistyped word are answered at once.
COMMANDS = {
    "replay": replay,
    "serve": serve,
    "stylize": stylize,
    "styles": styles,
    "bench": bench,
    "evaluate": evaluate,
    "train": train,
    "export": export,
    "keys": keys,
    "doctor": doctor,
}
PERMISSIVE_OPTION = "--permissive"
OF_STYLES = ("replay", "stylize", "styles list", "styles add", "evaluate stylizer", "evaluate live", "doctor")
OUR_ERROR, USER_ERROR, INTERRUPTED, BROKEN_PIPE = 1, 2, 130, 141
LONGEST_LINE = 1000  # letters of a message
WARNINGS_SHOWN = 3  # of a kind
_PARTICULARS = re.compile(r"^\S+?(, line \d+)?: |'[^']*' ?|\d[\d.]*(, \d[\d.]*)* ?")
ADVICE = {
    FileNotFoundError: "check the path",
    NotADirectoryError: "check the path",
    IsADirectoryError: "name a file",
    PermissionError: "check its permissions",
    FileExistsError: "move it away or choose another name",
}
ROOMS = ("sim", "controller", "stylizer", "demo", "patchwalk")


class _Parser(argparse.ArgumentParser):
    """argparse prints its usage before an error; here an error is a ValueError like any other."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(f"{message}; see {self.prog} --help")


class _Version(argparse.Action):
    """Prints the version that is installed, which is looked up when it is asked for."""

    def __init__(self, option_strings: Sequence[str], dest: str, **options: Any) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, **options)

    def __call__(self, parser: argparse.ArgumentParser, *_: object, **__: object) -> NoReturn:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"patchwalk {version('patchwalk')}")
        except PackageNotFoundError:  # run from a folder that is not installed
            print("patchwalk, not installed: its version is in pyproject.toml")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """The parser of the live window and of every command in the table; its result's `run` is the chosen one's."""
    parser = _Parser(prog="patchwalk", **_texts(live))
    live.add_arguments(parser)
    parser.add_argument("--version", action=_Version, help="print the version")
    parser.set_defaults(run=live.run)
    _add_permissive(parser)
    parser.set_defaults(prog=parser.prog)
    before = {action.dest for action in parser._actions if action.default is None}
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND")
    for name, module in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=module.HELP, **_texts(module))
        module.add_arguments(subparser)
        subparser.set_defaults(run=module.run)
        for leaf in _leaves(subparser):
            leaf.set_defaults(prog=leaf.prog)
            if leaf.prog.removeprefix(f"{parser.prog} ") in OF_STYLES:
                _add_permissive(leaf)
            for action in leaf._actions:  # an option that stands before the command counts for it too
                if action.dest in before and action.default is None:
                    action.default = argparse.SUPPRESS
    return parser


def _leaves(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """A command's parser, or where it takes a second word, such as `styles list`, one for each of those."""
    inner = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not inner:
        yield parser
    for action in inner:
        for each in action.choices.values():
            yield from _leaves(each)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command line and returns its exit status."""
    with warnings.catch_warnings(), _said_warnings() as show:
        warnings.showwarning = show
        try:
            status = _run(arguments)
            sys.stdout.flush()
            return status
        except KeyboardInterrupt:
            return INTERRUPTED
        except BrokenPipeError:  # the reader of our output left; Python would complain once more when it closes stdout
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return BROKEN_PIPE
        except ModuleNotFoundError as error:
            if error.name is None or error.name.split(".")[0] in ROOMS:
                raise
            _say(f"the Python package '{error.name}' is not installed; `make run` or `pip install -e .` installs it")
        except OSError as error:
            _say(_sentence(error))
        except ValueError as error:
            _say(str(error))
        except Exception as error:  # a mistake of ours: a sentence for the user, all the rest for who mends it
            _say(_report(error))
            return OUR_ERROR
        return USER_ERROR


@contextmanager
def _said_warnings() -> Iterator[Callable[..., None]]:
    """Gives what shows a warning: the first few of a kind are said as they come, and of the others at the end how many
    there were. Of a kind are those that differ in files, names and numbers alone."""
    kinds: Counter[str] = Counter()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        kind = _PARTICULARS.sub("", str(message))
        kinds[kind] += 1
        if kinds[kind] <= WARNINGS_SHOWN:
            _say(f"warning: {message}")

    try:
        yield show
    finally:
        for kind, count in kinds.items():
            if count > WARNINGS_SHOWN:
                _say(f"warning: and {count - WARNINGS_SHOWN} more like it: {kind}")


def _run(arguments: Sequence[str] | None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    if PERMISSIVE_OPTION in given:  # it counts wherever it stands, and before anything is loaded
        os.environ[PERMISSIVE] = "1"
        given = [argument for argument in given if argument != PERMISSIVE_OPTION]
    for before, argument in zip(["patchwalk", *given], given):
        if not argument.strip() or (argument.startswith("--") and argument.endswith("=")):
            option = argument.strip().strip("=") or before
            raise ValueError(f"nothing stands behind {option}: name what is meant, or leave it out")
    try:
        args, unknown = build_parser().parse_known_args(given)
        if unknown:
            raise ValueError(f"unrecognized arguments: {' '.join(unknown)}; see {args.prog} --help")
    except SystemExit as leaving:  # argparse has printed a --help
        return int(leaving.code or 0)
    return args.run(args)


def _add_permissive(parser: argparse.ArgumentParser) -> None:
    """Says in a help text what `_run` does with it."""
    parser.add_argument(
        PERMISSIVE_OPTION,
        action="store_true",
        help=f"leave out every style and stylizer that is for non-commercial use (likewise {PERMISSIVE}=1)",
    )


def _texts(module: ModuleType) -> dict[str, Any]:
    return {
        "description": module.HELP,
        "epilog": f"example:\n  {module.EXAMPLE}",
        "allow_abbrev": False,
        "formatter_class": argparse.RawDescriptionHelpFormatter,
    }


def _sentence(error: OSError) -> str:
    """What the system refused, and what to do about it."""
    if not error.filename:
        return error.strerror or str(error)
    return f"{error.filename}: {error.strerror}; {ADVICE.get(type(error), 'try another place')}"


def _report(error: Exception) -> str:
    """Keeps the traceback in a file; says what happened, where that file is, and whom to tell."""
    file = cache_folder() / "error.log"
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
        kept = f"please report it where you have Patchwalk from, with {file}"
    except OSError:
        kept = "please report it where you have Patchwalk from"
    return f"a mistake in Patchwalk ({type(error).__name__}: {str(error)[:200]}); {kept}"


def _say(message: str) -> None:
    """One line on stderr, of a length that can be read, whatever the message holds: nothing in it steers a terminal."""
    line = " ".join("".join(letter if letter.isprintable() or letter.isspace() else "?" for letter in message).split())
    print("patchwalk:", line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]} ...", file=sys.stderr)
