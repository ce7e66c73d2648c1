"""Motion Puzzle at the resolution of joints: its numpy twin, strides that come back, the own style, parts left alone,
training."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.body.pose import Pose
from sim.body.skeleton import PART_NAMES, PART_OF_JOINT
from sim.math import rotations as rot
from sim.motion.clip import root_frame
from sim.motion.feature_window import RingBuffer
from sim.motion.features import LAYOUT, STRIDE, WINDOW, clip_features
from sim.motion.gait import gait_distance, with_run
from stylizer.data.dataset import MotionData, PackedClip
from stylizer.runtime.joint_live import JointStylizer
from stylizer.runtime.offline import ResolvedStyle, encode_clip, stylize
from stylizer.styles.encoding import encode_clips, encode_own
from stylizer.styles.joint_tokens import AHEAD, TOKENS
from stylizer.styles.style_clips import Gait, Movement, style_windows
from stylizer.systems.motion_puzzle import joint_model
from stylizer.systems.motion_puzzle.joint_config import CONFIGS, JOINT_PUZZLE
from stylizer.systems.motion_puzzle.joint_inference import FastJointInference, TorchJointInference, to_joint_inference
from stylizer.systems.motion_puzzle.joint_model import BODY, JointPuzzle
from stylizer.systems.motion_puzzle.joint_objective import RECIPE
from stylizer.systems.motion_puzzle.style_tensors import stack_parts, to_numpy
from stylizer.training import train_joints, trainer
from tests.stylizer.conftest import expand_batch, movement, own_motion
from tests.support.walker import SPEED, walking_clip

OTHER = 0.3 * np.random.default_rng(0).normal(size=(21, 15))
OTHER[:, LAYOUT["root"]] = 0.0
GOING = np.array([[0.0, SPEED, 0.0]])


@pytest.fixture(scope="module")
def features() -> np.ndarray:
    return clip_features(walking_clip())


@pytest.fixture(scope="module")
def model(features) -> JointPuzzle:
    torch.manual_seed(1)
    model = JointPuzzle(CONFIGS["joints_half_second"]).eval()
    model.set_statistics(features.mean(0), np.full((21, 15), 0.3))
    return model


@pytest.fixture(scope="module")
def own(model, features):
    return encode_own(model, own_motion(features))


@pytest.fixture(scope="module")
def other(model, features):
    """The walk held another way, its movement twice as large."""
    changed = features + OTHER
    changed[..., BODY] += (features - features.mean(axis=0))[..., BODY]
    movements = [movement(changed)]
    return encode_clips(model, [m.windows for m in movements], Gait.of(movements), own_motion(features))


@pytest.fixture(scope="module")
def windows(features) -> np.ndarray:
    return features[np.arange(60, 200, 7)[:, None] + STRIDE * np.arange(1 - WINDOW, 1)]


def restyle(network, windows, velocities, *styles) -> np.ndarray:
    return network.restyle(windows, velocities, *(network.prepare(to_numpy(style)) for style in styles))


def test_the_numpy_twin_says_the_same(model, own, other, windows):
    velocities = GOING.repeat(len(windows), axis=0)
    velocities[:3] = 0.2
    styles = [style.at(velocities) for style in (other, own)]
    assert isinstance(to_joint_inference(model), FastJointInference)
    fast, plain = (
        restyle(form(model), windows, velocities, *styles) for form in (FastJointInference, TorchJointInference)
    )
    assert np.abs(plain[0] - plain[1]).max() > 0.1
    np.testing.assert_allclose(fast, plain, atol=1e-5)


def test_how_far_gaits_are_apart_is_the_same_of_arrays_and_of_tensors():
    gaits = with_run(np.random.default_rng(2).normal(size=(40, 3)) * [1.0, 2.0, 1.0])
    of_tensors = joint_model.gait_distance(torch.from_numpy(gaits[:20]), torch.from_numpy(gaits[20:]))
    np.testing.assert_allclose(of_tensors, gait_distance(gaits[:20], gaits[20:]), atol=1e-9)
    going = torch.from_numpy(gaits[:, :3])
    np.testing.assert_allclose(joint_model.run_share(going)[:, 0], gaits[:, 3], atol=1e-9)


def test_what_is_found_is_the_style_s_stride_by_the_time_it_is_drawn(model, own, other, windows, features):
    frames = np.arange(60, 200, 7)
    coming = frames + AHEAD * 60
    styles = [style.at(GOING) for style in (other, own)]
    for found, clip in zip(
        restyle(
            FastJointInference(model),
            windows,
            GOING.repeat(len(windows), axis=0),
            *(expand_batch(style, len(windows)) for style in styles),
        ),
        (2 * features - features.mean(axis=0) + OTHER, features),
    ):
        turns = LAYOUT["rotation"]
        wanted = np.stack(
            [np.interp(coming, np.arange(len(clip)), column) for column in clip[..., turns].reshape(len(clip), -1).T]
        )
        missed = found[..., turns].reshape(len(frames), -1) - wanted.T
        assert np.sqrt(np.square(missed).mean()) < 0.1 * clip[..., turns].std(axis=0).max()


def test_the_own_style_changes_nothing(model, own, windows):
    style = own.at(GOING)
    styled, rebuilt = restyle(FastJointInference(model), windows[:1], GOING, style, style)
    np.testing.assert_array_equal(styled, rebuilt)


def test_parts_in_their_own_style_are_left_alone(model, own, other, windows):
    arm = PART_NAMES.index("left_arm")
    styled = stack_parts([(other if part == arm else own).at(GOING) for part in range(len(PART_NAMES))])
    styled, rebuilt = restyle(FastJointInference(model), windows[:1], GOING, styled, own.at(GOING))
    change = np.abs(styled - rebuilt)[0].max(axis=-1)
    assert (change[PART_OF_JOINT == arm] > 0).all() and not change[PART_OF_JOINT != arm].any()


def test_who_stands_makes_no_steps(model, own, other, windows):
    standing = np.zeros((len(windows), 3))
    styles = [style.at(standing) for style in (other, own)]
    styled, rebuilt = restyle(FastJointInference(model), windows, standing, *styles)
    assert np.ptp(styled - rebuilt, axis=0).max() < 1e-6


def test_tokens_of_what_makes_no_strides_are_samples_of_it(model):
    still = np.tile(OTHER, (120, 1, 1))
    clip = Movement("stand", style_windows(still), still, (0.0, 2.0))
    tokens = encode_clips(model, [clip.windows], Gait.of([clip])).features
    assert tokens["keys"].shape[2] == TOKENS and np.abs(tokens["values"].numpy()).max() < 1e-5


class Styles:
    """As much of a bank as the live stylizer needs."""

    def __init__(self, model, **styles) -> None:
        self.model, self.styles, self.names = model, styles, tuple(styles)

    def __getitem__(self, name: str):
        return self.styles[name]


@pytest.mark.parametrize("change", [{}, {"attention": False}, {"by_part": False}, {"lags": (0,)}])
def test_live_it_restyles_the_parts_that_wear_something(features, change):
    torch.manual_seed(1)
    model = JointPuzzle(replace(JOINT_PUZZLE, **change)).eval()
    model.set_statistics(features.mean(0), np.full((21, 15), 0.3))
    movements = [movement(features + OTHER)]
    bank = Styles(
        model,
        neutral=encode_own(model, own_motion(features)),
        other=encode_clips(model, [m.windows for m in movements], Gait.of(movements), own_motion(features)),
    )
    clip, history, stylizer = walking_clip(60), RingBuffer(), JointStylizer(bank)
    root = root_frame(clip.positions())
    for frame in zip(root.positions, root.facing, clip.hips, clip.global_rotations()):
        pose = Pose(*frame, np.zeros(4), 0.0)
        history.push(pose)
        styled = stylizer.step(history.window(), pose, {"left_arm": ("other", 1.0)})
    turned = np.linalg.norm(
        rot.to_rotation_vector(rot.multiply(styled.rotations, rot.inverse(pose.rotations))), axis=-1
    )
    arm = PART_OF_JOINT == PART_NAMES.index("left_arm")
    assert turned[arm].min() > 0.01 and turned[~arm].max() < 1e-9
    if model.config.attention:
        seen = stylizer.attention(history.window(), "left_arm")
        assert seen.shape == (WINDOW // 2, TOKENS)
        np.testing.assert_allclose(seen.sum(axis=1), 1.0, atol=1e-5)
        with pytest.raises(ValueError, match="choose a style first"):
            JointStylizer(bank).attention(history.window(), "left_arm")


def test_a_clip_is_restyled_and_comes_back_in_its_own_style(model, features):
    clip = walking_clip(150).grounded()
    own = encode_clip(model, clip_features(clip))
    same = stylize(model, clip, dict.fromkeys(PART_NAMES, ResolvedStyle(own)))
    turned = rot.to_rotation_vector(rot.multiply(same.global_rotations(), rot.inverse(clip.global_rotations())))
    angles = np.linalg.norm(turned, axis=-1)
    assert angles.max() < 0.1 and angles[WINDOW * STRIDE :].max() < 0.05, (
        "the first frames have no half second before them"
    )
    styled = stylize(model, clip, {"spine": ResolvedStyle(encode_clip(model, features + OTHER))})
    assert np.abs(styled.rotations - clip.rotations).max() > 0.05


def test_without_attention_there_is_nothing_to_learn_and_training_says_its_losses(features, monkeypatch):
    monkeypatch.setattr(train_joints, "RECIPE", replace(RECIPE, batch=3))
    monkeypatch.setattr(trainer, "HELD_OUT_BATCHES", 1)
    data = MotionData(features.astype(np.float32), [PackedClip("a", "a", 0, len(features), 1.0)], {})
    run = train_joints.JointTrainer(data, "joints_no_attention")
    before = [parameter.clone() for parameter in run.model.parameters()]
    assert set(run.update(0.0)) == set(RECIPE.weights) and run.step == 1
    assert all(torch.equal(a, b) for a, b in zip(before, run.model.parameters()))


@pytest.mark.parametrize("network", ["joints", "joints_half_second"])
def test_training_reaches_every_weight_and_resumes_exactly(network, features, monkeypatch, tmp_path):
    monkeypatch.setattr(train_joints, "RECIPE", replace(RECIPE, batch=3))
    monkeypatch.setattr(trainer, "HELD_OUT_BATCHES", 1)
    data = MotionData(features.astype(np.float32), [PackedClip("a", "a", 0, len(features), 1.0)], {})
    whole = train_joints.JointTrainer(data, network)
    before = [parameter.clone() for parameter in whole.model.parameters()]
    whole.update(0.0)
    whole.keep(tmp_path / "checkpoint.pt")
    terms = whole.update(0.5)
    assert set(terms) == set(RECIPE.weights) == set(whole.held_out_losses())
    assert all((a != b).any() for a, b in zip(before, whole.model.parameters()))
    resumed = train_joints.JointTrainer(data, network)
    resumed.restore(tmp_path / "checkpoint.pt")
    assert resumed.update(0.5) == terms
