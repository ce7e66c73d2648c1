"""What the session draws, measured: every style, walking, running, backing, strafing, turning and standing, beside real
motion.

The session is the one that users steer, as drawn, after the foot lock. Judges are trained on captured motion alone."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Callable, Iterator, Mapping, Sequence

import numpy as np

from sim.body.pose import Pose
from sim.body.skeleton import GROUPS, INDEX, PART_NAMES, PART_OF_JOINT, TOE_HEIGHT, TOES
from sim.command import GAIT_SPEEDS, Command, Commands
from sim.io.user_dirs import cache_folder
from sim.math import rotations as rot
from sim.motion.clip import FPS, Clip, root_frame
from sim.motion.features import LAYOUT, STRIDE, clip_features, features_from
from sim.motion.gait import cadence, stride_phase
from sim.motion.metrics import foot_skate, jerk
from sim.protocols import NamedStylizer
from sim.retarget.retarget import load_clip
from sim.session import Session
from stylizer.data import style_labels
from stylizer.data.domains import label_of
from stylizer.data.style_labels import labelled_files
from stylizer.evaluation.arm_benchmark import format_arms, frames_of, measure_arms
from stylizer.evaluation.metrics import motion_amplitude
from stylizer.evaluation.motion_classifiers import KINDS, STEPS, TOP, Panel, load_panels
from stylizer.styles import bundled_styles
from stylizer.styles.clip_table import CLIPS
from stylizer.styles.own_style import turn_command, walk_command
from stylizer.styles.stride_residual import stride_locked_part

SETTLE_SECONDS, SECONDS = 3, 6  # of each movement: before it counts, and that is measured
APPROACH_SECONDS = 2  # that another movement goes before it
CENTI = 100
GROUP_JOINTS = {
    "legs": np.flatnonzero(np.isin(PART_OF_JOINT, [PART_NAMES.index(p) for p in GROUPS["legs"]])),
    "spine": np.flatnonzero(PART_OF_JOINT == PART_NAMES.index("spine")),
    "arms": np.flatnonzero(np.isin(PART_OF_JOINT, [PART_NAMES.index(p) for p in GROUPS["arms"]])),
}


def come_from(approach: Callable[[int], Command], script: Callable[[int], Command], frame: int) -> Command:
    """One movement for APPROACH_SECONDS, then the other."""
    return approach(frame) if frame < APPROACH_SECONDS * FPS else script(frame)


RUN, BACK = partial(walk_command, 3.0, "run", (0.0, 1.0)), partial(walk_command, 1.0, "walk", (0.0, -1.0))
MOVEMENTS: dict[str, Callable[[int], Command]] = {
    **{f"walk_{speed}": partial(walk_command, speed, "walk", (0.0, 1.0)) for speed in (0.65, 0.85, 1.0, 1.15, 1.3)},
    **{f"run_{speed}": partial(walk_command, speed, "run", (0.0, 1.0)) for speed in (2.5, 3.0, 3.5)},
    "back": BACK,
    "strafe": partial(walk_command, 1.0, "walk", (1.0, 0.0)),
    **{f"{gait}_pace": partial(walk_command, GAIT_SPEEDS[gait], gait, (0.0, 1.0)) for gait in ("walk", "run")},
    "turn": partial(turn_command, 1.0, 0.8),
    "stand": lambda _: Command(),
    # A controller may move as it did before: what is drawn must not depend on it.
    **{
        f"walk_{speed}_after_run": partial(come_from, RUN, partial(walk_command, speed, "walk", (0.0, 1.0)))
        for speed in (0.65, 1.0, 1.3)
    },
    "walk_1.3_after_back": partial(come_from, BACK, partial(walk_command, 1.3, "walk", (0.0, 1.0))),
    "strafe_after_run": partial(come_from, RUN, partial(walk_command, 1.0, "walk", (1.0, 0.0))),
}

# What the labelled motion calls what a movement is, and of which clip of a style it is the reference; the first is its
# own.
CONTENTS = {
    "walk": ("walk", "walk-left", "walk-right", "walk-turn-left", "walk-turn-right"),
    "run": ("run", "dash"),
    "back": ("walk-back",),
}
SWITCHES = 82  # one a second, style after style
# degrees a second, centimetres a frame: what a joint in a switch should not exceed
FASTEST_TURN, FARTHEST = 1500.0, 15.0
PER_STYLE = ("sra", "top3", "cra", "skate_cm_s", "jerk")
SLOPES = ("bounce_cm", "knee_straightest", "knee_most_bent", "toe_cm")
GAIT = ("speed", "cadence_hz", "stride_m")

Progress = Callable[[int], Callable[[], object]]


@dataclass(frozen=True)
class Motion:
    """A stretch of motion as it is measured: positions (frames, 21, 3) in the world, features (frames, 21, 15), both at
    60 Hz, and the root's places (frames, 3)."""

    positions: np.ndarray
    features: np.ndarray
    root: np.ndarray

    @classmethod
    def of(cls, poses: Pose) -> "Motion":
        """Of consecutive poses; the first STRIDE serve the velocities only."""
        features = features_from(poses.positions, poses.rotations, poses.root_position, np.asarray(poses.root_facing))
        return cls(poses.positions[STRIDE:], features, poses.root_position[STRIDE:])

    @classmethod
    def of_clip(cls, clip: Clip) -> "Motion":
        """Of a captured clip."""
        positions = clip.positions()
        return cls(positions, clip_features(clip), root_frame(positions).positions)


