"""Restyling whole clips: what is not asked for stays, nothing seams, and styles of any length are read."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.body.skeleton import PART_NAMES, PARTS
from sim.io import bvh
from sim.math import rotations as rot
from sim.motion.features import LAYOUT, clip_features
from stylizer.runtime import overlap
from stylizer.runtime.offline import (
    ResolvedStyle,
    apply_styled,
    encode_clip,
    evaluate_by_part,
    resolve_styles,
    stylize,
)
from tests.support.walker import walking_clip


@pytest.fixture
def restyle(bank):
    """(clip, part -> (style, strength ...)) -> the restyled clip."""
    return lambda clip, worn: stylize(bank.model, clip, resolve_styles(bank, worn))


def turn(a, b):
    """(frames, 21) angle between the global rotations of two clips."""
    return np.linalg.norm(
        rot.to_rotation_vector(rot.multiply(a.global_rotations(), rot.inverse(b.global_rotations()))), axis=-1
    )


def test_strength_0_is_the_content_and_little_strength_is_near_it(restyle):
    walk = walking_clip(150)
    assert restyle(walk, {part: ("other", 0.0) for part in PART_NAMES}) is walk
    nearly = restyle(walk, {part: ("other", 0.001) for part in PART_NAMES})
    moved = np.linalg.norm(nearly.positions() - walk.positions(), axis=-1)
    assert 0 < moved.mean() < 0.004 and moved.max() < 0.02, "the knees of straight legs move most"


@pytest.mark.parametrize("part", ["left_arm", "right_leg"])
def test_other_parts_are_untouched(restyle, part):
    walk = walking_clip(150)
    turned = turn(restyle(walk, {part: ("other", 1.0)}), walk)
    # the other leg may bend, where the body is lowered or raised
    legs = PARTS["left_leg"] if part == "right_leg" else ()
    others = [joint for joint in range(21) if joint not in PARTS[part] + legs]
    assert turned[:, list(PARTS[part])].max() > 0.05 and turned[:, others].max() < 1e-6


def test_a_blend_goes_from_one_style_to_the_other(restyle):
    walk = walking_clip(120)
    ends = [restyle(walk, {"left_arm": (name, 1.0)}) for name in ("neutral", "other")]
    same = [restyle(walk, {"left_arm": ("neutral", 1.0, "other", share)}) for share in (0.0, 1.0)]
    half = restyle(walk, {"left_arm": ("neutral", 1.0, "other", 0.5)})
    for a, b in zip(ends, same):
        assert turn(a, b).max() < 1e-4
    apart = turn(*ends)[:, 13:17].mean()
    assert all(0.2 * apart < turn(half, end)[:, 13:17].mean() < 0.9 * apart for end in ends)


@pytest.mark.parametrize("frames", [4, 20, 31, 32, 33, 50, 200])
def test_content_of_any_length(restyle, frames):
    styled = restyle(walking_clip(200)[:frames], {part: ("other", 1.0) for part in PART_NAMES})
    assert len(styled) == frames and np.isfinite(styled.positions()).all()


def test_too_short_a_content_is_refused(restyle):
    with pytest.raises(ValueError, match="too short to restyle"):
        restyle(walking_clip(3), {"spine": ("other", 1.0)})


def test_windows_leave_no_seams(decoder_bank, monkeypatch):
    """Where windows begin and end, the styled motion is as smooth as elsewhere."""
    walk, everywhere = walking_clip(200), dict.fromkeys(PART_NAMES, ResolvedStyle(decoder_bank["other"]))
    features = clip_features(walk)
    monkeypatch.setattr(overlap, "BATCH", 7)
    styled = stylize(decoder_bank.model, walk, everywhere)
    third = np.linalg.norm(np.diff(styled.positions()[:, 13:], 3, axis=0), axis=-1).mean(axis=1)[20:-20]
    by_phase = [third[start :: overlap.HOP].mean() for start in range(overlap.HOP)]
    assert max(by_phase) < 1.4 * min(by_phase)
    assert evaluate_by_part(decoder_bank.model, features, everywhere).shape == features.shape


@pytest.mark.parametrize("frames", [10, 64, 200, 800])
def test_a_style_clip_of_any_length(bank, frames):
    style = encode_clip(bank.model, clip_features(walking_clip(frames)))
    assert all(torch.isfinite(values).all() for values in style.features.values())
    assert style.gait.root_velocities.shape == (1, 3) and style.gait.weights(np.ones(3)) == 1.0


def test_styles_of_short_and_of_long_clips_are_worn_side_by_side(decoder_bank):
    """Attention looks at as many windows of either, so that they stack and blend."""
    model, walk, rng = decoder_bank.model, walking_clip(100), np.random.default_rng(1)
    few, many = (
        encode_clip(model, clip_features(walking_clip(frames)) + rng.normal(size=(21, 15))) for frames in (100, 900)
    )
    shapes = {style.features["3.keys"].shape for style in (few, many, decoder_bank["other"])}
    assert len(shapes) == 1
    both = {
        "spine": ResolvedStyle(few),
        "left_arm": ResolvedStyle(many),
        "right_arm": ResolvedStyle(few, 1.0, many, 0.5),
    }
    together = turn(stylize(model, walk, both), walk)
    assert all(together[:, list(PARTS[part])].max() > 0.3 for part in both)


def test_a_style_may_be_a_file(bank, walk_file, tmp_path):
    assert resolve_styles(bank, {"spine": (str(walk_file), 0.5)})["spine"].strength == 0.5
    for name, error in (
        ("othr", "unknown style 'othr': did you mean other"),
        (str(tmp_path / "odd.bvh"), "not a whole BVH"),
    ):
        (tmp_path / "odd.bvh").write_text("nonsense")
        with pytest.raises(ValueError, match=error):
            resolve_styles(bank, {"spine": (name, 1.0)})
    with pytest.raises(FileNotFoundError):
        resolve_styles(bank, {"spine": ("absent.bvh", 1.0)})


def test_stylize_writes_on_either_skeleton(bank, walk_file, tmp_path, monkeypatch, capsys):
    from demo import cli

    monkeypatch.setattr("stylizer.runtime.catalogue.load_bank", lambda name: bank)
    monkeypatch.setattr("stylizer.styles.style_names.BUNDLED", bank.bundled)
    for extra in ([], ["--retarget-back"]):
        out = tmp_path / "out.bvh"
        assert (
            cli.main(
                [
                    "stylize",
                    str(walk_file),
                    "--style",
                    "arms=other:0.7",
                    "--style",
                    f"spine=neutral+{walk_file}@0.5",
                    "--stylizer",
                    "tiny",
                    "-o",
                    str(out),
                    *extra,
                ]
            )
            == 0
        )
        assert len(bvh.read(out)) == 240 and f"wrote {out}" in capsys.readouterr().out


def test_a_network_that_leaps_moves_no_joint_farther_than_the_content_goes_and_a_little(bank):
    """Half turns of an arm from one frame to the next, told either way round the circle."""
    walk = walking_clip(120)
    styled = clip_features(walk)
    leaps = rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.where(np.arange(120) % 40 < 20, 3.0, -3.0))
    axes = rot.from_6d(styled[:, 14, LAYOUT["rotation"]])
    styled[:, 14, LAYOUT["rotation"]] = rot.to_6d(rot.multiply(leaps, axes))
    quickest = [
        np.linalg.norm(np.diff(clip.positions(), axis=0), axis=-1).max()
        for clip in (walk, apply_styled(walk, styled, np.ones(5)))
    ]
    assert quickest[0] < quickest[1] < quickest[0] + 0.03


def test_where_the_body_is_not_upright_it_keeps_its_own_motion():
    walk = walking_clip(200)
    flip = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.interp(np.arange(200), [60, 140], [0, -2 * np.pi]))
    rotations = walk.rotations.copy()
    rotations[:, 0] = rot.multiply(flip, rotations[:, 0])
    flipping = replace(walk, rotations=rotations, hips=walk.hips + [0.0, 1.0, 0.0])
    styled = clip_features(flipping)
    axes = rot.from_6d(styled[:, 14, LAYOUT["rotation"]])
    styled[:, 14, LAYOUT["rotation"]] = rot.to_6d(rot.multiply(rot.from_axis_angle(np.eye(3)[2], 0.5), axes))
    turned = turn(apply_styled(flipping, styled, np.ones(5)), flipping)[:, 14]
    down = rot.rotate(flip, np.array([0.0, 1.0, 0.0]))[:, 1] < 0
    assert turned[down].max() < 0.03 < 0.45 < turned[:40].min()


def test_a_clip_of_a_frame_or_two_is_no_style(bank, tmp_path):
    bvh.write(tmp_path / "short.bvh", walking_clip(2))
    with pytest.raises(ValueError, match="short.bvh: the clip is too short to show a movement"):
        resolve_styles(bank, {"spine": str(tmp_path / "short.bvh")})
