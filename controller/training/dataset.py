"""Training data of the controller: clips to frames of trajectory, pose and what comes next."""

import hashlib
import math
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Callable, Sequence, TypeVar

import numpy as np
from tqdm import tqdm

from controller.model.gait_phase import label_gait
from controller.model.io_layout import (
    FUTURE,
    GAITS,
    INPUT,
    INPUT_SIZE,
    INPUT_SLICES,
    OFFSETS,
    OUTPUT_SIZE,
    OUTPUT_SLICES,
    SIDES,
)
from controller.training.cyclic_runs import find_loops
from controller.training.labelled_clip import LabelledClip, label
from controller.training.leaps import find_flights
from controller.training.shared_posture import share_posture
from controller.training.side_steps import find_uncrossed
from controller.training.terrain_fit import Placed, fit_to_ground
from sim.body.skeleton import TOES
from sim.feet.contact_correction import plant_feet, scale_strides
from sim.ground.ground import Ground
from sim.ground.terrains import make_hills, make_rough, make_stairs
from sim.io import bvh
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip, RootFrame, root_frame
from sim.motion.contacts import foot_contacts
from sim.motion.thresholds import MOVING_FRAME
from sim.retarget.retarget import to_clip

# Clips that a neutral walker should not learn from: not locomotion, walks in a style of their own, or captures whose
# feet are broken (CMU 69_35, the ACCAD man's runs: a foot points backward, hips run at knee height). Matched against
# the path.
NOT_NEUTRAL = re.compile(
    r"bandai-namco|snu-tennis|cmu13-|cmu91|cmu131|zombie|quaternius|Box|Lie|Crawl|Crouch(?!ing)|Skip|Hop|Leap|Jump|CartWheel|Random|Urban|Conversation|Wait|Look|Sway|Swing"
    r"|Azuma|HandWav|Lean|SameSame|Soldier|Sukiko|TongTong|_style_|low_walk|wide_ext|lineup|Neutral_TR|69_35|Male1_C(0[3-9]|1)"
)
# Of those, and beside them: what jumps over level floor, of which only the jumps are learned, and what crouches.
JUMPS = re.compile(r"WalkToLeap|Walk2Leap|RunToJump|Run2Jump|cmu13-.*13_(11|13|19|32|39|4\d)|o3de.*Jumps|91_5[23]")
CROUCHES = re.compile(r"o3de.*Crouching")
HELD_OUT_SHARE = 0.1
MINIMUM_SECONDS = 0.7
# At which pace and with strides how much longer a clip is learned, by kind of movement: captured side-steps and backing
# is leisurely and captured running all but a sprint, while the stick asks for every speed in between.
LEISURELY = ((0.75, 1.0), (1.0, 1.0), (1.3, 1.25), (1.6, 1.5))
PACES = {
    "forward walk": ((1.0, 1.0), (1.3, 1.0)),
    "side-step": LEISURELY,
    "backing": LEISURELY,
    "run": ((1.0, 1.0), (0.8, 1.0), (0.65, 1.0)),
    "loop": ((1.0, 1.0), (0.8, 1.0), (0.65, 1.0), (1.1, 1.15)),
    "stand": ((1.0, 1.0),),
    "crouch": ((1.0, 1.0), (0.8, 1.0), (1.2, 1.1)),
    "jump": ((1.0, 1.0), (1.0, 1.3), (1.0, 1.6)),
}
# How fast, in metres a second, a quicker clip may become.
FASTEST = {"forward walk": 2.4, "side-step": 1.4, "backing": 1.9, "loop": 4.5, "crouch": 1.8, "jump": 4.0}
# Seconds of a jump that are learned: before it leaves the floor, and after it lands.
JUMP_WINDOW = (0.5, 0.9)
# The grounds that every clip is laid on beside level floor, one of each pace, in turn: what makes it, how much of it.
TERRAINS = (
    (make_hills, 0.47),
    (make_stairs, 0.18),
    (make_hills, 0.36),
    (make_rough, 0.05),
    (make_stairs, 0.13),
    (make_hills, 0.25),
)
LEVEL = 0.05  # metres between highest and lowest under which the ground of a trajectory is level
# How much more often than by rarity a frame of a jump is drawn, and how much more seldom one of uneven ground.
JUMP_WEIGHT, UNEVEN_WEIGHT = 2.5, 0.5
T = TypeVar("T")
PLANTED_TOE = (-0.015, 0.06)  # metres: where a planted toe's mean height must lie, or the clip's feet cannot be trusted