def play(
    session: Session,
    scripts: Sequence[Callable[[int], Command]],
    styles: Sequence[Mapping],
    tick: Callable[[], object] = lambda: None,
    seconds: float = SECONDS,
    settle: float = SETTLE_SECONDS,
    **fields: Any,
) -> tuple[list[Motion], list[Motion]]:
    """What a session draws of many characters side by side, and their neutral motion: each has a script and shows a
    style.

    seconds, after those to settle, are returned; fields: what else the commands say; tick is called once a frame."""
    crowd = session.crowd(len(scripts))
    drawn, neutral = [], []
    for frame in range(round((settle + seconds) * FPS)):
        commands = [script(frame) for script in scripts]
        result = crowd.step(
            Commands([Command(c.move, c.face, c.gait, style, **fields) for c, style in zip(commands, styles)])
        )
        if frame >= settle * FPS - STRIDE:
            drawn.append(result.styled)
            neutral.append(result.neutral)
        tick()
    theirs, ours = (
        [Motion.of(poses[:, one]) for one in range(len(scripts))] for poses in map(Pose.stacked, (drawn, neutral))
    )
    return theirs, ours


def on_all_parts(style: str, strength: float = 1.0) -> dict:
    """All five parts in one style."""
    return dict.fromkeys(PART_NAMES, (style, strength))


def gait_figures(motion: Motion) -> dict[str, float]:
    """How a motion goes: speed in m/s, cadence in strides a second, stride in metres, bounce of the hips, height of the
    toes at most and skate in centimetres, knees' flexion in degrees, straightest and most bent, jerk in m/s^3."""
    steps = np.diff(motion.root[:, [0, 2]], axis=0) * FPS
    speed, strides = float(np.linalg.norm(steps, axis=1).mean()), cadence(motion.features)
    bends = knee_flexion(motion.positions)
    low, high = np.percentile(motion.positions[:, 0, 1], (2, 98))
    toes = motion.positions[:, TOES]
    return {
        "speed": speed,
        "cadence_hz": strides,
        "stride_m": speed / strides if strides else 0.0,
        "bounce_cm": CENTI * float(high - low),
        "toe_cm": CENTI * float((np.percentile(toes[..., 1], 98, axis=0) - TOE_HEIGHT).mean()),
        "knee_straightest": float(np.percentile(bends, 2, axis=0).mean()),
        "knee_most_bent": float(np.percentile(bends, 98, axis=0).mean()),
        "skate_cm_s": CENTI * float(np.nan_to_num(np.nanmean(foot_skate(toes)))),
        "jerk": float(np.nanmean(jerk(motion.positions, motion.root))),
    }


def knee_flexion(positions: np.ndarray) -> np.ndarray:
    """(frames, 2) degrees that the left and the right knee are bent; 0 is a straight leg."""
    hips, knees, ankles = (
        positions[:, [INDEX[f"{side}{name}"] for side in ("Left", "Right")]] for name in ("UpLeg", "Leg", "Foot")
    )
    thigh, shin = rot.normalize(knees - hips), rot.normalize(ankles - knees)
    return np.degrees(np.arccos(np.clip(np.vecdot(thigh, shin), -1.0, 1.0)))


def mean_positions(features: np.ndarray) -> np.ndarray:
    """(21, 3) the mean place of every joint, in metres about the hips, in the character's frame."""
    positions = features[..., LAYOUT["position"]]
    return (positions - positions[:, :1]).mean(axis=0)


