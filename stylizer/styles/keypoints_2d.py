"""Key points of a person in a video, as OpenPose, AlphaPose and MediaPipe find them.

What becomes of them is what E_S^2D of Aberman et al. 2020 reads: POINTS of `stylizer.systems.unpaired`, in metres about
the hips."""

import warnings
from functools import partial
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter

from sim.motion.clip import FPS
from stylizer.styles import keypoint_files

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


def read_points(path: Path, points: tuple[str, ...], fps: float = 30.0) -> np.ndarray:
    """`points` (frames, n, 2) at 60 Hz in metres about the hips, x to the right of the picture and y up, of the person
    who is in most of the frames, which are `fps` a second. Of a video that nobody is seen in for longer than
    LONGEST_GAP the longest part before or after it is taken, with a warning.

    Raises OSError, or ValueError, in one sentence, where a point is never seen or for too long not, or the file is no
    detector's (see stylizer.styles.keypoint_files)."""
    video = keypoint_files.read_video(path)
    persons = follow_person(video.frames)
    part = longest_part(persons, LONGEST_GAP * fps)
    if len(persons) - (part.stop - part.start) > LONGEST_GAP * fps:
        seconds = (part.stop - part.start) / fps
        warnings.warn(f"{path}: nobody is seen for over {LONGEST_GAP:g} s; {seconds:.1f} s are used", stacklevel=2)
        persons = persons[part]
    if (len(persons) - 1) / fps < SHORTEST:
        raise ValueError(f"{path} holds {len(persons)} frames: give one a frame, {SHORTEST:.1f} s of video or more")
    seen = np.where(persons[..., 2:] > RELIABLE, persons[..., :2], np.nan)
    named = {name: seen[:, index] for index, name in enumerate(video.order)}
    found = np.stack([fill_gaps(point_of(named, name), name, path, fps) for name in points], axis=1)
    return normalize_points(steady(found, fps), points, path, fps)


def longest_part(persons: np.ndarray, gap: float) -> slice:
    """The frames of the longest part of persons (F, n, 3) within which nobody is unseen for more than `gap` frames."""
    seen = np.flatnonzero((persons[..., 2] > RELIABLE).any(axis=1))
    parts = np.split(seen, np.flatnonzero(np.diff(seen) > gap + 1) + 1)
    longest = max(parts, key=len)
    return slice(int(longest[0]), int(longest[-1]) + 1) if len(longest) else slice(0, len(persons))


def follow_person(frames: list[list[np.ndarray]]) -> np.ndarray:
    """One person through all frames (F, n, 3): the surest of the first frame that has any, then who is nearest to where
    they were. Where nobody is seen, confidence is 0."""
    points = next(len(person) for persons in frames for person in persons)
    result = np.zeros((len(frames), points, 3))
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
