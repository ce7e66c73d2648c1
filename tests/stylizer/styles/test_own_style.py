"""The own style is what the shipped controller does, movement by movement and in between, and belongs to its weights
alone."""

import copy
from functools import partial

import numpy as np
import pytest
import torch

from controller.model import checkpoint as controller_weights
from controller.runtime.controller import PhaseFunctionedController
from sim.command import Command
from sim.math import rotations as rot
from sim.motion.clip import FPS
from sim.motion.features import LAYOUT, STRIDE
from sim.motion.gait import cadence, movement_of, stride_phase
from sim.session import Session, check_own_style
from stylizer.runtime.catalogue import make_stylizer
from stylizer.styles import own_style
from stylizer.styles.bank import StyleBank
from stylizer.styles.own_style import FORWARD, OWN, SECONDS, capture, capture_motion, walk_command
from stylizer.styles.style_clips import WINDOW

LATER = 4.5  # seconds after the ten that were captured began, in which the fresh ones begin
AT_A_MOVEMENT, IN_BETWEEN = 3.0, 6.0  # degrees that a joint's mean rotation may be off
SPEEDS = (0.4, 0.65, 0.85, 1.0, 1.15, 1.3, 1.6, 2.0), (2.5, 3.0, 3.5)  # of walks and runs that are captured
HALFWAY = [(a + b) / 2 for speeds in SPEEDS for a, b in zip(speeds, speeds[1:])]
KEPT = "a step back", "strafe_left_1.3"  # known to fail: the hips stay as high as they were, 5 cm higher than otherwise


@pytest.fixture(scope="module")
def bank(tmp_path_factory) -> StyleBank:
    """The shipped one, without the user's styles."""
    return StyleBank(user=tmp_path_factory.mktemp("user"))


@pytest.fixture(scope="module")
def controller() -> PhaseFunctionedController:
    torch.set_num_threads(1)
    return PhaseFunctionedController.from_pretrained()


@pytest.fixture(scope="module")
def fresh(controller) -> dict[str | float, np.ndarray]:
    """Ten seconds of features of every movement that is captured, and of speeds halfway between two."""
    halfway = {speed: partial(walk_command, speed, "run" if speed > 1.3 else "walk", FORWARD) for speed in HALFWAY}
    scripts = {**own_style.MOVEMENTS, **halfway}
    features = capture(controller, list(scripts.values()), SECONDS + LATER)
    return dict(zip(scripts, features[:, -SECONDS * FPS :]))


def root_velocity(features: np.ndarray) -> np.ndarray:
    return features[:, 0, LAYOUT["root"]].mean(axis=0)


def mean_rotations(bank: StyleBank, velocity: np.ndarray) -> np.ndarray:
    """(21, 4) the mean rotation of every joint in the own style, as it is taken off a motion of that root velocity."""
    model = bank.model
    held = model.parts.join(bank[OWN].at(velocity)["mean"].unflatten(2, (-1, 12)).transpose(1, 2))[:, 0]
    held = held * model.deviation[:, 0, 0, :12] + model.mean[:, 0, 0, :12]
    return rot.from_6d(held.double().numpy()[:, LAYOUT["rotation"]])


def degrees_off(bank: StyleBank, features: np.ndarray) -> np.ndarray:
    """(21,) how far the own style's mean rotations are from those of a motion."""
    seen = rot.from_6d(features[..., LAYOUT["rotation"]].mean(axis=0))
    own = mean_rotations(bank, root_velocity(features))
    return np.degrees(np.linalg.norm(rot.to_rotation_vector(rot.multiply(own, rot.inverse(seen))), axis=-1))


@pytest.mark.parametrize("name", own_style.MOVEMENTS)
def test_at_a_captured_movement_every_joint_is_held_as_the_controller_holds_it(bank, fresh, name):
    off = degrees_off(bank, fresh[name])
    assert off.max() < AT_A_MOVEMENT, f"joint {off.argmax()}"


@pytest.mark.parametrize("speed", HALFWAY)
def test_halfway_between_two_captured_speeds_it_is_nearly_so(bank, fresh, speed):
    off = degrees_off(bank, fresh[speed])
    assert off.max() < IN_BETWEEN, f"joint {off.argmax()}"


CAME_FROM = {
    "standing": lambda _: Command(),
    "a run": partial(walk_command, 3.0, "run", FORWARD),
    "a step back": partial(walk_command, 0.8, "walk", (0.0, -1.0)),
}


COMING_TO = "walk_0.65", "walk_1.0", "walk_1.3", "run_3.0", "back_0.65", "strafe_left_1.3"


@pytest.fixture(scope="module")
def come_to(controller) -> dict[tuple[str, str], np.ndarray]:
    """Ten seconds of features of movements after others."""

    def script(frame, before, after):
        return CAME_FROM[before](frame) if frame < 97 else own_style.MOVEMENTS[after](frame - 97)

    pairs = [(before, after) for before in CAME_FROM for after in COMING_TO]
    features = capture(
        controller, [partial(script, before=before, after=after) for before, after in pairs], SECONDS + LATER
    )
    return dict(zip(pairs, features[:, -SECONDS * FPS :]))


