"""Motion in SMPL's and AMASS's .npz files: rotation vectors of a body of 22 joints, and where it goes.

The files hold no bones; what is needed of them is how long the legs are, so a body of usual proportions serves."""

import zipfile
from pathlib import Path

import numpy as np

from sim.io.bvh import Motion
from sim.io.bvh_parser import LARGEST_NUMBER, MAX_SECONDS, POSITION_ORDER, ROTATION_ORDER
from sim.math import rotations as rot

MAX_MEGABYTES = 256  # of the arrays that are read
MEGABYTE = 1_000_000
# Joint, parent, offset in metres in the T-pose, which faces +Z: SMPL's order.
_TABLE = (
    ("Pelvis", None, (0.0, 0.0, 0.0)),
    ("L_Hip", "Pelvis", (0.07, -0.09, 0.0)),
    ("R_Hip", "Pelvis", (-0.07, -0.09, 0.0)),
    ("Spine1", "Pelvis", (0.0, 0.12, 0.0)),
    ("L_Knee", "L_Hip", (0.03, -0.38, 0.0)),
    ("R_Knee", "R_Hip", (-0.03, -0.38, 0.0)),
    ("Spine2", "Spine1", (0.0, 0.13, 0.0)),
    ("L_Ankle", "L_Knee", (0.0, -0.40, -0.03)),
    ("R_Ankle", "R_Knee", (0.0, -0.40, -0.03)),
    ("Spine3", "Spine2", (0.0, 0.06, 0.0)),
    ("L_Foot", "L_Ankle", (0.03, -0.06, 0.12)),
    ("R_Foot", "R_Ankle", (-0.03, -0.06, 0.12)),
    ("Neck", "Spine3", (0.0, 0.21, 0.0)),
    ("L_Collar", "Spine3", (0.08, 0.12, 0.0)),
    ("R_Collar", "Spine3", (-0.08, 0.12, 0.0)),
    ("Head", "Neck", (0.0, 0.09, 0.05)),
    ("L_Shoulder", "L_Collar", (0.10, 0.04, 0.0)),
    ("R_Shoulder", "R_Collar", (-0.10, 0.04, 0.0)),
    ("L_Elbow", "L_Shoulder", (0.26, 0.0, 0.0)),
    ("R_Elbow", "R_Shoulder", (-0.26, 0.0, 0.0)),
    ("L_Wrist", "L_Elbow", (0.25, 0.0, 0.0)),
    ("R_Wrist", "R_Elbow", (-0.25, 0.0, 0.0)),
)
NAMES = [name for name, _, _ in _TABLE]
PARENTS = [-1 if parent is None else NAMES.index(parent) for _, parent, _ in _TABLE]
OFFSETS = np.array([offset for _, _, offset in _TABLE])
POSES, PLACES = ("poses", "smpl_poses", "fullpose"), ("trans", "smpl_trans", "transl")
RATES = ("mocap_framerate", "mocap_frame_rate", "fps", "framerate")


def read(path: str | Path, fps: float | None = None) -> Motion:
    """The motion in an .npz of SMPL poses, at the rate that it says or at `fps`.

    Raises OSError, or ValueError, naming the file, for what holds no such poses."""
    arrays = _arrays(Path(path))
    poses = next((arrays[name] for name in POSES if name in arrays), None)
    if poses is None:
        raise ValueError(f"{path} holds no SMPL poses: it has to have an array '{POSES[0]}', as AMASS's files do")
    vectors = poses.reshape(len(poses), -1) if poses.ndim > 1 else poses.reshape(1, -1)
    if len(vectors) < 1 or vectors.shape[1] < 3 * len(NAMES):
        raise ValueError(f"{path}: '{POSES[0]}' has to hold {3 * len(NAMES)} numbers or more a frame")
    places = next((arrays[name] for name in PLACES if name in arrays), np.zeros((len(vectors), 3)))
    if places.shape != (len(vectors), 3):
        raise ValueError(f"{path}: 'trans' has to hold 3 numbers for each of the {len(vectors)} frames")
    if not all((np.abs(values) <= LARGEST_NUMBER).all() for values in (vectors, places)):
        raise ValueError(f"{path}: some of its numbers are no motion's")
    rate = next((arrays[name] for name in RATES if name in arrays), None)
    if fps is None and (rate is None or rate.size != 1 or not 1 <= float(rate.reshape(-1)[0]) <= 1000):
        raise ValueError(f"{path} does not say its frame rate: say how many frames a second with --fps")
    fps = fps or float(rate.reshape(-1)[0])  # type: ignore[union-attr]  # checked in the lines above
    if len(vectors) > MAX_SECONDS * fps:
        raise ValueError(f"{path} lasts {len(vectors) / fps / 60:.0f} minutes: cut it to {MAX_SECONDS // 60} at most")
    rotations = rot.from_rotation_vector(vectors[:, : 3 * len(NAMES)].reshape(len(vectors), len(NAMES), 3))
    positions = np.tile(OFFSETS, (len(vectors), 1, 1))
    positions[:, 0] = places
    channels: list[tuple[str, ...]] = [POSITION_ORDER + ROTATION_ORDER] + [ROTATION_ORDER] * (len(NAMES) - 1)
    return Motion(list(NAMES), list(PARENTS), OFFSETS.copy(), {}, channels, fps, positions, rotations)


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """The arrays of numbers that are needed; nothing is unpickled."""
    wanted = {*POSES, *PLACES, *RATES}
    try:
        with zipfile.ZipFile(path) as archive:
            sizes = [entry.file_size for entry in archive.infolist() if entry.filename.removesuffix(".npy") in wanted]
        if sum(sizes) > MAX_MEGABYTES * MEGABYTE:
            raise ValueError(f"{path} holds more than {MAX_MEGABYTES} MB of poses: cut it into smaller files")
        with np.load(path, allow_pickle=False) as file:
            return {name: np.asarray(file[name], dtype=float) for name in file.files if name in wanted}
    except OSError:
        raise
    except ValueError as error:
        raise error if str(path) in str(error) else ValueError(f"{path} is no .npz of poses: {error}") from None
    except Exception as error:  # a damaged archive fails in many ways
        raise ValueError(f"{path} is no .npz of poses: {type(error).__name__}") from error
