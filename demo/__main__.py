"""`patchwalk`, and `python -m demo`, which is the same."""

import sys


def start() -> int:
    """Runs the command line and returns its exit status; an interruption while it is still being imported is no
    mistake."""
    try:
        from demo.cli import main

        return main()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(start())
