"""The shipped models at work: switches without a whip, replays, what strength 0 and the own style leave alone, a slow
clip."""

from pathlib import Path

import numpy as np
import pytest
import torch

from demo.assemble import build_session
from sim.body.pose import Pose
from sim.body.skeleton import PART_NAMES
from sim.command import Command, Commands
from sim.ground.catalogue import load_ground
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.retarget.retarget import load_clip
from sim.session import Session
from stylizer.runtime.offline import resolve_styles, stylize
from stylizer.styles.bank import StyleBank

FASTEST, FARTHEST = 1500, 0.15  # degrees a second that a joint turns, metres that it moves in a frame about the root
STYLES = "old", "proud", "sad", "marching", "angry", "not-confident", "soldier", "childish"
SWITCHES, APART = 30, 30  # and frames between two
SLOW = Path(__file__).parents[3] / "shared" / "cases" / "arms_raised_slowly.bvh"
FORWARD = (0.0, 1.0)


@pytest.fixture(scope="module")
def session() -> Session:
    return build_session()


def wearing(name: str, strength: float = 1.0, parts=PART_NAMES) -> dict:
    return dict.fromkeys(parts, (name, strength))


def quickest(poses: list[Pose]) -> tuple[float, float]:
    """Degrees a second that any joint turns at most, and metres a frame that it moves about the root."""
    turns = np.array([pose.rotations for pose in poses])
    places = np.array([pose.positions - np.expand_dims(pose.root_position, -2) for pose in poses])
    step = rot.to_rotation_vector(rot.multiply(turns[1:], rot.inverse(turns[:-1])))
    return (
        float(np.degrees(np.linalg.norm(step, axis=-1)).max()) * FPS,
        float(np.linalg.norm(np.diff(places, axis=0), axis=-1).max()),
    )


@pytest.mark.parametrize("pace", [True, False])
def test_nothing_whips_round_however_often_styles_are_switched(session, pace):
    """Walking, side-stepping, standing; every half second another style on the whole body or on some of its parts."""
    rng = np.random.default_rng(0)
    session.restart()
    poses, style = [], {}
    moves = [(0.0, 1.0)] * 16 + [(0.8, 0.0)] * 7 + [(0.0, 0.0)] * 7
    for switch in range(SWITCHES):
        parts = PART_NAMES if switch % 3 else rng.permutation(PART_NAMES)[:3]
        style = style | wearing(str(rng.choice(STYLES)), 1.0, parts)
        command = Command(moves[switch], FORWARD, style=style, pace=pace)
        poses += [session.step(command).styled for _ in range(APART)]
    turning, moving = quickest(poses[FPS:])
    assert turning < FASTEST and moving < FARTHEST


@pytest.mark.parametrize("style", ["crouching", "prowling"])
def test_knees_of_a_low_style_are_not_thrown_about_on_stairs(session, style):
    """A leg that is folded altogether has no plane to bend in."""
    session.stand_on(load_ground("stairs"))
    poses = [session.step(Command(FORWARD, gait="run", style=wearing(style))).styled for _ in range(5 * FPS)]
    session.stand_on(None)
    assert quickest(poses[FPS:])[1] < 0.2


@pytest.fixture(scope="module")
def running(session) -> dict[str, list[list[Pose]]]:
    """Four seconds of steady running in styles, each at its own pace and at full speed, all side by side."""
    styles = "old", "proud", "happy", "musical", "youthful"
    crowd = session.crowd(2 * len(styles))
    commands = Commands(
        [
            Command((0.0, speed / 3.5), FORWARD, "run", wearing(style), pace)
            for style in styles
            for speed, pace in ((2.5, True), (3.5, False))
        ]
    )
    poses = [crowd.step(commands).styled for _ in range(6 * FPS)][2 * FPS :]
    return {
        style: [[pose[place] for pose in poses] for place in (2 * one, 2 * one + 1)] for one, style in enumerate(styles)
    }


@pytest.mark.parametrize("style", ["old", "proud", "happy", "musical", "youthful"])
def test_nothing_whips_round_in_a_steady_run(running, style):
    for poses in running[style]:
        turning, moving = quickest(poses)
        assert turning < FASTEST and moving < FARTHEST


