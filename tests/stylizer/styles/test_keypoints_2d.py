"""Key points of a video: what a known body looks like through a known camera is read back, gaps, jitter and bystanders
or not."""

import json
import warnings

import numpy as np
import pytest

from stylizer.styles import keypoints_2d
from stylizer.styles.keypoint_files import BODY_25, COCO_17, COCO_18, HALPE_26, MEDIAPIPE_33
from stylizer.styles.keypoints_2d import TORSO
from stylizer.systems.unpaired import POINTS

FRAMES, FPS = 50, 30.0
PIXELS = 180.0  # a metre


def body() -> np.ndarray:
    """(frames, 15, 2) metres about the hips, y up: a figure that swings its hands and lifts its feet."""
    at = {
        "Hips": (0, 0),
        "Neck": (0, TORSO),
        "Head": (0, 0.65),
        "LeftUpLeg": (0.1, 0),
        "RightUpLeg": (-0.1, 0),
        "LeftLeg": (0.1, -0.45),
        "RightLeg": (-0.1, -0.45),
        "LeftFoot": (0.1, -0.85),
        "RightFoot": (-0.1, -0.85),
        "LeftArm": (0.2, TORSO),
        "RightArm": (-0.2, TORSO),
        "LeftForeArm": (0.3, 0.2),
        "RightForeArm": (-0.3, 0.2),
        "LeftHand": (0.35, 0),
        "RightHand": (-0.35, 0),
    }
    result = np.tile(np.array([at[name] for name in POINTS], float), (FRAMES, 1, 1))
    swing = np.sin(2 * np.pi * np.arange(FRAMES) / FPS)
    for name, sign in (("LeftHand", 1), ("RightHand", -1), ("LeftFoot", -1), ("RightFoot", 1)):
        result[:, POINTS.index(name), 1] += 0.1 * sign * swing
    return result


def detected(points: np.ndarray, order, where=(640.0, 360.0)) -> np.ndarray:
    """(frames, n, 3) as a detector sees it: pixels, y down, confidence; what the figure has no point for is near the
    head."""
    theirs = {theirs: name for name, sources in keypoints_2d.SOURCES.items() if len(sources) == 1 for theirs in sources}
    result = np.empty((len(points), len(order), 3))
    for place, name in enumerate(order):
        ours = "Hips" if name == "MidHip" else "Neck" if name == "Neck" else theirs.get(name, "Head")
        result[:, place, :2] = np.array(where) + points[:, POINTS.index(ours)] * (PIXELS, -PIXELS)
    result[..., 2] = 0.9
    return result


def write(folder, *people):
    folder.mkdir(exist_ok=True)
    for frame in range(len(people[0])):
        listed = [
            {"pose_keypoints_2d": person[frame].ravel().tolist()} for person in people if np.any(person[frame, :, 2])
        ]
        (folder / f"video_{frame:012d}_keypoints.json").write_text(json.dumps({"version": 1.3, "people": listed}))
    return folder


def read_back(folder):
    """Every second frame of 60 Hz, without the ends that smoothing bends."""
    return keypoints_2d.read_points(folder, POINTS, FPS)[::2][3:-3]


@pytest.mark.parametrize("order", [BODY_25, COCO_18, COCO_17, HALPE_26, MEDIAPIPE_33])
def test_a_figure_is_read_back_in_metres_from_any_order(tmp_path, order):
    found = read_back(write(tmp_path / "points", detected(body(), order)))
    assert found.shape == (FRAMES - 6, 15, 2)
    assert np.abs(found - body()[3:-3]).max() < 0.01


def test_gaps_jitter_and_outliers_hardly_show(tmp_path):
    random, seen = np.random.default_rng(0), detected(body(), BODY_25)
    seen[..., :2] += random.normal(0, 1.5, seen[..., :2].shape)
    seen[random.random(seen.shape[:2]) < 0.15, 2] = 0.0  # missing
    seen[seen[..., 2] == 0, :2] = 0.0
    seen[20, BODY_25.index("RWrist"), :2] += 400
    seen[30:34] = 0.0  # nobody is seen at all
    found = read_back(write(tmp_path / "points", seen))
    assert np.abs(found - body()[3:-3]).mean() < 0.01 and np.abs(found - body()[3:-3]).max() < 0.08
    shaking = [np.abs(np.diff(points, 2, axis=0)).mean() for points in (found, seen[3:-3, :15, :2] / PIXELS)]
    assert shaking[0] < 0.25 * shaking[1]


def test_one_person_is_followed_among_others(tmp_path):
    ours, other = detected(body(), BODY_25), detected(body()[::-1], BODY_25, (200.0, 300.0))
    other[..., 2] = 0.5
    other[25:, :, 2] = 0.99  # surer later on, but somebody else
    found = read_back(write(tmp_path / "points", other, ours))
    assert np.abs(found - body()[3:-3]).max() < 0.01


def test_other_frame_rates_become_sixty(tmp_path):
    found = keypoints_2d.read_points(write(tmp_path / "points", detected(body(), COCO_18)), POINTS, 25.0)
    assert len(found) == int((FRAMES - 1) / 25 * 60) + 1