@dataclass
class Frames:
    """Frames of all clips end to end; entry t and t + 1 follow each other where `last` is False.

    inputs (N, INPUT_SIZE), targets (N, OUTPUT_SIZE): the frame after, as the network should give; phase (N,) radians;
    weight (N,) how often to draw it; held_out (N,) bool; last (N,) bool: the clip's last usable frame; clip (N,) index
    into `names`, the clips' names."""

    inputs: np.ndarray
    targets: np.ndarray
    phase: np.ndarray
    weight: np.ndarray
    held_out: np.ndarray
    last: np.ndarray
    clip: np.ndarray
    names: list[str]


def is_held_out(name: str) -> bool:
    """The fixed split: by a hash of the clip's name, so that it never depends on what else is in the folder."""
    return int(hashlib.md5(name.encode()).hexdigest(), 16) % 1000 < HELD_OUT_SHARE * 1000


def frames_of(source: LabelledClip) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """inputs (F - 1, INPUT_SIZE), targets (F - 1, OUTPUT_SIZE), phase (F - 1,) of a labelled clip.

    Before its first and after its last frame a clip is taken to go on straight at the speed it has there."""
    clip, root, phase = source.clip, source.root(), source.phase
    positions = clip.positions()
    to_root = rot.from_yaw(-root.facing)
    now, following = slice(0, -1), slice(1, None)
    pose = {
        "positions": rot.rotate(to_root[:, None], positions - root.positions[:, None]),
        "velocities": rot.rotate(to_root[:, None], np.gradient(positions, 1 / FPS, axis=0)),
        "rotations": rot.to_6d(rot.multiply(to_root[:, None], clip.global_rotations())),
        "contacts": source.contacts,
    }
    known = {**_trajectory_samples(source, root, OFFSETS, "trajectory"), **pose}
    step = rot.rotate(to_root[now], root.positions[following] - root.positions[now])
    target = {**pose, **_trajectory_samples(source, root, FUTURE, "future")}
    target["future_positions"] = target["future_positions"][..., ::2]
    target = {name: value[following] for name, value in target.items()}
    target["root"] = np.stack([step[:, 0], step[:, 2], np.diff(root.facing)], axis=-1)
    target["phase"] = np.diff(phase)[:, None]
    return (
        _flat({name: known[name][now] for name in INPUT_SLICES}, INPUT_SLICES, INPUT_SIZE),
        _flat(target, OUTPUT_SLICES, OUTPUT_SIZE),
        np.mod(phase[now], 2 * np.pi).astype(np.float32),
    )


def _trajectory_samples(
    source: LabelledClip, root: RootFrame, offsets: tuple[int, ...], prefix: str
) -> dict[str, np.ndarray]:
    """Where the root is at `offsets` from each frame, as seen from that frame, by the network's names for it:
    `prefix`_positions (F, n, 3), `prefix`_directions (F, n, 2), `prefix`_gaits (F, n, GAITS) and `prefix`_heights
    (F, n, SIDES)."""
    frames = len(root.facing)
    at = np.arange(frames)[:, None] + np.array(offsets)
    inside = np.clip(at, 0, frames - 1)
    first, last = (
        (root.positions[min(3, frames - 1)] - root.positions[0]) / 3,
        (root.positions[-1] - root.positions[-4]) / 3,
    )
    there = root.positions[inside] + np.where((at < 0)[..., None], first, last) * (at - inside)[..., None]
    there[..., 1] = source.smooth_height_at(there[..., ::2]) + source.lift[inside]
    local = rot.rotate(rot.from_yaw(-root.facing)[:, None], there - root.positions[:, None])
    angle = root.facing[inside] - root.facing[:, None]
    velocity, turn_rate = np.gradient(root.positions[:, [0, 2]], 1 / FPS, axis=0), np.gradient(root.facing, 1 / FPS)
    gaits = label_gait(velocity, turn_rate)
    gaits[:, GAITS.index("crouch")], gaits[:, GAITS.index("jump")] = source.crouch, source.jump
    left = np.stack([np.cos(root.facing), -np.sin(root.facing)], axis=-1)[inside]
    beside = there[..., None, ::2] + np.array(SIDES)[:, None] * left[..., None, :]
    return {
        f"{prefix}_positions": local,
        f"{prefix}_heights": source.height_at(beside) - root.positions[:, None, None, 1],
        f"{prefix}_directions": np.stack([np.sin(angle), np.cos(angle)], axis=-1),
        f"{prefix}_gaits": gaits[inside],
    }