SCRIPT = [Command((0.0, 1.0))] * 40 + [Command((0.4, 0.7))] * 40 + [Command()] * 40


def drawn(session: Session, style, pace: bool = False) -> list[Pose]:
    session.restart()
    return [
        session.step(Command(c.move, c.face, c.gait, style(frame) if callable(style) else style, pace)).styled
        for frame, c in enumerate(SCRIPT)
    ]


def equal(one: list[Pose], other: list[Pose]) -> bool:
    return all(
        np.array_equal(a.rotations, b.rotations) and np.array_equal(a.hips, b.hips)
        for a, b in zip(one, other, strict=True)
    )


def test_strength_0_is_the_session_without_a_style_bit_for_bit(session):
    plain = drawn(session, {})
    for pace in (True, False):
        assert equal(drawn(session, wearing("old", 0.0), pace), plain)
    assert not equal(drawn(session, wearing("old", 0.2)), plain)


@pytest.mark.parametrize("parts", [("spine", "left_arm", "right_arm"), PART_NAMES], ids=["upper body", "all"])
def test_the_own_style_is_the_session_without_a_style_bit_for_bit(session, parts):
    plain = drawn(session, {})
    for pace in (True, False):
        assert equal(drawn(session, wearing("neutral", 1.0, parts), pace), plain)


def test_two_replays_are_equal_bit_for_bit(session):
    """With styles that have a pace and a time of their own, and a switch."""

    def worn(frame):
        return wearing("musical" if frame < 60 else "old") | {"spine": ("sad", 1.0, "proud", min(frame / 60, 1.0))}

    first, second = drawn(session, worn, True), drawn(session, worn, True)
    assert equal(first, second)
    assert equal(drawn(build_session(), worn, True), first), "in another session too"


def test_a_crowd_at_its_own_paces_does_what_each_would_do_alone(session):
    """To half a millimetre."""
    styles = [wearing("old"), {}, wearing("marching", 0.6), wearing("sad", 1.0, ("left_leg", "right_leg"))]
    script = [Command(c.move, c.face, c.gait, {}, True) for c in SCRIPT[:90]]
    crowd = session.crowd(len(styles))
    together = [
        crowd.step(Commands([Command(c.move, c.face, c.gait, style, True) for style in styles])) for c in script
    ]
    for one, style in enumerate(styles):
        session.restart()
        for c, frame in zip(script, together, strict=True):
            alone = session.step(Command(c.move, c.face, c.gait, style, True))
            np.testing.assert_allclose(frame.neutral[one].positions, alone.neutral.positions, atol=2e-4)
            np.testing.assert_allclose(frame.styled[one].positions, alone.styled.positions, atol=5e-4)


def test_full_stick_in_old_legs_goes_at_the_pace_of_the_old(session):
    """Its clip's speed and cadence, nearly; without pace, the speed that the stick asks."""
    gait = session.stylizer.bank["old"].gait
    clip = gait.movements.index("walk")
    ways = {}
    for pace in (True, False):
        session.restart()
        poses = [
            session.step(Command(FORWARD, FORWARD, style=wearing("old"), pace=pace)).styled for _ in range(7 * FPS)
        ]
        ways[pace] = (poses[-1].root_position[2] - poses[-1 - 4 * FPS].root_position[2]) / 4
    assert ways[True] == pytest.approx(gait.root_velocities[clip, 1], rel=0.2) and ways[True] < 0.9
    assert ways[False] == pytest.approx(1.3, rel=0.1)


@pytest.mark.skipif(not SLOW.exists(), reason=f"{SLOW} is not there")
def test_a_slow_clip_stays_slow_when_it_is_restyled(tmp_path):
    """No joint moves more in a frame than the content's quickest does, and 3 cm."""
    torch.set_num_threads(1)
    bank, content = StyleBank(user=tmp_path), load_clip(SLOW)
    styled = stylize(bank.model, content, resolve_styles(bank, wearing("old")))
    before, after = (np.linalg.norm(np.diff(clip.positions(), axis=0), axis=-1) for clip in (content, styled))
    assert after.max() < before.max() + 0.03
    apart = np.linalg.norm(styled.positions() - content.positions(), axis=-1)
    assert apart.mean() > 0.02, "it is restyled"
