"""The live stylizer: strength 0 changes nothing, restyling stays in its part, switches do not pop, replays repeat."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from sim.body.kinematics import forward_kinematics
from sim.body.pose import Pose
from sim.body.skeleton import PARTS
from sim.math import rotations as rot
from sim.motion.clip import root_frame
from sim.motion.feature_window import RingBuffer
from stylizer.runtime.catalogue import make_stylizer
from stylizer.runtime.decoder_live import DecoderStylizer
from stylizer.runtime.pose_delta import unwrap
from stylizer.runtime.style_mixer import BODY, StyleMixer
from stylizer.styles.stride_residual import play_residual
from stylizer.systems.motion_puzzle.style_tensors import to_tensors
from tests.support.walker import walking_clip


@pytest.fixture(scope="module")
def walk():
    clip = walking_clip(90)
    root = root_frame(clip.positions())
    frames = zip(root.positions, root.facing, clip.hips, clip.global_rotations())
    return [Pose(*frame, np.zeros(4), 0.0) for frame in frames]


def stream(bank, walk, style, turn=0):
    """Styled poses; style is a mapping, or a function of the frame. turn: asked for as one of a crowd is."""
    stylizer, history, styled = make_stylizer(bank), RingBuffer(), []
    stylizer.mixers = [StyleMixer(stylizer.PERIOD, turn)]
    for frame, pose in enumerate(walk):
        history.push(pose)
        styled.append(stylizer.step(history.window(), pose, style(frame) if callable(style) else style))
    return styled


def turn(a, b):
    """(21,) angle between two poses, joint by joint."""
    return np.linalg.norm(rot.to_rotation_vector(rot.multiply(a.rotations, rot.inverse(b.rotations))), axis=-1)


def test_a_restarted_stylizer_is_a_new_one_bit_for_bit(bank, walk):
    stylizer, streams = make_stylizer(bank), []
    for _ in range(2):
        stylizer.restart()
        history, styled = RingBuffer(), []
        for pose in walk[:30]:
            history.push(pose)
            styled.append(stylizer.step(history.window(), pose, {"spine": ("other", 1.0)}).rotations)
        streams.append(styled)
    np.testing.assert_array_equal(*streams)


def test_unstyled_is_the_neutral_pose_itself(bank, walk):
    assert all(a is b for a, b in zip(stream(bank, walk[:5], {}), walk))
    assert all(a is b for a, b in zip(stream(bank, walk[:5], {"spine": ("other", 0.0)}), walk))


@pytest.mark.parametrize("part", PARTS)
def test_restyling_stays_in_its_part(bank, walk, part):
    for styled, neutral in zip(stream(bank, walk[:30], {part: ("other", 1.0)}), walk):
        carried = PARTS["left_arm"] + PARTS["right_arm"] if part == "spine" else ()  # their shoulders hang on the spine
        others = [joint for joint in range(21) if joint not in PARTS[part] + carried]
        assert np.array_equal(styled.rotations[others], neutral.rotations[others])
        assert part == "spine" or np.array_equal(styled.hips, neutral.hips)
        assert np.allclose(np.linalg.norm(styled.rotations, axis=-1), 1)
    assert turn(styled, neutral)[list(PARTS[part])].max() > 0.05
    assert np.allclose(forward_kinematics(styled.hips, styled.rotations), styled.positions)


def test_hands_of_unstyled_arms_stay_beside_the_hips_when_the_spine_leans(bank, walk):
    hanging = []
    for pose in walk[:30]:
        rotations = pose.rotations.copy()
        for joints, side in ((PARTS["left_arm"], -1), (PARTS["right_arm"], 1)):
            rotations[list(joints[1:])] = rot.from_axis_angle(np.array([0.0, 0, 1]), np.array(1.3 * side))
            bend = rot.from_axis_angle(np.array([1.0, 0, 0]), np.array(-1.4))
            rotations[list(joints[2:])] = rot.multiply(bend, rotations[joints[2]])
        hanging.append(pose.with_body(pose.hips, rotations))
    for styled, neutral in zip(stream(bank, hanging, {"spine": ("other", 0.3)}), hanging):
        moved = np.linalg.norm((styled.positions - styled.hips) - (neutral.positions - neutral.hips), axis=-1)
        assert moved[[16, 20]].max() < 1e-3
    assert moved[[13, 17]].min() > 0.03


def test_strength_grows_glides_in_and_fades_out(bank, walk):
    full = stream(bank, walk, {"left_arm": ("other", 1.0)})
    half = stream(bank, walk, {"left_arm": ("other", 0.5)})
    angles = [turn(a, b)[13:17] for a, b in ((full[-1], walk[-1]), (half[-1], walk[-1]))]
    assert np.allclose(angles[1], angles[0] / 2, rtol=1e-3)
    growing = [turn(a, b)[13:17].sum() for a, b in zip(full, walk)]
    assert growing[0] < 0.15 * growing[20]  # the first frame has hardly begun
    let_go = stream(bank, walk, lambda frame: {"left_arm": ("other", 1.0)} if frame < 40 else {})
    assert let_go[45] is not walk[45] and let_go[-1] is walk[-1]


def test_switching_styles_does_not_pop(bank, walk):
    part, joints = "right_arm", list(PARTS["right_arm"])
    names = ("neutral", "other")
    switching = stream(bank, walk, lambda frame: {part: (names[frame >= 45], 1.0)})
    steady = [stream(bank, walk, {part: (name, 1.0)}) for name in names]
    apart = turn(steady[0][45], steady[1][45])[joints].max()
    jump = turn(switching[45], switching[44])[joints].max() - turn(steady[0][45], steady[0][44])[joints].max()
    assert apart > 0.01 and jump < 0.25 * apart
    assert turn(switching[-1], steady[1][-1])[joints].max() < 0.2 * apart  # the network is asked in other frames since


def test_a_blend_of_two_styles_goes_from_the_first_to_the_other(bank, walk):
    def blended(share):
        return stream(bank, walk[:60], {"left_arm": ("neutral", 1.0, "other", share)})

    pure = [stream(bank, walk[:60], {"left_arm": (name, 1.0)}) for name in ("neutral", "other")]
    for share, same in zip((0.0, 1.0), pure):
        assert all(np.array_equal(a.rotations, b.rotations) for a, b in zip(blended(share), same))
    way = [[turn(blended(share)[-1], end[-1])[13:17].sum() for end in pure] for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert np.all(np.diff(way, axis=0) * (1, -1) > 0), "farther from the first, nearer to the other"


def test_a_share_that_changes_glides(bank, walk):
    def worn(frame):
        return {"left_arm": ("neutral", 1.0, "other", float(frame >= 45)) if frame < 70 else ("neutral", 1.0)}

    changing, pure = (
        stream(bank, walk, worn),
        [stream(bank, walk, {"left_arm": (name, 1.0)}) for name in ("neutral", "other")],
    )
    apart = turn(pure[0][45], pure[1][45])[13:17].max()
    steps = [
        turn(changing[i], changing[i - 1])[13:17].max() - turn(pure[0][i], pure[0][i - 1])[13:17].max()
        for i in range(40, 90)
    ]
    assert apart > 0.01 and max(steps) < 0.6 * apart
    assert turn(changing[69], pure[1][69])[13:17].max() < 0.1 * apart
    assert turn(changing[89], pure[0][89])[13:17].max() < 0.1 * apart


def test_the_decoder_is_asked_every_fourth_frame_and_at_once_for_another_style(decoder_bank, walk, monkeypatch):
    asked, ask = [], DecoderStylizer._decode
    monkeypatch.setattr(DecoderStylizer, "_decode", lambda self, *asking: asked.append(frame[0]) or ask(self, *asking))
    frame = [0]

    def worn(index):
        frame[0] = index
        return {} if index == 12 else {"spine": ("other" if index < 7 else "neutral", 1.0)}

    stream(decoder_bank, walk[:12], worn)
    assert asked == [0, 4, 7, 11]


def test_two_replays_are_equal_bit_for_bit(bank, walk):
    style = {"spine": ("other", 1.2), "left_leg": ("neutral", 0.7)}
    for a, b in zip(stream(bank, walk[:20], style), stream(bank, walk[:20], style)):
        assert np.array_equal(a.rotations, b.rotations) and np.array_equal(a.hips, b.hips)


def test_an_unknown_style_is_refused_with_near_names(bank, walk):
    with pytest.raises(ValueError, match="unknown style 'othr': did you mean other"):
        stream(bank, walk[:1], {"spine": ("othr", 1.0)})


def test_a_turn_of_half_a_circle_keeps_its_direction():
    before, delta = np.zeros((2, 22, 3))
    before[15], delta[15] = (0, 3.1, 0), (0, -3.13, 0)  # the same way round, a little farther
    before[16], delta[16] = (0, 0.3, 0), (0, -0.4, 0)
    after = unwrap(delta, before)
    assert np.allclose(after[15], (0, 2 * np.pi - 3.13, 0)) and np.array_equal(after[[16, 0, 21]], delta[[16, 0, 21]])


def test_each_of_a_crowd_moves_as_it_would_alone(bank, walk):
    """The first as a lone character does; others as one whose decoder is asked in other frames."""
    wears = [
        lambda frame: {"spine": ("other", 1.0)},
        lambda frame: {"left_arm": ("other" if frame < 30 else "neutral", 0.8)},
        lambda frame: {},
        lambda frame: {"left_leg": ("other", 1.0), "right_leg": ("other", 1.0)} if frame > 10 else {},
        lambda frame: {"left_arm": ("neutral", 1.0, "other", 0.5)} if 5 < frame < 25 else {},
    ]
    stylizer, history, together = make_stylizer(bank).crowd(len(wears)), RingBuffer(), []
    for frame, pose in enumerate(walk[:60]):
        poses = Pose.stacked([pose] * len(wears))
        history.push(poses)
        together.append(stylizer.step(history.window(), poses, [worn(frame) for worn in wears]))
    for one, worn in enumerate(wears):
        for poses, pose in zip(
            together, stream(bank, walk[:60], worn, turn=one % make_stylizer(bank).PERIOD), strict=True
        ):
            np.testing.assert_allclose(poses.positions[one], pose.positions, atol=1e-4)


def test_a_part_of_a_crowd_is_asked_for_in_every_frame(decoder_bank, walk, monkeypatch):
    asked, ask = [], DecoderStylizer._decode
    monkeypatch.setattr(
        DecoderStylizer,
        "_decode",
        lambda self, windows, ones, which: asked.append(ones) or ask(self, windows, ones, which),
    )
    stylizer, history = make_stylizer(decoder_bank).crowd(4), RingBuffer()
    for frame, pose in enumerate(walk[:9]):
        poses = Pose.stacked([pose] * 4)
        history.push(poses)
        stylizer.step(history.window(), poses, [{"spine": ("other" if frame < 5 else "neutral", 1.0)}] * 4)
    everyone = [0, 1, 2, 3]
    assert asked == [everyone, [1], [2], [3], [0], everyone, [1], [2], [3]]


def test_another_bank_that_takes_over_wears_its_own_styles_under_the_same_names(bank, walk):
    class Other:
        """The same styles, two of them under each other's name."""

        model, system, names, refresh = bank.model, bank.system, bank.names, lambda self: None

        def __getitem__(self, name):
            return bank[{"other": "neutral", "neutral": "other"}[name]]

    stylizer, history = make_stylizer(bank), RingBuffer()
    for frame, pose in enumerate(walk[:12]):
        if frame == 8:
            before, stylizer = stylizer, make_stylizer(Other())
            stylizer.transfer_state(before)
        history.push(pose)
        stylizer.step(history.window(), pose, {"spine": ("other", 1.0)})
    mixer, spine = stylizer.mixers[0], list(PARTS).index("spine")
    ours, theirs = (bank[name].at(mixer.root_velocities[BODY]) for name in ("neutral", "other"))
    style = to_tensors(stylizer._features(mixer.styles(stylizer.bank)[0]))
    assert torch.equal(style["mean"][spine], ours["mean"][spine])
    assert not torch.equal(style["mean"][spine], theirs["mean"][spine])


