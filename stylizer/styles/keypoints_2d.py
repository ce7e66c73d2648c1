"""Key points of a person in a video, as OpenPose writes them: one JSON file a frame, in the BODY_25 or the COCO order.

What becomes of them is what E_S^2D of Aberman et al. 2020 reads: POINTS of `stylizer.systems.unpaired`, in metres about
the hips."""

from functools import partial
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter

from sim.io.text_files import read_json
from sim.motion.clip import FPS

RELIABLE = 0.1  # confidence under which a point counts as not seen
LONGEST_GAP = 1.0  # seconds that a point may be missing; what lies between is a straight line
MEDIAN, SMOOTHING = 5, 0.03  # frames, and seconds (Gaussian sigma): outliers, then jitter
SHORTEST = 32 / 30  # seconds: one window of style
TORSO = 0.51  # metres from between the hip joints to between the shoulder joints, of our skeleton
SMALLEST_TORSO = 2.0  # pixels

# Our point -> those of a detector whose mean it is, by name.
SOURCES = {
    "Hips": ("RHip", "LHip"),
    "Neck": ("RShoulder", "LShoulder"),
    **{
        f"{side}{ours}": (f"{side[0]}{theirs}",)
        for side in ("Left", "Right")
        for ours, theirs in {
            "UpLeg": "Hip",
            "Leg": "Knee",
            "Foot": "Ankle",
            "Arm": "Shoulder",
            "ForeArm": "Elbow",
            "Hand": "Wrist",
        }.items()
    },
}
HEAD = (("REar", "LEar"), ("Nose",))  # the ears' middle, and where they are not seen the nose

BODY_25 = (
    "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist MidHip RHip RKnee RAnkle LHip LKnee LAnkle REye LEye "
    "REar LEar LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel"
).split()
COCO_18 = (
    "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist RHip RKnee RAnkle LHip LKnee LAnkle REye LEye REar LEar"
).split()
COCO_17 = (
    "Nose LEye REye LEar REar LShoulder RShoulder LElbow RElbow LWrist RWrist LHip RHip LKnee RKnee LAnkle RAnkle"
).split()
ORDERS = {len(order): order for order in (BODY_25, COCO_18, COCO_17)}


def read(folder: Path, points: tuple[str, ...], fps: float = 30.0) -> np.ndarray:
    """`points` (frames, n, 2) at 60 Hz in metres about the hips, x to the right of the picture and y up, of the person
    who is in most of the frames' files, which are taken in the order of their names, `fps` a second.

    Raises ValueError, in one sentence, where a point is never seen or for too long not, or a file is none of
    OpenPose's."""
    files = sorted(Path(folder).glob("*.json"))
    if (len(files) - 1) / fps < SHORTEST:
        raise ValueError(
            f"{folder} holds {len(files)} .json files: give one a frame, {SHORTEST:.1f} s of video or more"
        )
    frames = follow_person([people(path) for path in files])
    order = ORDERS[frames.shape[1]]
    seen = np.where(frames[..., 2:] > RELIABLE, frames[..., :2], np.nan)
    named = {name: seen[:, index] for index, name in enumerate(order)}
    found = np.stack([fill_gaps(point_of(named, name), name, folder, fps) for name in points], axis=1)
    return normalize_points(steady(found, fps), points, folder, fps)


def people(path: Path) -> list[np.ndarray]:
    """The persons in one frame, each (n, 3): x, y in pixels, y down, and confidence. Raises ValueError for another
    file."""
    try:
        found = [
            np.array(person["pose_keypoints_2d"], dtype=float).reshape(-1, 3) for person in read_json(path)["people"]
        ]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{path} holds no OpenPose key points: give files as OpenPose's --write_json makes them"
        ) from error
    for person in found:
        if len(person) not in ORDERS:
            raise ValueError(f"{path} has {len(person)} points a person: give BODY_25 (25) or COCO (18 or 17)")
    return found


def follow_person(frames: list[list[np.ndarray]]) -> np.ndarray:
    """One person through all frames (F, n, 3): the surest of the first frame that has any, then who is nearest to where
    they were. Where nobody is seen, confidence is 0. Raises ValueError where nobody ever is, or the order of points
    changes."""
    sizes = {len(person) for persons in frames for person in persons}
    if len(sizes) != 1:
        raise ValueError(
            "nobody is seen in the key points: give a video of a person"
            if not sizes
            else "the key points change their order on the way: give one of BODY_25 and COCO for all frames"
        )
    result = np.zeros((len(frames), sizes.pop(), 3))
    last: np.ndarray | None = None
    for frame, persons in enumerate(frames):
        if not persons:
            continue
        if last is None:
            chosen = max(persons, key=lambda person: person[:, 2].sum())
        else:
            chosen = min(persons, key=partial(distance, last))
        result[frame] = chosen
        last = np.where(chosen[:, 2:] > RELIABLE, chosen, last if last is not None else chosen)
    return result


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance in pixels of the points (n, 3) that both have; without any, none is farther."""
    both = (a[:, 2] > RELIABLE) & (b[:, 2] > RELIABLE)
    return float(np.linalg.norm(a[both, :2] - b[both, :2], axis=1).mean()) if both.any() else np.inf


def point_of(named: dict[str, np.ndarray], name: str) -> np.ndarray:
    """(F, 2) of one of our points, nan where it is not seen."""
    if name != "Head":
        return np.mean([named[source] for source in SOURCES[name]], axis=0)
    ears, nose = (np.mean([named[source] for source in sources], axis=0) for sources in HEAD)
    return np.where(np.isnan(ears), nose, ears)


def fill_gaps(point: np.ndarray, name: str, folder: Path, fps: float) -> np.ndarray:
    """(F, 2) with its gaps closed by straight lines, and held at the ends."""
    seen = np.flatnonzero(~np.isnan(point[:, 0]))
    if not len(seen):
        raise ValueError(f"{name} is never seen in {folder}: give a video that shows the whole body")
    gap = np.diff(np.concatenate([[-1], seen, [len(point)]])).max() - 1
    if gap > LONGEST_GAP * fps:
        raise ValueError(
            f"{name} is not seen for {gap / fps:.1f} s in {folder}: give a stretch that shows the whole body"
        )
    frames = np.arange(len(point))
    return np.stack([np.interp(frames, seen, point[seen, axis]) for axis in (0, 1)], axis=1)


def steady(points: np.ndarray, fps: float) -> np.ndarray:
    """(F, n, 2) without outliers of a frame or two, and without jitter."""
    points = median_filter(points, (MEDIAN, 1, 1), mode="nearest")
    return gaussian_filter1d(points, SMOOTHING * fps, axis=0, mode="nearest")


def normalize_points(points: np.ndarray, names: tuple[str, ...], folder: Path, fps: float) -> np.ndarray:
    """(F, n, 2) in pixels -> metres about the hips at 60 Hz: the torso's usual length says how large the person is."""
    points = (points - points[:, [names.index("Hips")]]) * (1.0, -1.0)
    torso = float(np.median(np.linalg.norm(points[:, names.index("Neck")], axis=-1)))
    if torso < SMALLEST_TORSO:
        raise ValueError(f"the person in {folder} is too small to see: give key points in pixels")
    captured = np.arange(len(points)) / fps
    wanted = np.arange(0, captured[-1] + 1e-9, 1 / FPS)
    flat = points.reshape(len(points), -1) * (TORSO / torso)
    return np.stack([np.interp(wanted, captured, column) for column in flat.T], axis=1).reshape(len(wanted), -1, 2)
