"""Key poses: a style's pose at the moment the content is in, however far apart the two styles are."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.motion.features import clip_features
from stylizer.systems.motion_puzzle import key_poses
from stylizer.systems.motion_puzzle.config import KEY_POSES, SLIM
from stylizer.systems.motion_puzzle.direction_transfer import ROOT
from stylizer.systems.motion_puzzle.key_poses import BODY, KeyPoses
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.style_tensors import cat_batch, interpolate, mix_parts
from tests.support.walker import walking_clip


def clip(shift=0.0, scale=1.0, start=0, samples=64):
    """A walk (21, 1, samples, 15) at 30 Hz in a style of its own: every joint displaced, and livelier."""
    motion = torch.from_numpy(clip_features(walking_clip(240)).astype(np.float32))[start : start + 2 * samples : 2]
    motion = motion.permute(1, 0, 2)[:, None].clone()
    mean = motion[..., BODY].mean(2, keepdim=True)
    displaced = torch.randn(21, 1, 1, 12, generator=torch.Generator().manual_seed(3))
    styled = mean + scale * (motion[..., BODY] - mean) + shift * displaced
    return torch.cat([styled, motion[..., ROOT]], dim=-1)


@pytest.fixture
def poses():
    torch.manual_seed(0)
    poses = KeyPoses(32)
    poses.begin(clip())
    return poses


def apply_styled(poses, content, style, own):
    return poses(poses.attend(content, own), content[0, ..., ROOT].mean(1), style, own)


@torch.inference_mode()
def test_the_style_arrives_at_the_contents_own_moment(poses):
    """Told without training, from moments that are poses of a walk: another part of the walk, in another style."""
    own, other = clip(), clip(shift=0.3, scale=1.4)
    content, wanted = clip(start=37, samples=16), clip(shift=0.3, scale=1.4, start=37, samples=16)
    styles = [poses.style_side(each) for each in (own, other)]
    restyled = (
        content
        + apply_styled(poses, content, styles[1], styles[0])
        - apply_styled(poses, content, styles[0], styles[0])
    )
    error, of_mean_posture = (
        (each - wanted)[..., BODY].abs().mean()
        for each in (restyled, content + other.mean(2, keepdim=True) - own.mean(2, keepdim=True))
    )
    assert error < 2 / 3 * of_mean_posture < 2 / 3 * (content - wanted)[..., BODY].abs().mean()


@torch.inference_mode()
def test_of_a_clip_that_goes_another_way_only_the_mean_posture_is_taken(poses):
    own, other = clip(), clip(0.3, 1.4)
    other[..., ROOT] += 10.0
    styles = [poses.style_side(each) for each in (own, other)]
    put = (apply_styled(poses, own, styles[1], styles[0]) - apply_styled(poses, own, styles[0], styles[0]))[..., BODY]
    assert put.std(2).max() < 1e-4 and put.abs().mean() > 0.1


@torch.inference_mode()
def test_a_slow_walk_is_listened_to_however_wary_training_became(poses):
    """Most of how it moves arrives; who steps sideways may be as little trusted as training likes."""
    poses.log_inverse_scale.fill_(3.0)
    own = poses.style_side(clip())
    shares = {}
    for name, channel in (("slower", 1), ("sideways", 0)):
        other = clip(0.0, 1.4)
        other[..., ROOT.start + channel] -= 0.7
        put = apply_styled(poses, clip(), poses.style_side(other), own) - apply_styled(poses, clip(), own, own)
        shares[name] = put[..., BODY].std(2).mean() / (0.4 * clip()[..., BODY].std(2).mean())
    assert shares["slower"] > 0.6 and shares["sideways"] < 0.1


def test_what_a_style_does_on_another_way_is_learned_and_a_clip_on_its_own_way_is_as_it_is(poses):
    """A run is leaned and lively, a walk in the same style is neither."""
    walk, run = clip(0.3, 1.0), clip(0.3, 2.0)
    run[..., ROOT] += 1.0
    run[..., BODY] += 0.5
    optimizer = torch.optim.Adam(poses.direction_transfer.parameters(), 3e-3)
    with torch.no_grad():
        before = poses.direction_transfer_loss(poses.style_side(run), walk)
    for _ in range(60):
        loss = poses.direction_transfer_loss(poses.style_side(run), walk)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    with torch.inference_mode():
        style = poses.style_side(run)
        assert poses.direction_transfer_loss(style, walk) < 0.3 * before
        assert poses.direction_transfer_loss(style, run) < 1e-5


@torch.inference_mode()
def test_a_clip_told_by_its_own_key_poses_comes_back_as_it_is(poses, monkeypatch):
    """Moments that are told unsurely give means of poses, which move less than the poses do, unless they are fitted."""
    motion, missed, lively = clip(0.3, 1.4), [], []
    for ridge in (1e9, key_poses.RIDGE):
        monkeypatch.setattr(key_poses, "RIDGE", ridge)
        style = poses.style_side(motion)
        rebuilt = apply_styled(poses, motion, style, style)[..., BODY]
        missed.append((rebuilt - motion[..., BODY]).abs().mean())
        lively.append(rebuilt.std(2).mean() / motion[..., BODY].std(2).mean())
    assert missed[1] < 0.6 * missed[0] and lively[0] < 0.85 < lively[1] < 1.05


@torch.inference_mode()
def test_the_way_over_the_floor_is_left_alone(poses):
    own, other = (poses.style_side(clip(shift)) for shift in (0.0, 0.3))
    assert not apply_styled(poses, clip(samples=16), other, own)[..., ROOT].any()


@torch.inference_mode()
def test_a_style_is_the_same_however_often_its_clip_is_repeated(poses):
    once, twice = poses.style_side(clip()), poses.style_side(clip().repeat(1, 1, 2, 1))
    assert torch.allclose(once.bias, twice.bias, atol=1e-4) and torch.allclose(once.scale, twice.scale, atol=1e-4)


@torch.inference_mode()
def test_a_blend_of_two_styles_is_the_blend_of_what_they_put_on(poses):
    content, own = clip(samples=16), poses.style_side(clip())
    two = [poses.style_side(clip(shift, scale)) for shift, scale in ((0.3, 1.4), (-0.5, 0.7))]
    blend = interpolate(*({KEY_POSES: style} for style in two), [0.25] * 5)[KEY_POSES]
    first, second = (apply_styled(poses, content, style, own) for style in two)
    assert torch.allclose(apply_styled(poses, content, blend, own), 0.75 * first + 0.25 * second, atol=1e-4)


@torch.inference_mode()
def test_parts_that_keep_their_own_style_are_not_touched_by_the_others():
    torch.manual_seed(0)
    model = MotionPuzzle(replace(SLIM, key_poses=32))
    model.key_poses.begin(clip())
    own, other = (model.encode_style(motion[:, :, -32:], motion) for motion in (clip(), clip(0.3, 1.4)))
    arm = torch.zeros(5, 1, dtype=torch.bool)
    arm[3] = True
    styled, rebuilt = model(clip(samples=16), mix_parts(own, other, arm), own)
    moved = (styled - rebuilt).abs().amax(dim=(1, 2, 3)) > 1e-6  # the network itself begins with nothing to add
    assert set(torch.nonzero(moved).flatten().tolist()) <= set(range(13, 17)) and moved.any()


@torch.inference_mode()
def test_a_joint_that_is_taken_from_another_clip_is_held_and_moves_as_there_and_no_other_does(poses):
    first, other = poses.style_side(clip()), poses.style_side(clip(shift=0.3, scale=1.4))
    both = cat_batch([{KEY_POSES: first}, {KEY_POSES: other}])[KEY_POSES]
    joints = torch.zeros(21, dtype=torch.bool)
    joints[[4, 12, 15]] = True
    mended = poses.take_joints(both, 1, 0, joints)
    motion = clip()
    decode_styles = []
    for style in (first, other, type(mended)(*(t[:, 1:] for t in mended))):
        decode_styles.append(apply_styled(poses, motion, style, first)[..., BODY])
    torch.testing.assert_close(decode_styles[2][joints], decode_styles[0][joints], atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(decode_styles[2][~joints], decode_styles[1][~joints], atol=1e-5, rtol=1e-5)
    assert (decode_styles[0] - decode_styles[1])[joints].abs().max() > 0.1