# ---- the own style ------------------------------------------------------------------------


def equal(one: Pose, other: Pose) -> bool:
    return np.array_equal(one.rotations, other.rotations) and np.array_equal(one.hips, other.hips)


@pytest.mark.parametrize("worn", [("neutral", 1.0), ("neutral", 1.5), ("neutral", 0.4, "neutral", 0.7)], ids=str)
def test_the_own_style_changes_nothing_bit_for_bit(bank, walk, worn):
    assert all(equal(a, b) for a, b in zip(stream(bank, walk[:40], dict.fromkeys(PARTS, worn)), walk))


def test_parts_in_the_own_style_are_untouched_beside_others_that_wear_one(bank, walk):
    style = {
        "left_arm": ("other", 1.0),
        "right_arm": ("neutral", 1.0),
        "spine": ("neutral", 1.5),
        "left_leg": ("neutral", 1.0),
    }
    ours, alone = (stream(bank, walk[:30], each) for each in (style, {"left_arm": ("other", 1.0)}))
    assert all(equal(a, b) for a, b in zip(ours, alone))
    assert turn(ours[-1], walk[29])[list(PARTS["left_arm"])].max() > 0.05


def test_back_in_the_own_style_a_part_is_the_neutral_one_once_its_switch_is_done(bank, walk):
    walk = (walk * 4)[:330]
    styled = stream(bank, walk, lambda frame: {"right_arm": ("other" if frame < 20 else "neutral", 1.0)})
    joints = list(PARTS["right_arm"])
    assert turn(styled[19], walk[19])[joints].max() > 0.05 < turn(styled[24], walk[24])[joints].max()
    assert all(equal(a, b) for a, b in zip(styled[-20:], walk[-20:]))