def _flat(parts: dict[str, np.ndarray], where: dict[str, slice], size: int) -> np.ndarray:
    """Named arrays (F, ...) laid side by side: (F, size) float32."""
    frames = len(next(iter(parts.values())))
    result = np.empty((frames, size), np.float32)
    for name, part in where.items():
        result[:, part] = parts[name].reshape(frames, -1)
    return result


def neutral_files(folder: Path) -> list[Path]:
    """The BVH files under a folder, to any depth, that are not left out by their names."""
    names = {path: str(path.relative_to(folder)) for path in sorted(folder.rglob("*.bvh"))}
    return [path for path, name in names.items() if JUMPS.search(name) or not NOT_NEUTRAL.search(name)]


def load_neutral(path: Path) -> Clip:
    """A clip that can be learned from. Raises OSError, or ValueError saying why it cannot be used."""
    return neutral_clip(bvh.read(path), path)


def neutral_clip(motion: bvh.Motion, path: Path) -> Clip:
    """The same of the motion that a file holds."""
    clip = to_clip(motion, path)
    if len(clip) < MINIMUM_SECONDS * FPS:
        raise ValueError(f"{path.name}: shorter than {MINIMUM_SECONDS} s")
    if not (JUMPS.search(str(path)) or feet_can_be_trusted(clip)):  # a jump may be onto a box
        raise ValueError(f"{path.name}: its planted feet are not level with the floor")
    return clip


def load_clips(folder: Path, workers: int = 2) -> tuple[list[Path], list[Clip]]:
    """The files of all neutral locomotion under a folder of BVH files, and their clips, all actors in one posture.

    Prints why a file is skipped."""
    loaded = _in_processes("reading motion", workers, _load, neutral_files(folder))
    for reason in loaded:
        if isinstance(reason, str):
            print(f"skipped {reason}", file=sys.stderr)
    usable = [each for each in loaded if not isinstance(each, str)]
    clips, actors = [clip for _, clip, _ in usable], [actor for _, _, actor in usable]
    return [path for path, _, _ in usable], share_posture(clips, actors)


def _in_processes(what: str, workers: int, work: Callable[..., T], *values: Sequence) -> list[T]:
    """What `work` makes of each of the clips, in processes of their own, behind a bar that says how far it is."""
    with ProcessPoolExecutor(workers) as pool:
        done = pool.map(work, *values, chunksize=4)
        return list(tqdm(done, what, len(values[0]), leave=False, unit="clip", disable=None))  # none but in a terminal


def _load(path: Path) -> tuple[Path, Clip, tuple] | str:
    """One file, its clip and its actor, known by folder and skeleton; or the reason why it cannot be used."""
    try:
        motion = bvh.read(path)
        clip = neutral_clip(motion, path)
    except (ValueError, OSError) as error:
        return str(error)
    return path, clip, (path.parent, tuple(motion.names), tuple(np.linalg.norm(motion.offsets, axis=-1).round(2)))


def _frames(path: Path, clip: Clip) -> list[tuple]:
    """A clip with its feet planted, at all its paces, as itself and mirrored, on level floor and on one of TERRAINS:
    what `frames_of` says of each."""
    kind = kind_of(path, clip)
    planted, whole = plant_feet(clip), slice(None)
    if kind == "jump":
        before, after = (round(seconds * FPS) for seconds in JUMP_WINDOW)
        flights = find_flights(planted.positions())
        sources = [(kind, planted, slice(max(0, start - before), stop + after)) for start, stop in flights]
    elif kind == "crouch":
        sources = [(kind, planted, whole)]
    else:
        sources = [(kind, planted[part], whole) for part in find_uncrossed(planted, MINIMUM_SECONDS)]
        loops = find_loops(clip) if kind == "run" else ()
        sources += [("loop", plant_feet(loop), whole) for loop in loops]
    random = np.random.default_rng(int(hashlib.md5(path.stem.encode()).hexdigest(), 16))
    terrain = int(random.integers(len(TERRAINS)))
    result = []
    for kind, source, window in sources:
        speed = typical_speed(source)
        for pace, stride in PACES[kind]:
            if pace * stride > 1 and pace * stride * speed > FASTEST.get(kind, math.inf):
                continue
            paced = label(scale_strides(source, stride).paced(pace), kind == "jump", kind == "crouch")
            for side in (paced, paced.mirrored()):
                ground = Placed(_terrain(terrain), random.uniform(0, 2 * np.pi), random.uniform(-20, 20, 2))
                terrain = (terrain + 1) % len(TERRAINS)
                result += [frames_of(one[window]) for one in (side, fit_to_ground(side, ground))]
    return result


@cache
def _terrain(which: int) -> Ground:
    make, much = TERRAINS[which]
    return make(np.random.default_rng(which), much)