def group_distances(
    statistic: Callable[[np.ndarray], np.ndarray], one: np.ndarray, other: np.ndarray
) -> dict[str, float]:
    """How far a statistic of two motions, features (frames, 21, 15), is apart in each group of body parts."""
    apart = np.linalg.norm(statistic(one) - statistic(other), axis=-1)
    return {group: float(apart[joints].mean()) for group, joints in GROUP_JOINTS.items()}


def locked_share(features: np.ndarray, joints: np.ndarray) -> float:
    """The share of some joints' movement that repeats with the stride, of features (frames, 21, 15)."""
    axes = features[:, joints, LAYOUT["rotation"]]
    phase = stride_phase(features)
    locked = stride_locked_part(axes, phase)
    return float(1 - (axes - locked).var(axis=0).sum() / max(axes.var(axis=0).sum(), 1e-12))


@dataclass(frozen=True)
class Reference:
    """Captured motion of one style in one content: the bundled clip, and another take, None where there is none."""

    clip: Motion
    other_take: Motion | None


@dataclass(frozen=True)
class LiveEvaluation:
    """The report as JSON has it, and by movement and style what was drawn, beside it the reference, for pictures."""

    report: dict
    drawn: Mapping[str, Mapping[str, Motion]]
    neutral: Mapping[str, Motion]
    references: Mapping[str, Mapping[str, Reference]]


def evaluate_live(
    session: Session[NamedStylizer],
    data_dir: Path,
    progress: Progress | None = None,
    movements: Mapping[str, Callable[[int], Command]] = MOVEMENTS,
    seconds: float = SECONDS,
) -> LiveEvaluation:
    """Every bundled style on all five parts in every movement, judged and measured as the session draws it.

    progress(steps) is given how much there is to do and returns what to call once a step.
    Raises ValueError where `data_dir` lacks the labelled motion or the clips of the bundled styles."""
    files = labelled_files(data_dir)
    frames = sum(round((settle_seconds(movement) + seconds) * FPS) for movement in movements)
    steps = sum(map(len, files.values())) + 2 * len(KINDS) * STEPS + frames + SWITCHES * FPS + frames_of(movements)
    tick = progress(steps) if progress else lambda: None
    classifiers = load_panels(style_labels.load(data_dir, tick), cache_folder(), tick)
    references = load_references(data_dir, files)
    styles = [name for name in session.stylizer.styles if name in references]
    rows, drawn_by_movement, neutral_by_movement, totals = [], {}, {}, {}
    for movement, script in movements.items():
        drawn, _ = play(
            session,
            [script] * (len(styles) + 1),
            [*map(on_all_parts, styles), {}],
            tick,
            seconds,
            settle_seconds(movement),
            pace=movement.endswith("_pace"),
        )
        neutral = drawn.pop()
        found = [
            measure_style(style, movement, motion, neutral, references[style], classifiers)
            for style, motion in zip(styles, drawn)
        ]
        rows += found
        totals[movement] = summarize([row for row in found if row["sra"] is not None], neutral)
        drawn_by_movement[movement], neutral_by_movement[movement] = dict(zip(styles, drawn)), neutral
    report = {
        "classifiers": {kind: panel.held_out for kind, panel in classifiers.items()},
        "movements": totals,
        "rows": rows,
        "switches": measure_switches(session, styles, tick),
        "arms": measure_arms(session, movements, MOVEMENTS["walk_1.3"], tick),
    }
    return LiveEvaluation(report, drawn_by_movement, neutral_by_movement, references)


def settle_seconds(movement: str) -> float:
    """How long a movement of MOVEMENTS goes on before it counts."""
    return SETTLE_SECONDS + (APPROACH_SECONDS if "_after_" in movement else 0)


def load_references(data_dir: Path, files: Mapping[tuple[str, str], Sequence[Path]]) -> dict[str, dict[str, Reference]]:
    """Style -> content (walk, run, back) -> its captured motion; of a style that no label knows, its first clip. Raises
    ValueError where a clip that a style is judged by is not there."""
    result: dict[str, dict[str, Reference]] = {}
    for name, clips in CLIPS.items():
        used = {Path(clip).name for clip in clips}
        for place, clip in enumerate(clips):
            found = style_labels.labels(Path(clip).stem)
            content = next((kind for kind, (first, *_) in CONTENTS.items() if found and found[0] == first), None)
            if found is None and place == 0:
                content = "walk"
            if content is None:
                continue
            motion = bundled_styles.read_clip(data_dir, clip)
            if motion is None and found:
                raise ValueError(f"{data_dir} lacks {clip}, which a bundled style is made of: unpack its archive there")
            if motion is None:
                continue
            takes = [take for take in files.get(found, ()) if take.name not in used] if found else []
            other = bundled_styles.trim_ends(load_clip(takes[0])) if takes else None
            result.setdefault(name, {})[content] = Reference(
                Motion.of_clip(motion), Motion.of_clip(other) if other else None
            )
    return result


