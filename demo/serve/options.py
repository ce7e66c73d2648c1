"""What a server is told, and where what its pages make goes."""

from dataclasses import dataclass
from pathlib import Path

from sim.io.user_dirs import data_folder

A_WORKER = 5  # visitors of a worker, which keeps one core busy if all of them move alone
DROP = ".drop-"  # what the folders of dropped files are called by there, which go with their page
FOLDER = "browser"  # of recordings and exports, in the user's folder


@dataclass(frozen=True)
class Options:
    """What sessions are made of: the stylizer's name, the ground's, and whether the user's character, which was kept,
    is shown in place of the figure."""

    stylizer: str | None = None
    ground: str | None = None
    character: bool = True


def own_folder() -> Path:
    """Where recordings and exports of pages go; made where it is not there yet."""
    folder = data_folder() / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    return folder