# ---- movement in its own time -------------------------------------------------------------


@pytest.fixture
def musical(bank):
    """`other` with a loop on top: a forearm that swings once a second, a head that nods slowly, about axes of their
    own."""
    time = np.arange(60) / 30
    loop = np.zeros((60, 21, 3))
    loop[:, 15, 2], loop[:, 12, 0] = 0.4 * np.sin(2 * np.pi * time), 0.2 * np.sin(np.pi * time)
    style = bank["other"]
    bank._styles["musical"] = replace(style, gait=replace(style.gait, residual=loop))
    bank._styles["other"] = replace(style, gait=replace(style.gait, residual=None))
    return loop


@pytest.mark.parametrize("strength", [1.0, 0.5])
def test_movement_in_its_own_time_is_played_on_top_as_strong_as_the_part(bank, walk, musical, strength):
    arm = list(PARTS["left_arm"])
    ours, plain = (stream(bank, walk, {"left_arm": (name, strength)}) for name in ("musical", "other"))
    for frame in range(60, 90):
        a, b = ours[frame], plain[frame]
        apart = rot.to_rotation_vector(rot.multiply(a.rotations, rot.inverse(b.rotations)))
        wanted = strength * play_residual(musical, frame + 1)
        np.testing.assert_allclose(apart[15], walk[frame].to_world(wanted[None, 15])[0], atol=2e-3)
        others = [joint for joint in range(21) if joint not in arm]
        assert np.array_equal(a.rotations[others], b.rotations[others]), (
            "the head nods only where the spine wears the style"
        )


