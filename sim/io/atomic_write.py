"""Files that appear whole or not at all: an export replaces an older one only when it is complete."""

import os
import platform
import re
import shutil
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator

# Of a temporary folder: the machine's name; then comes the number of the process that writes.
PREFIX = f".patchwalk-{re.sub(r'[^A-Za-z0-9]', '', platform.node())[:20]}-"


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """Gives a temporary path beside `path` to write to; it takes the place of `path` if the block ends without error.

    Raises OSError, naming `path`, where the folder does not exist or cannot be written, or the disk is full."""
    path = Path(path)
    try:
        _remove_leftovers(path.parent)
        # A folder of its own, because some writers choose by the file's suffix and want a name that does not exist yet.
        with tempfile.TemporaryDirectory(prefix=f"{PREFIX}{os.getpid()}-", dir=path.parent) as folder:
            temporary = Path(folder) / path.name
            yield temporary
            os.replace(temporary, path)
    except OSError as error:
        named = error.filename and PREFIX not in str(error.filename)
        raise error if named or error.errno is None else type(error)(error.errno, error.strerror, str(path)) from error


def _remove_leftovers(folder: Path) -> None:
    """Removes the temporary folders of processes of this machine that are no more: they were killed while they
    wrote."""
    if sys.platform == "win32":  # where nobody can be asked whether he lives without being ended
        return
    for left in folder.glob(f"{PREFIX}[0-9]*-*"):
        try:
            os.kill(int(left.name.removeprefix(PREFIX).partition("-")[0]), 0)
        except (ProcessLookupError, OverflowError):
            shutil.rmtree(left, ignore_errors=True)
        except (PermissionError, ValueError):  # somebody else's, or none of ours
            pass
