"""Key points as detectors write them: OpenPose's folder of one file a frame, AlphaPose's list, MediaPipe's landmarks.

All become the same: for each frame the persons in it, each (n, 3): x, y in pixels, y down, and confidence."""

import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterable

import numpy as np

from sim.io.checks import count_names
from sim.io.text_files import read_json

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
HALPE_26 = [*COCO_17, *"Head Neck MidHip LBigToe RBigToe LSmallToe RSmallToe LHeel RHeel".split()]
MEDIAPIPE_33 = (
    "Nose LEyeInner LEye LEyeOuter REyeInner REye REyeOuter LEar REar LMouth RMouth LShoulder RShoulder LElbow RElbow "
    "LWrist RWrist LPinky RPinky LIndex RIndex LThumb RThumb LHip RHip LKnee RKnee LAnkle RAnkle LHeel RHeel LBigToe "
    "RBigToe"
).split()
ORDERS = {len(order): order for order in (BODY_25, COCO_18, COCO_17, HALPE_26, MEDIAPIPE_33)}
LANDMARKS = ("pose_landmarks", "poseLandmarks", "landmarks", "keypoints")  # what MediaPipe's frames call their points
PICTURE = (16.0, 9.0)  # width and height, of a video whose file does not say them
LARGEST_GAP = 100_000  # frames between two file names, beyond which they do not count frames

Person = np.ndarray
Frames = list[list[Person]]


@dataclass(frozen=True)
class Video:
    """The persons in each frame; missing frames have none."""

    frames: Frames

    @property
    def order(self) -> list[str]:
        """The names of the points."""
        return ORDERS[next(len(person) for persons in self.frames for person in persons)]


def read_video(path: Path) -> Video:
    """The key points in a folder with one file a frame, or in one file.

    Raises OSError, or ValueError, in one sentence, for what no detector wrote."""
    path = Path(path)
    frames = _frames_of_folder(path) if path.is_dir() else _frames_of_file(path)
    sizes = {len(person) for persons in frames for person in persons}
    if not sizes:
        raise ValueError(f"nobody is seen in the key points of {path}: give a video of a person")
    if len(sizes) > 1:
        raise ValueError(f"the key points in {path} change their order on the way: give one order for all frames")
    return Video(frames)


def is_one_file(path: Path) -> bool:
    """Whether a path names a file of key points."""
    return path.suffix.lower() == ".json" and path.is_file()


def _frames_of_folder(folder: Path) -> Frames:
    """By the last number in each file's name; a number that is not there is a frame that nobody was seen in."""
    files = sorted(folder.glob("*.json"))
    numbers = [_last_number(path.stem) for path in files]
    if None in numbers or len(set(numbers)) < len(numbers) or len(files) < 2:  # names do not count frames
        return [_people(path) for path in files]
    by_number = dict(sorted(zip(numbers, files)))
    counts = np.array(list(by_number))
    steps = np.diff(counts)
    step = int(np.bincount(steps).argmax()) if steps.max() < LARGEST_GAP else 1
    places = np.concatenate([[0], np.maximum(np.rint(steps / step), 1).cumsum()]).astype(int)
    if places[-1] > LARGEST_GAP:
        raise ValueError(f"the file names in {folder} do not count frames: number them one after the other")
    frames: Frames = [[] for _ in range(int(places[-1]) + 1)]
    for place, path in zip(places, by_number.values()):
        frames[place] = _people(path)
    if missing := len(frames) - len(files):
        ends = [
            f"{a + step} to {b - step}" if b > a + 2 * step else f"{a + step}"
            for a, b in zip(counts, counts[1:])
            if b > a + step
        ]
        warnings.warn(f"{folder}: {missing} frames are missing ({count_names(ends)})", stacklevel=4)
    return frames


def _last_number(stem: str) -> int | None:
    found = re.findall(r"\d{1,15}", stem)
    return int(found[-1]) if found else None


