"""How well the session keeps hands and forearms out of the body, and how fast it throws elbows to do so."""

from typing import Callable, Mapping, Sequence

import numpy as np

from sim.body.pose import Pose
from sim.command import Command, Commands
from sim.hands.hand_clearance import LOWER, HandClearance, arm_depths
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.protocols import NamedStylizer
from sim.session import Session

# Of the bundled styles those whose arms come nearest to the body, or into it.
STYLES = (
    *("active", "bouncy", "crouching", "marching", "musical", "not-confident", "old", "pushing", "swaggering"),
    "tiptoeing",
)
STRENGTHS = (1.0, 1.5)
MOVEMENTS = ("walk_1.3", "run_3.0", "back", "turn", "stand")
SWITCHES = "switches"  # walking, and each second another style
DEEP = 0.02  # metres in the body at which it shows
SETTLE_SECONDS, SECONDS = 2, 6

Script = Callable[[int], Command]


class _Watched:
    """A session's hand clearance, which keeps what it was given."""

    def __init__(self, clearance: HandClearance) -> None:
        self._clearance, self.poses = clearance, list[Pose]()

    def step(self, pose: Pose) -> Pose:
        self.poses.append(pose)
        return self._clearance.step(pose)


def frames_of(movements: Mapping[str, Script]) -> int:
    """How many steps `measure_arms` takes."""
    return (len(_measured(movements)) + 1) * (SETTLE_SECONDS + SECONDS) * FPS


def measure_arms(
    session: Session[NamedStylizer],
    movements: Mapping[str, Script],
    walk: Script,
    tick: Callable[[], object] = lambda: None,
) -> list[dict]:
    """A row for each of some movements, those of MOVEMENTS, and for SWITCHES while walking: what is drawn of the
    neutral motion, and of STYLES at each of STRENGTHS, and `unkept`, what they would be with arms left alone.

    Of each, the shares of frames in which a hand and a forearm are over DEEP in the body, and the worst acceleration of
    an elbow about the root, in metres a second squared."""
    styles = [name for name in STYLES if name in session.stylizer.styles]
    scripts = {**{name: movements[name] for name in _measured(movements)}, SWITCHES: walk}
    return [
        {"movement": movement, **_measure(session, script, styles, movement == SWITCHES, tick)}
        for movement, script in scripts.items()
    ]


def _measured(movements: Mapping[str, Script]) -> list[str]:
    return [name for name in movements if name in MOVEMENTS]


def _measure(
    session: Session[NamedStylizer], script: Script, styles: Sequence[str], switching: bool, tick: Callable[[], object]
) -> dict:
    worn = [(place, strength) for strength in STRENGTHS for place in range(len(styles))]
    crowd = session.crowd(len(worn) + 1)
    watched = _Watched(crowd.hand_clearance)
    crowd.hand_clearance = watched  # type: ignore[assignment]
    drawn = []
    for frame in range((SETTLE_SECONDS + SECONDS) * FPS):
        second = frame // FPS if switching else 0
        asked = [{"all": (styles[(place + second) % len(styles)], strength)} for place, strength in worn]
        command = script(frame)
        each = [Command(command.move, command.face, command.gait, style) for style in [*asked, {}]]
        drawn.append(crowd.step(Commands(each)).styled)
        tick()
    settled = SETTLE_SECONDS * FPS
    kept, unkept = (Pose.stacked(poses[settled:]) for poses in (drawn, watched.poses))
    result: dict = {"neutral": arm_figures(kept[:, -1:])}
    for strength in STRENGTHS:
        which = [place for place, (_, its) in enumerate(worn) if its == strength]
        result[f"strength_{strength}"] = {**arm_figures(kept[:, which]), "unkept": arm_figures(unkept[:, which])}
    return result


def arm_figures(poses: Pose) -> dict[str, float]:
    """Of poses (frames, characters)."""
    hands, forearms = arm_depths(poses)
    elbows = poses.positions[..., LOWER, :] - poses.root_position[..., None, :]
    return {
        "hands_in": float((hands > DEEP).mean()),
        "forearms_in": float((forearms > DEEP).mean()),
        "elbow_m_s2": float(rot.length(np.diff(elbows, 2, axis=0)).max() * FPS**2),
    }


def format_arms(rows: Sequence[dict]) -> str:
    """A movement a line: the neutral motion, then each strength and, in brackets, the same with arms left alone."""
    strengths = [f"strength {strength:g} (arms left alone)" for strength in STRENGTHS]
    columns = "{:<19} {:>17}" + "  {:>39}" * len(strengths)
    head = f"hands / forearms over {100 * DEEP:g} cm in the body, worst acceleration of an elbow in m/s2"
    lines = [head, columns.format("", "neutral", *strengths)]
    for row in rows:
        styled = [row[f"strength_{strength}"] for strength in STRENGTHS]
        cells = [f"{_cell(each)} ({_cell(each['unkept'])})" for each in styled]
        lines.append(columns.format(row["movement"], _cell(row["neutral"]), *cells))
    return "\n".join(lines)


def _cell(figures: Mapping[str, float]) -> str:
    return "{:.1%} / {:.1%}, {:.0f}".format(*(figures[name] for name in ("hands_in", "forearms_in", "elbow_m_s2")))