def reference_for(movement: str, references: Mapping[str, Reference]) -> tuple[str, Reference]:
    """Which content's clip a style's movement is compared with, and that clip: its own, or the walk where there is
    none."""
    kind = movement.split("_")[0]
    content = kind if kind in references else "walk"
    return content, references[content]


def measure_style(
    style: str,
    movement: str,
    drawn: Motion,
    neutral: Motion,
    references: Mapping[str, Reference],
    classifiers: Mapping[str, Panel],
) -> dict:
    """Everything that is said of one style in one movement. Shares of a gap: posture what is left of it, liveliness
    what is closed of it, from the neutral motion to the style's clip."""
    content, reference = reference_for(movement, references)
    kind, clip = movement.split("_")[0], reference.clip
    label = label_of(CLIPS[style][0].removesuffix(".bvh"))
    classifier = classifiers["style" if kind in ("walk", "run") else "upper_style"]
    judged = classifier.knows(label)
    result: dict[str, Any] = {
        "style": style,
        "movement": movement,
        "compared_with": content,
        "sra": classifier.share(drawn.features, [label]) if judged else None,
        "top3": classifier.share(drawn.features, [label], TOP) if judged else None,
        "cra": classifiers["content"].share(drawn.features, CONTENTS[kind]) if kind in CONTENTS else None,
    }
    for name, statistic, left in (("mean_pose", mean_positions, True), ("motion_amplitude", motion_amplitude, False)):
        whole = group_distances(statistic, neutral.features, clip.features)
        shares = {}
        for whose, motion in (("drawn", drawn), ("other_take", reference.other_take)):
            gaps = motion and group_distances(statistic, motion.features, clip.features)
            shares[whose] = gaps and {group: gaps[group] / whole[group] for group in whole}
        result[name] = {
            group: {whose: share and (share[group] if left else 1 - share[group]) for whose, share in shares.items()}
            for group in GROUP_JOINTS
        }
        result[f"{name}_gap"] = whole
    measured = gait_figures(clip)
    return (
        result
        | gait_figures(drawn)
        | {
            "clip": {name: measured[name] for name in (*GAIT, *SLOPES, "skate_cm_s")},
            "arms_locked": locked_share(drawn.features, GROUP_JOINTS["arms"]),
            "clip_arms_locked": locked_share(clip.features, GROUP_JOINTS["arms"]),
        }
    )


def summarize(rows: Sequence[dict], neutral: Motion) -> dict:
    """Over the styles of one movement: means; shares of all gaps together; how far differences between clips arrive
    (the slope of the drawn figure over the clip's); the median error of speed, cadence and stride; beside them what the
    neutral motion does."""
    result: dict[str, Any] = {name: _mean(row[name] for row in rows) for name in PER_STYLE}
    for name in ("mean_pose", "motion_amplitude"):
        result[name] = {
            group: {
                whose: _weighted([(row[name][group][whose], row[f"{name}_gap"][group]) for row in rows])
                for whose in ("drawn", "other_take")
            }
            for group in GROUP_JOINTS
        }
    result["slopes"] = (
        {
            name: float(
                np.polyfit(
                    [row["clip"][name] for row in rows],
                    [row[name] for row in rows],
                    1,
                )[0]
            )
            for name in SLOPES
        }
        if len(rows) > 2
        else None
    )
    errors = {name: [abs(row[name] / row["clip"][name] - 1) for row in rows if row["clip"][name]] for name in GAIT}
    result["median_error"] = {name: float(np.median(values)) if values else None for name, values in errors.items()}
    own = gait_figures(neutral)
    return result | {
        "clip_skate_cm_s": _mean(row["clip"]["skate_cm_s"] for row in rows),
        "neutral_skate_cm_s": own["skate_cm_s"],
        "neutral_jerk": own["jerk"],
        "speed": _mean(row["speed"] for row in rows),
    }


