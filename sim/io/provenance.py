"""Where motion capture comes from and under which licence, and by which commit weights are trained: what their header
says."""

import os
import subprocess
from pathlib import Path
from typing import Iterable

PERMISSIVE = "PATCHWALK_PERMISSIVE"  # the environment variable that leaves out what is for non-commercial use
NONCOMMERCIAL = "non-commercial"  # what the licence of such a file says, and the name of the folder that holds them
SHIPPED = "joints"  # the name of the stylizer that is used unless another one is named
CONTROLLER = "patchwalk"  # the folder of what the controller made: all of it in its one style
# Folder name of an archive, as it is unpacked: who made it, and its licence.
ARCHIVES = {
    "accad": "ACCAD Open Motion, The Ohio State University (CC BY 3.0)",
    "cmu16": "CMU mocap, mocap.cs.cmu.edu, NSF EIA-0196217 (free to use, not to be resold as is)",
    "cmu69": "CMU mocap, mocap.cs.cmu.edu, NSF EIA-0196217 (free to use, not to be resold as is)",
    "cmu13-steps-jumps": "CMU mocap, mocap.cs.cmu.edu, NSF EIA-0196217 (free to use, not to be resold as is)",
    "cmu91": "CMU mocap, mocap.cs.cmu.edu, NSF EIA-0196217 (free to use, not to be resold as is)",
    "cmu131": "CMU mocap, mocap.cs.cmu.edu, NSF EIA-0196217 (free to use, not to be resold as is)",
    "zombie": "AnimatedDrawings, Meta (MIT)",
    "cc0-quaternius": "Quaternius, Mesh2Motion (CC0 1.0)",
    "snu-biped": "SNU Movement Research Lab (MIT)",
    "snu-styles": "SNU Movement Research Lab (Apache-2.0)",
    "o3de": "Open 3D Engine Contributors (Apache-2.0 or MIT)",
    "100style-neutral": "100STYLE, Ian Mason (CC BY 4.0)",
    CONTROLLER: "motion of Patchwalk's own controller (as its weights)",
    "bandai-namco": "Bandai-Namco Research Motiondataset, Bandai Namco Research Inc. "
    f"(CC BY-NC 4.0: {NONCOMMERCIAL} use only)",
}


def permissive_only() -> bool:
    """Whether this process leaves out all that is for non-commercial use: PATCHWALK_PERMISSIVE=1, or --permissive."""
    return os.environ.get(PERMISSIVE, "0") not in ("", "0")


def noncommercial(folder: Path) -> Path:
    """Beside a folder of the package, the one of the same name with what is for non-commercial use: it may be
    missing."""
    return folder.parent / NONCOMMERCIAL / folder.name


def allowed(folder: Path) -> tuple[Path, ...]:
    """A folder of the package, and its `noncommercial` one where this process may use it."""
    return (folder,) if permissive_only() else (folder, noncommercial(folder))


def credit(folder: Path, files: Iterable[Path]) -> str:
    """Whose clips the files under a data folder are, and their licences; those of no known archive are the user's
    own."""
    found = set()
    for path in files:
        archives = [part for part in path.relative_to(folder.parent).parts if part in ARCHIVES]
        found.add(ARCHIVES[archives[-1]] if archives else "the user's own clips")
    return "; ".join(sorted(found))


def commit() -> str:
    """The commit that this code stands at, "unknown" where it is no checkout or git is not there."""
    try:
        answer = subprocess.run(
            ("git", "rev-parse", "--short", "HEAD"), capture_output=True, text=True, cwd=Path(__file__).parent
        )
    except OSError:
        return "unknown"
    return answer.stdout.strip() or "unknown"
