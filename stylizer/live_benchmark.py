"""What the session draws, measured: every style, walking, running, backing, strafing, turning and standing, beside real motion.

The session is the one that users steer, as drawn, after the foot lock. Judges are trained on captured motion alone."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Callable, Mapping, Sequence

import numpy as np

from sim import rotations as rot
from sim.clip import FPS
from sim.command import GAIT_SPEEDS, Command, Commands
from sim.features import LAYOUT, STRIDE, features_from
from sim.gait import cadence, stride_phase
from sim.measures import foot_skate, jerk
from sim.pose import Pose
from sim.session import Session
from sim.skeleton import GROUPS, INDEX, PART_NAMES, PART_OF_JOINT, TOE_HEIGHT, TOES
from stylizer.own_style import curving, going
from stylizer.stride_residual import locked_part

SETTLE_SECONDS, SECONDS = 3, 8  # of each movement: before it counts, and that is measured
CENTI = 100
GROUP_JOINTS = {"legs": np.flatnonzero(np.isin(PART_OF_JOINT, [PART_NAMES.index(p) for p in GROUPS["legs"]])),
                "spine": np.flatnonzero(PART_OF_JOINT == PART_NAMES.index("spine")),
                "arms": np.flatnonzero(np.isin(PART_OF_JOINT, [PART_NAMES.index(p) for p in GROUPS["arms"]]))}

MOVEMENTS: dict[str, Callable[[int], Command]] = {
    **{f"walk_{speed}": partial(going, speed, "walk", (0.0, 1.0)) for speed in (0.65, 0.85, 1.0, 1.15, 1.3)},
    **{f"run_{speed}": partial(going, speed, "run", (0.0, 1.0)) for speed in (2.5, 3.0, 3.5)},
    "back": partial(going, 1.0, "walk", (0.0, -1.0)), "strafe": partial(going, 1.0, "walk", (1.0, 0.0)),
    **{f"{gait}_pace": partial(going, GAIT_SPEEDS[gait], gait, (0.0, 1.0)) for gait in GAIT_SPEEDS},
    "turn": partial(curving, 1.0, 0.8), "stand": lambda _: Command(),
}


@dataclass(frozen=True)
class Motion:
    """A stretch of motion as it is measured: positions (frames, 21, 3) in the world, features (frames, 21, 15), both at 60 Hz, and
    the root's places (frames, 3)."""

    positions: np.ndarray
    features: np.ndarray
    root: np.ndarray

    @classmethod
    def of(cls, poses: Pose) -> "Motion":
        """Of consecutive poses; the first STRIDE serve the velocities only."""
        features = features_from(poses.positions, poses.rotations, poses.root_position, poses.root_facing)
        return cls(poses.positions[STRIDE:], features, poses.root_position[STRIDE:])


def play(session: Session, scripts: Sequence[Callable[[int], Command]], styles: Sequence[Mapping],
         tick: Callable[[], object] = lambda: None, seconds: float = SECONDS, **fields) -> tuple[list[Motion], list[Motion]]:
    """What a session draws of many characters side by side, and their neutral motion: each has a script and wears a style.

    fields: what else the commands say; tick is called once a frame."""
    crowd = session.crowd(len(scripts))
    drawn, neutral = [], []
    for frame in range(round((SETTLE_SECONDS + seconds) * FPS)):
        commands = [script(frame) for script in scripts]
        result = crowd.step(Commands([Command(c.move, c.face, c.gait, style, **fields) for c, style in zip(commands, styles)]))
        if frame >= SETTLE_SECONDS * FPS - STRIDE:
            drawn.append(result.styled)
            neutral.append(result.neutral)
        tick()
    return tuple([Motion.of(poses[:, one]) for one in range(len(scripts))] for poses in map(Pose.stacked, (drawn, neutral)))


def wearing(style: str, strength: float = 1.0) -> dict:
    """All five parts in one style."""
    return dict.fromkeys(PART_NAMES, (style, strength))


def gait_figures(motion: Motion) -> dict[str, float]:
    """How a motion goes: speed in m/s, cadence in strides a second, stride in metres, bounce of the hips, height of the toes at
    most and skate in centimetres, knees' flexion in degrees, straightest and most bent, jerk in m/s^3."""
    steps = np.diff(motion.root[:, [0, 2]], axis=0) * FPS
    speed, strides = float(np.linalg.norm(steps, axis=1).mean()), cadence(motion.features)
    bends = knee_flexion(motion.positions)
    low, high = np.percentile(motion.positions[:, 0, 1], (2, 98))
    toes = motion.positions[:, TOES]
    return {"speed": speed, "cadence_hz": strides, "stride_m": speed / strides if strides else 0.0,
            "bounce_cm": CENTI * float(high - low),
            "toe_cm": CENTI * float((np.percentile(toes[..., 1], 98, axis=0) - TOE_HEIGHT).mean()),
            "knee_straightest": float(np.percentile(bends, 2, axis=0).mean()),
            "knee_most_bent": float(np.percentile(bends, 98, axis=0).mean()),
            "skate_cm_s": CENTI * float(np.nan_to_num(np.nanmean(foot_skate(toes)))),
            "jerk": float(np.nanmean(jerk(motion.positions, motion.root)))}


def knee_flexion(positions: np.ndarray) -> np.ndarray:
    """(frames, 2) degrees that the left and the right knee are bent; 0 is a straight leg."""
    hips, knees, ankles = (positions[:, [INDEX[f"{side}{name}"] for side in ("Left", "Right")]] for name in ("UpLeg", "Leg", "Foot"))
    thigh, shin = rot.normalize(knees - hips), rot.normalize(ankles - knees)
    return np.degrees(np.arccos(np.clip(np.vecdot(thigh, shin), -1.0, 1.0)))


def posture(features: np.ndarray) -> np.ndarray:
    """(21, 3) the mean place of every joint, in metres about the hips, in the character's frame."""
    positions = features[..., LAYOUT["position"]]
    return (positions - positions[:, :1]).mean(axis=0)


def liveliness(features: np.ndarray) -> np.ndarray:
    """(21, 6) the temporal deviation of every joint's orientation."""
    return features[..., LAYOUT["rotation"]].std(axis=0)


def gap(statistic: Callable[[np.ndarray], np.ndarray], one: np.ndarray, other: np.ndarray) -> dict[str, float]:
    """How far a statistic of two motions, features (frames, 21, 15), is apart in each group of body parts."""
    apart = np.linalg.norm(statistic(one) - statistic(other), axis=-1)
    return {group: float(apart[joints].mean()) for group, joints in GROUP_JOINTS.items()}


def locked_share(features: np.ndarray, joints: np.ndarray) -> float:
    """The share of some joints' movement that repeats with the stride, of features (frames, 21, 15)."""
    axes = features[:, joints, LAYOUT["rotation"]]
    phase = stride_phase(features)
    locked = locked_part(axes, phase)
    return float(1 - (axes - locked).var(axis=0).sum() / max(axes.var(axis=0).sum(), 1e-12))