def renumber(folder, number):
    """Renames the files of a folder: frame -> the text that stands for it, None to remove it."""
    for frame, path in enumerate(sorted(folder.glob("*.json"))):
        text = number(frame)
        path.unlink() if text is None else path.rename(folder / f"v_{text}_keypoints.json")
    return folder


def test_files_are_taken_in_the_order_of_their_numbers(tmp_path):
    folder = renumber(write(tmp_path / "points", detected(body(), BODY_25)), str)
    assert np.abs(read_back(folder) - body()[3:-3]).max() < 0.01
    (folder / "v_7_keypoints.json").write_bytes(b"\xef\xbb\xbf" + (folder / "v_7_keypoints.json").read_bytes())
    assert np.abs(read_back(folder) - body()[3:-3]).max() < 0.01, "a byte order mark is no mistake"


def test_every_other_frame_of_a_video_is_no_gap(tmp_path, recwarn):
    folder = renumber(write(tmp_path / "points", detected(body(), BODY_25)), lambda frame: str(2 * frame))
    assert np.abs(read_back(folder) - body()[3:-3]).max() < 0.01 and not recwarn.list


def test_missing_numbers_are_missing_frames_that_are_filled_in(tmp_path):
    folder = write(tmp_path / "points", detected(body(), BODY_25))
    renumber(folder, lambda frame: None if frame in (20, 30, 31) else str(frame))
    with pytest.warns(UserWarning, match=r"3 frames are missing \(20, 30 to 31\)"):
        found = read_back(folder)
    assert found.shape == (FRAMES - 6, 15, 2) and np.abs(found - body()[3:-3]).max() < 0.05


def test_a_gap_beyond_a_second_parts_the_video_with_a_warning(tmp_path):
    folder = write(tmp_path / "points", detected(body(), BODY_25))
    renumber(folder, lambda frame: str(frame + 40 * (frame >= 10)))
    with pytest.warns(UserWarning, match="nobody is seen for over 1 s; 1.3 s are used"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "40 frames are missing|.*: 40 frames are missing")
        found = keypoints_2d.read_points(folder, POINTS, FPS)
    assert np.abs(found[::2][3:-3] - body()[13:-3]).max() < 0.01


def test_alphapose_results_are_read(tmp_path):
    seen, other = detected(body(), COCO_17), detected(body(), COCO_17, (1200.0, 300.0)) * [1, 1, 0.2]
    people = [
        {"image_id": f"{frame}.jpg", "category_id": 1, "keypoints": person[frame].ravel().tolist(), "score": 2.5}
        for frame in range(FRAMES)
        for person in (other, seen)
        if frame != 20
    ]
    path = tmp_path / "alphapose-results.json"
    path.write_text(json.dumps(people))
    found = read_back(path)
    assert found.shape == (FRAMES - 6, 15, 2) and np.abs(found - body()[3:-3]).max() < 0.03


def test_mediapipe_landmarks_are_read_in_shares_of_the_picture(tmp_path):
    seen = detected(body(), MEDIAPIPE_33) / [1080.0, 1920.0, 1.0]
    frames = [
        {"pose_landmarks": [{"x": x, "y": y, "z": 0.0, "visibility": v} for x, y, v in frame.tolist()]}
        for frame in seen
    ]
    frames[20] = {"pose_landmarks": None}
    path = tmp_path / "landmarks.json"
    path.write_text(json.dumps({"width": 1080, "height": 1920, "frames": frames}))
    assert np.abs(read_back(path) - body()[3:-3]).max() < 0.03
    path.write_text(json.dumps({"frames": frames}))
    with pytest.warns(UserWarning, match="does not say the picture's width and height"):
        read_back(path)


@pytest.mark.parametrize(
    "text",
    [
        "[1]",
        "[[]]",
        "{}",
        '"a"',
        '[{"image_id": "x"}]',
        '[{"image_id": "1", "k": 1}]',
        '{"frames": [{"pose_landmarks": [{"x": []}]}]}',
        "[" * 5000,
    ],
)
def test_a_file_that_no_detector_wrote_is_refused(tmp_path, text):
    path = tmp_path / "points.json"
    path.write_text(text)
    with pytest.raises(ValueError, match="points.json"):
        keypoints_2d.read_points(path, POINTS, FPS)


@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda folder, seen: write(folder, seen[:20]), "holds 20 frames: give one a frame"),
        (
            lambda folder, seen: (write(folder, seen), (folder / "a.json").write_text("{}")),
            "holds no key points that are known",
        ),
        (lambda folder, seen: write(folder, seen[:, :20]), "has 20 points a person"),
        (lambda folder, seen: write(folder, seen * 0), "nobody is seen"),
        (
            lambda folder, seen: write(folder, np.where(np.arange(25)[:, None] == BODY_25.index("LWrist"), 0, seen)),
            "LeftHand is never seen",
        ),
        (
            lambda folder, seen: write(folder, np.where(np.arange(FRAMES)[:, None, None] > 15, 0, seen)),
            "holds 16 frames",
        ),
    ],
)
def test_what_cannot_be_used_is_said_in_a_sentence(tmp_path, spoil, message):
    folder = tmp_path / "points"
    spoil(folder, detected(body(), BODY_25))
    with pytest.raises(ValueError, match=message), warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*nobody is seen for over")
        keypoints_2d.read_points(folder, POINTS, FPS)