def test_of_a_blend_each_plays_its_own_by_its_share(bank, walk, musical):
    ours, plain = (stream(bank, walk[:70], {"spine": ("other", 1.0, name, 0.25)}) for name in ("musical", "other"))
    apart = rot.to_rotation_vector(rot.multiply(ours[69].rotations, rot.inverse(plain[69].rotations)))
    np.testing.assert_allclose(
        walk[69].to_character(apart[None, 12])[0], 0.25 * play_residual(musical, 70)[12], atol=3e-3
    )


def test_movement_in_its_own_time_comes_and_goes_without_a_jump(bank, walk, musical):
    styled = stream(bank, walk, lambda frame: {"left_arm": ("other" if frame < 45 else "musical", 1.0)})
    steady = stream(bank, walk, {"left_arm": ("musical", 1.0)})
    steps, usual = (max(turn(a[i], a[i - 1])[15] for i in range(30, 90)) for a in (styled, steady))
    assert steps < 1.15 * usual


# ---- pace ---------------------------------------------------------------------------------


@pytest.fixture
def paced(bank):
    """A style whose walk goes at 0.6 m/s with 0.8 strides a second; the own one takes a stride a second at 1.2 m/s."""
    style = bank["other"]
    bank._styles["slow"] = replace(
        style,
        gait=replace(
            style.gait, movements=("walk",), root_velocities=np.array([[0.0, 0.6, 0.0]]), cadences=np.array([0.8])
        ),
    )
    stylizer = make_stylizer(bank)
    speed, rate = bank["slow"].gait.pace_of("walk", bank["neutral"].gait)
    return stylizer, np.array([speed / 1.3, rate])


def asked_pace(stylizer, walk, style, frames=60, gait="walk"):
    history = RingBuffer()
    stylizer.restart()
    for pose in walk[:frames]:
        history.push(pose)
        stylizer.step(history.window(), pose, style)
    return np.array(stylizer.pace((gait,)))