def kind_of(path: Path, clip: Clip) -> str:
    """The key of PACES that a file's name says, or that most of the clip's moving frames belong to."""
    for kind, names in (("jump", JUMPS), ("crouch", CROUCHES)):
        if names.search(str(path)):
            return kind
    velocity, speed = _local_velocity(clip)
    moving = speed > MOVING_FRAME
    if moving.mean() < 0.2:
        return "stand"
    forward = np.median(velocity[moving, 2] / speed[moving])
    if forward < 0.7:
        return "side-step" if abs(forward) < 0.7 else "backing"
    return "run" if np.median(speed[moving]) > 2.2 else "forward walk"


def typical_speed(clip: Clip) -> float:
    """Median speed in metres a second of the frames that move at all."""
    _, speed = _local_velocity(clip)
    return float(np.median(speed[speed > MOVING_FRAME])) if (speed > MOVING_FRAME).any() else 0.0


def _local_velocity(clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """The root's velocity (frames, 3) in its own frame, and its speed (frames,)."""
    velocity = root_frame(clip.positions()).local_velocity()
    return velocity, np.linalg.norm(velocity, axis=-1)


def feet_can_be_trusted(clip: Clip) -> bool:
    """Whether each foot, while planted, has its toe on the floor: some captures have a broken foot or two floors."""
    toes, contacts = clip.positions()[:, TOES, 1], foot_contacts(clip).reshape(-1, 2, 2).max(axis=2) > 0
    means = [toes[contacts[:, foot], foot].mean() for foot in (0, 1) if contacts[:, foot].any()]
    return all(PLANTED_TOE[0] < mean < PLANTED_TOE[1] for mean in means)


def load_folder(folder: Path, workers: int = 2) -> Frames:
    """The frames of all neutral locomotion under a folder of BVH files. Raises ValueError if nothing in it can be
    used."""
    paths, sources = load_clips(folder, workers)
    if not paths:
        raise ValueError(f"no usable BVH file under '{folder}': put walking, running and standing clips there")
    made = _in_processes("preparing motion", workers, _frames, paths, sources)
    clips = [(path.stem, frames) for path, each in zip(paths, made) for frames in each]
    inputs, targets, phase = (np.concatenate(parts) for parts in zip(*(frames for _, frames in clips)))
    lengths = [len(frames[0]) for _, frames in clips]
    index = np.repeat(np.arange(len(clips)), lengths)
    last = np.zeros(len(index), bool)
    last[np.cumsum(lengths) - 1] = True
    held_out = np.array([is_held_out(name) for name, _ in clips])[index]
    return Frames(inputs, targets, phase, balance(inputs, targets), held_out, last, index, [name for name, _ in clips])


def balance(inputs: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Sampling weights (N,): kinds of movement that are rare in the data are drawn more often, by the root of their
    rarity.

    A kind is a cell of speed, direction of travel against the facing, turn rate, crouch, jump and the way of the
    ground, so that two minutes of running are not drowned by an hour of walking and strafing counts beside walking
    straight."""
    root = targets[:, OUTPUT_SLICES["root"]] * FPS
    speed = np.hypot(root[:, 0], root[:, 1])
    direction = np.where(speed > 0.2, np.abs(np.arctan2(root[:, 0], root[:, 1])), 0.0)
    now = OFFSETS.index(0)
    gaits, heights, places = (
        inputs[:, INPUT_SLICES[f"trajectory_{name}"]].reshape(-1, *INPUT[f"trajectory_{name}"])
        for name in ("gaits", "heights", "positions")
    )
    rise = places[:, now + 2, 1] - places[:, now - 2, 1]
    cell = np.stack(
        [
            np.digitize(speed, (0.15, 0.5, 0.9, 1.3, 1.8, 2.5, 3.2, 4.0)),
            np.digitize(direction, np.radians((25, 65, 115, 155))),
            np.digitize(np.abs(root[:, 2]), (0.4, 1.2, 2.5)),
            gaits[:, now, GAITS.index("crouch")] > 0.5,
            gaits[:, now, GAITS.index("jump")] > 0.5,
            np.where(np.ptp(heights, axis=(1, 2)) > LEVEL, 1 + np.sign(np.trunc(rise / LEVEL)), 3),
        ],
        axis=-1,
    ).astype(int)
    _, kind, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    weight = 1 / np.sqrt(np.maximum(count[kind.ravel()], 500))
    weight = weight * np.where(cell[:, 4], JUMP_WEIGHT, 1.0) * np.where(cell[:, 5] < 3, UNEVEN_WEIGHT, 1.0)
    return weight / weight.sum()