def _mean(values: Iterator[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _weighted(pairs: Sequence[tuple[float | None, float]]) -> float | None:
    """The mean of shares, each weighed by its gap; None without any."""
    known = [(share, whole) for share, whole in pairs if share is not None]
    shares, wholes = np.array(known).T if known else ((), ())
    return float(np.average(shares, weights=wholes)) if known else None


def measure_switches(
    session: Session, styles: Sequence[str], tick: Callable[[], object] = lambda: None, count: int = SWITCHES
) -> dict:
    """One style after the other on the whole body, a second each, walking on: in how many seconds after a switch a
    joint turns faster than FASTEST_TURN or moves farther than FARTHEST in a frame, about the root."""
    session.restart()
    poses = []
    for frame in range(count * FPS):
        style = styles[frame // FPS % len(styles)]
        poses.append(session.step(Command((0.0, 1.0), style=on_all_parts(style), pace=True)).styled)
        tick()
    session.restart()
    drawn = Pose.stacked(poses)
    places = drawn.to_character(drawn.positions - drawn.root_position[:, None])
    turns = rot.multiply(rot.inverse(rot.from_yaw(drawn.root_facing))[:, None], drawn.rotations)
    turned = (
        np.degrees(rot.length(rot.to_rotation_vector(rot.multiply(turns[1:], rot.inverse(turns[:-1]))))[..., 0]) * FPS
    )
    moved = CENTI * np.linalg.norm(np.diff(places, axis=0), axis=-1)
    by_second = [values[FPS - 1 :].max(axis=1) for values in (turned, moved)]  # the first second switches from nothing
    seconds = [
        np.array([values[start : start + FPS].max() for start in range(0, len(values) - FPS + 1, FPS)])
        for values in by_second
    ]
    return {
        "count": len(seconds[0]),
        "over_1500_deg_s": int((seconds[0] > FASTEST_TURN).sum()),
        "over_15_cm": int((seconds[1] > FARTHEST).sum()),
        "fastest_deg_s": float(seconds[0].max()),
        "farthest_cm": float(seconds[1].max()),
    }


COLUMNS = "{:<19} {:>5} {:>5} {:>5}  {:>17} {:>17}  {:>24} {:>17} {:>11}  {:>17}"


def format_table(report: dict) -> str:
    """A movement a line, then the switches and the classifiers."""
    lines = [
        COLUMNS.format(
            "movement",
            "SRA",
            "top 3",
            "CRA",
            "mean pose gap left",
            "amplitude gap closed",
            "slopes",
            "skate cm/s",
            "jerk m/s3",
            "median error",
        ),
        COLUMNS.format(
            "",
            "",
            "",
            "",
            "legs spine arms",
            "legs spine arms",
            "bounce straight bent toe",
            "neutral, clips",
            "neutral",
            "speed cad. stride",
        ),
    ]
    for movement, total in report["movements"].items():
        shares = [
            " ".join(f"{total[name][group]['drawn']:.2f}" for group in GROUP_JOINTS)
            for name in ("mean_pose", "motion_amplitude")
        ]
        slopes = " ".join(f"{value:.2f}" for value in total["slopes"].values()) if total["slopes"] else "-"
        lines.append(
            COLUMNS.format(
                movement,
                *("-" if total[name] is None else f"{total[name]:.2f}" for name in ("sra", "top3", "cra")),
                *shares,
                slopes,
                f"{total['skate_cm_s']:.1f} ({total['neutral_skate_cm_s']:.1f}, {total['clip_skate_cm_s']:.1f})",
                f"{total['jerk']:.0f} ({total['neutral_jerk']:.0f})",
                " ".join(f"{total['median_error'][name]:.2f}" for name in GAIT),
            )
        )
    walk = report["movements"].get("walk_1.3")
    if walk and walk["mean_pose"]["legs"]["other_take"] is not None:
        lines.append(
            "another take of the same style, for walk_1.3: mean pose gap left "
            + " ".join(f"{walk['mean_pose'][group]['other_take']:.2f}" for group in GROUP_JOINTS)
            + ", amplitude gap closed "
            + " ".join(f"{walk['motion_amplitude'][group]['other_take']:.2f}" for group in GROUP_JOINTS)
        )
    lines.append(
        "classifiers on captured motion that they have not seen: "
        + ", ".join(f"{kind} {value:.2f}" for kind, value in report["classifiers"].items())
    )
    found = report["switches"]
    lines.append(
        f"{found['count']} switches: {found['over_1500_deg_s']} with a joint over 1,500 degrees/s (fastest "
        f"{found['fastest_deg_s']:.0f}), {found['over_15_cm']} with a joint over 15 cm in a frame (farthest "
        f"{found['farthest_cm']:.1f})"
    )
    return "\n".join([*lines, format_arms(report["arms"])])