def _people(path: Path) -> list[Person]:
    """The persons in the file of one frame."""
    content = read_json(path)
    if isinstance(content, dict) and "people" in content:
        return _persons(path, content["people"], "pose_keypoints_2d")
    frames = _landmarks(path, [content])
    return frames[0]


def _frames_of_file(path: Path) -> Frames:
    """AlphaPose's results, a list of persons that each name their picture, or MediaPipe's, a list of frames."""
    content = read_json(path)
    if isinstance(content, list) and content and isinstance(content[0], dict) and "image_id" in content[0]:
        return _alphapose(path, content)
    if isinstance(content, dict) and isinstance(content.get("frames"), list):
        return _landmarks(path, content["frames"], content)
    if isinstance(content, list) and content:
        return _landmarks(path, content)
    raise _unknown(path)


def _alphapose(path: Path, persons: list[Any]) -> Frames:
    by_frame: dict[int, list[Any]] = {}
    for person in persons:
        number = _last_number(str(person.get("image_id"))) if isinstance(person, dict) else None
        if number is None or number > LARGEST_GAP * 10:
            raise ValueError(f"{path}: a person's image_id counts no frame: give AlphaPose's own results")
        by_frame.setdefault(number, []).append(person)
    first, last = min(by_frame), max(by_frame)
    if last - first > LARGEST_GAP:
        raise ValueError(f"{path}: the image_ids do not count frames: give AlphaPose's own results")
    return [_persons(path, by_frame.get(number, ()), "keypoints") for number in range(first, last + 1)]


def _persons(path: Path, persons: Iterable[Any], key: str) -> list[Person]:
    """Persons whose points are one list x, y, confidence, x, y ..."""
    try:
        found = [np.array(person[key], dtype=float).reshape(-1, 3) for person in persons]
    except (ValueError, KeyError, TypeError):
        raise _unknown(path) from None
    return [_checked(path, person) for person in found]


def _landmarks(path: Path, frames: list[Any], whole: dict[str, Any] | None = None) -> Frames:
    """Frames of MediaPipe's landmarks, in shares of the picture's width and height, of one person each."""
    width, height = (whole or {}).get("width"), (whole or {}).get("height")
    known = all(isinstance(side, (int, float)) and 0 < side < 1e5 for side in (width, height))
    size = np.array([width, height] if known else PICTURE, float)
    size *= 1000 / size.max()
    result: Frames = []
    for frame in frames:
        if isinstance(frame, dict) and not any(key in frame for key in LANDMARKS):
            raise _unknown(path)
        points = next((frame[key] for key in LANDMARKS if frame.get(key)), []) if isinstance(frame, dict) else frame
        try:
            if points and isinstance(points[0], list):  # a list of persons, of which MediaPipe finds one
                points = points[0]
            found = np.array([[p["x"], p["y"], p.get("visibility", 1.0)] for p in points or []], dtype=float)
        except (KeyError, TypeError, ValueError, AttributeError):
            raise _unknown(path) from None
        if len(found):
            in_shares = np.abs(found[:, :2]).max() < 10
            found[:, :2] *= size if in_shares else 1.0
            result.append([_checked(path, found)])
        else:
            result.append([])
    if not known and whole is not None:
        warnings.warn(
            f"{path} does not say the picture's width and height: it is taken to be {PICTURE[0]:g} by {PICTURE[1]:g}",
            stacklevel=4,
        )
    return result


def _checked(path: Path, person: Person) -> Person:
    if len(person) not in ORDERS:
        raise ValueError(
            f"{path} has {len(person)} points a person: give BODY_25 (25), COCO (18 or 17), Halpe (26) "
            "or MediaPipe (33)"
        )
    if not np.isfinite(person).all() or np.abs(person).max() > 1e6:
        raise ValueError(f"{path} holds key points that are no places in a picture")
    return person


def _unknown(path: Path) -> ValueError:
    return ValueError(
        f"{path} holds no key points that are known: give a folder as OpenPose's --write_json makes it, "
        "AlphaPose's results, or MediaPipe's landmarks"
    )
