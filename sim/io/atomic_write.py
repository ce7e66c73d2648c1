"""Files that appear whole or not at all: an export replaces an older one only when it is complete."""

import os
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator


@contextmanager
def atomic_write(path: str | Path) -> Iterator[Path]:
    """Gives a temporary path beside `path` to write to; it takes the place of `path` if the block ends without error.

    Raises OSError where the folder does not exist or cannot be written."""
    path = Path(path)
    # A folder of its own, because some writers choose by the file's suffix and want a name that does not exist yet.
    with tempfile.TemporaryDirectory(prefix=".patchwalk-", dir=path.parent) as folder:
        temporary = Path(folder) / path.name
        yield temporary
        os.replace(temporary, path)