def test_legs_set_the_pace_of_their_style_as_far_as_they_wear_it(paced, walk):
    stylizer, pace = paced
    assert np.abs(pace - 1).max() > 0.05
    both = {"left_leg": ("slow", 1.0), "right_leg": ("slow", 1.0)}
    np.testing.assert_allclose(asked_pace(stylizer, walk, both), pace, atol=1e-3)
    np.testing.assert_allclose(
        asked_pace(stylizer, walk, {leg: ("slow", 0.4) for leg in both}), 1 + 0.4 * (pace - 1), atol=1e-3
    )
    np.testing.assert_allclose(asked_pace(stylizer, walk, {leg: ("slow", 1.5) for leg in both}), pace, atol=1e-3)
    np.testing.assert_allclose(asked_pace(stylizer, walk, {"left_leg": ("slow", 1.0)}), 1 + 0.5 * (pace - 1), atol=1e-3)
    np.testing.assert_allclose(
        asked_pace(stylizer, walk, {leg: ("neutral", 1.0, "slow", 0.3) for leg in both}),
        1 + 0.3 * (pace - 1),
        atol=1e-3,
    )


@pytest.mark.parametrize(
    "style, gait",
    [
        ({}, "walk"),
        ({"spine": ("slow", 1.0), "left_arm": ("slow", 1.0)}, "walk"),
        ({"left_leg": ("neutral", 1.0)}, "walk"),
        ({"left_leg": ("slow", 1.0)}, "run"),
    ],
)
def test_arms_the_own_style_and_what_no_clip_shows_leave_the_pace_alone(paced, walk, style, gait):
    np.testing.assert_array_equal(asked_pace(paced[0], walk, style, 40, gait), 1.0)


def test_each_of_a_crowd_has_its_own_pace(paced, walk):
    stylizer, pace = paced
    crowd, history = stylizer.crowd(3), RingBuffer()
    legs = {"left_leg": ("slow", 1.0), "right_leg": ("slow", 1.0)}
    for pose in walk[:60]:
        poses = Pose.stacked([pose] * 3)
        history.push(poses)
        crowd.step(history.window(), poses, [legs, {}, legs])
    speed, rate = crowd.pace(("walk", "walk", "run"))
    np.testing.assert_allclose(np.stack([speed, rate], axis=1), [pace, (1, 1), (1, 1)], atol=1e-3)
    np.testing.assert_allclose(crowd.leg_strengths(), [(1, 1), (0, 0), (1, 1)], atol=1e-3)


def test_a_style_learned_anew_under_the_same_name_has_its_own_pace(paced, walk):
    stylizer, pace = paced
    legs = {"left_leg": ("slow", 1.0), "right_leg": ("slow", 1.0)}
    asked_pace(stylizer, walk, legs)
    slow = stylizer.bank["slow"]
    stylizer.bank._styles["slow"] = replace(slow, gait=replace(slow.gait, cadences=np.array([1.1])))
    assert asked_pace(stylizer, walk, legs)[1] == pytest.approx(1.1, abs=1e-3) != pace[1]


def test_a_style_is_renamed_and_removed_while_it_is_shown(bank, walk):
    streams, bent = [], walking_clip()
    bent.rotations[:, list(PARTS["spine"])[1:]] = rot.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(0.3))
    for renames in (False, True):
        bank.add("limp", bent)
        stylizer, history, styled, name = make_stylizer(bank), RingBuffer(), [], "limp"
        for frame, pose in enumerate(walk):
            if frame == 30 and renames:
                stylizer.rename(name, name := "stroll")
            if frame == 60:
                stylizer.remove(name)
            history.push(pose)
            style = {"all": (name, 1.0)} if frame < 60 else {}
            styled.append(stylizer.step(history.window(), pose, style))
        streams.append(styled)
    for plain, renamed in zip(*streams):
        np.testing.assert_array_equal(plain.rotations, renamed.rotations)
    steps = [turn(*pair).max() for pair in zip(styled, styled[1:])]
    assert max(steps[55:]) < 2 * max(steps[30:55]), "it glides"
    gaps = [turn(styled[frame], walk[frame]).max() for frame in (59, -1)]
    assert gaps[0] > 0.1 and gaps[1] < 0.3 * gaps[0]