@pytest.mark.parametrize(
    "before, after",
    [
        pytest.param(
            *pair,
            marks=[pytest.mark.xfail(reason="the controller keeps the height that it came in", strict=True)]
            if pair == KEPT
            else [],
        )
        for pair in ((before, after) for before in CAME_FROM for after in COMING_TO)
    ],
)
def test_it_does_not_matter_how_a_movement_was_come_to(bank, come_to, before, after):
    """Users do not always set out from standing."""
    assert degrees_off(bank, come_to[before, after]).mean() < 2 * AT_A_MOVEMENT


def test_every_movement_is_what_its_name_says(bank, fresh):
    gait = bank[OWN].gait
    assert gait.movements == tuple(own_style.MOVEMENTS)
    kinds = {
        name: movement_of(velocity, strides=strides)
        for name, velocity, strides in zip(gait.movements, gait.root_velocities, gait.cadences)
    }
    for name, kind in kinds.items():
        if not name.startswith(("walk_2.0", "spin", "turn")):  # a quick walk is a run by speed alone
            assert name.replace("_", " ").startswith(kind), (name, kind)
    for name, velocity in zip(gait.movements, gait.root_velocities):
        np.testing.assert_allclose(velocity, root_velocity(fresh[name]), atol=0.1)
        if name.startswith(("walk", "run")):
            assert velocity[1] == pytest.approx(float(name.split("_")[1]), rel=0.12)


def test_cadences_are_the_controllers(bank, fresh):
    for name, strides in zip(bank[OWN].gait.movements, bank[OWN].gait.cadences):
        if name.startswith(("walk", "run", "back")):
            assert strides == pytest.approx(cadence(fresh[name]), rel=0.06), name
    assert bank[OWN].gait.cadences[0] == 0.0 and bank[OWN].gait.residual is None


def test_a_capture_keeps_windows_with_their_stride_phase(controller, monkeypatch):
    monkeypatch.setattr(own_style, "MOVEMENTS", {name: own_style.MOVEMENTS[name] for name in ("stand", "walk_1.0")})
    motion = capture_motion(controller, "a fingerprint")
    assert motion.controller == "a fingerprint" and motion.gait.movements == ("stand", "walk_1.0")
    stand, walk = motion.windows
    assert stand.shape == walk.shape and walk.shape[1:] == (WINDOW, 21, 15)
    assert (
        np.isnan(motion.phases[0]).all()
        and np.isfinite(motion.phases[1]).all()
        and motion.phases[1].shape == walk.shape[:2]
    )
    rate = np.diff(motion.phases[1], axis=1) / STRIDE * FPS / (2 * np.pi)
    assert rate.mean() == pytest.approx(motion.gait.cadences[1], rel=0.1)
    again = stride_phase(capture(controller, [own_style.MOVEMENTS["walk_1.0"]])[0])
    assert motion.phases[1][0, 0] == pytest.approx(again[0], abs=1e-4)


def test_a_capture_waits_until_the_controller_has_got_there(controller):
    features = capture(
        controller, [partial(walk_command, 1.3, "walk", FORWARD), partial(walk_command, 3.0, "run", FORWARD)], 2
    )
    assert features.shape == (2, 2 * FPS, 21, 15)
    first, whole = (features[:, :frames, 0, 13].mean(axis=1) for frames in (FPS // 4, 2 * FPS))
    np.testing.assert_allclose(whole, [1.3, 3.0], rtol=0.1)
    np.testing.assert_allclose(first, whole, rtol=0.1)


# ---- weights and own style belong together -------------------------------------------------


def test_the_shipped_own_style_is_the_shipped_controllers(bank, controller):
    assert bank.controller == controller.fingerprint == controller_weights.fingerprint()
    check_own_style(bank.controller, controller.fingerprint)


@pytest.mark.parametrize("own_of, controller", [(None, "a"), ("a", None), ("a", "a")])
def test_who_does_not_say_is_believed(own_of, controller):
    check_own_style(own_of, controller)


def test_the_own_style_of_another_controller_is_refused_in_one_sentence():
    with pytest.raises(ValueError) as refusal:
        check_own_style("a", "b")
    sentence = str(refusal.value)
    assert (
        sentence.startswith("the own style was captured from another controller")
        and "patchwalk styles capture" in sentence
    )
    assert "\n" not in sentence and ". " not in sentence


def test_a_session_refuses_the_own_style_of_another_controller(monkeypatch):
    from demo import assemble

    monkeypatch.setattr("controller.model.checkpoint.fingerprint", lambda *_: "another")
    with pytest.raises(ValueError, match="^the own style was captured from another controller"):
        assemble.build_session()


def test_a_session_of_models_that_do_not_belong_together_is_refused(bank, controller):
    stylizer = make_stylizer(bank)
    assert Session(controller, stylizer).stylizer is stylizer
    other = copy.copy(controller)
    other.fingerprint = "another"
    with pytest.raises(ValueError, match="captured from another controller"):
        Session(other, stylizer)
