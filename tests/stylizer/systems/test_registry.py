"""The three whole-body systems: shapes, one overfitted batch each, training that resumes, and the live stylizer."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from sim.body.skeleton import INDEX, PART_NAMES, PARTS
from sim.math import rotations as rot
from sim.motion.features import clip_features
from stylizer.data.dataset import MotionData
from stylizer.data.domains import NOISE, LabelledSampler, label_of, labels_of
from stylizer.evaluation.compare import Sampled, compare
from stylizer.evaluation.playback import Styles, play_live
from stylizer.networks.blocks import BODY, ROOTED, AdaIN, DomainHead, InstanceNorm, ResBlock, by_joint, whole
from stylizer.runtime.global_motion import change_global_motion, follow_predicted_root
from stylizer.runtime.offline import ResolvedStyle, encode_clip, resolve_styles, stylize, to_pose
from stylizer.styles import bank as bank_module
from stylizer.styles import code_bank
from stylizer.styles.bank import own_motion_file
from stylizer.styles.code_bank import CodeBank, build_codes
from stylizer.styles.keypoints_2d import TORSO
from stylizer.styles.style_clips import Gait, OwnMotion
from stylizer.styles.style_file import GAIT_NUMBERS, read_checked, read_own_motion, read_windows, write_own_motion
from stylizer.systems import checkpoint, latent, unpaired, weight_files
from stylizer.systems.whole_body import combine_joints, complete_features, joints_by_code
from stylizer.training.train_systems import SystemTrainer
from tests.stylizer.runtime.test_live import turn
from tests.stylizer.systems.conftest import LABELS, TINY, model_of
from tests.support.walker import walking_clip

pytestmark = pytest.mark.usefixtures("tiny")


def test_labels_are_told_from_file_names(data):
    assert label_of("bandai-namco/dataset-2_walk-turn-left_not-confident_012") == "not-confident 2"
    assert label_of("patchwalk/neutral_3") == label_of("100style-neutral/Neutral_FW") == "neutral"
    assert label_of("cmu16/16_11") is None
    assert labels_of(data) == LABELS
    with pytest.raises(ValueError, match="learns from style labels.*unpack bandai-namco"):
        labels_of(MotionData(data.motion, data.clips[:2], {}))


def test_labelled_windows_are_of_their_domains(data):
    batch = LabelledSampler(data, LABELS, 16, seed=0).batch(40)
    assert batch.source.shape == (40, 16, 21, 15) and batch.noise.shape == (40, NOISE)
    shifted = np.abs(batch.target_kin[:, :, 12, 3].mean(axis=1)) > 0.2  # half of them are mirrored
    assert np.array_equal(shifted, batch.target_domain == 1) and 5 < shifted.sum() < 35
    assert np.array_equal(np.abs(batch.kin[:, :, 12, 3].mean(axis=1)) > 0.2, batch.source_domain == 1)


def test_a_rooted_graph_tells_neighbours_apart():
    own, nearer, farther = ROOTED[1].mixing(2)
    knee, hip, ankle = (INDEX[f"Left{name}"] for name in ("Leg", "UpLeg", "Foot"))
    assert own[knee, knee] == nearer[knee, hip] == farther[knee, ankle] == 1
    assert nearer.sum(axis=1)[0] == 0 and np.isclose(farther[0].sum(), 1) and np.count_nonzero(farther[0]) == 3
    for graph in (*ROOTED.values(), BODY):
        assert np.count_nonzero(graph.mixing(2).sum(axis=(1, 2))) == (3 if graph.size > 1 else 1)


def test_adain_sets_what_the_code_says_and_instance_norm_takes_it_out():
    x = torch.randn(5, 2, 64, 3) * 4 + 7
    layer = AdaIN(4, 3)
    y = layer(x, torch.randn(2, 4))
    assert torch.allclose(InstanceNorm()(y).mean((0, 2)), torch.zeros(2, 3), atol=1e-4)
    assert torch.allclose(InstanceNorm()(x), InstanceNorm()(x * 3 + 1), atol=5e-3)
    scale, bias = layer.affine(torch.zeros(1, 4)).chunk(2, dim=1)
    z = layer(x, torch.zeros(2, 4))
    assert torch.allclose(z.mean((0, 2)), bias.expand(2, 3), atol=1e-4)
    assert torch.allclose(z.std((0, 2)), (1 + scale).abs().expand(2, 3), rtol=0.02)


def test_blocks_keep_their_shapes():
    joints = torch.randn(21, 2, 8, 6)
    assert ResBlock(ROOTED[1], 6, 10, 3, coarse=ROOTED[2])(joints).shape == (10, 2, 4, 10)
    assert ResBlock(BODY, 6, 6, 3, lambda channels: AdaIN(4, channels))(joints[:1], torch.randn(2, 4)).shape == (
        1,
        2,
        8,
        6,
    )
    assert torch.equal(by_joint(whole(joints)), joints)
    head, feature = DomainHead(6, 3, 4), torch.randn(2, 6)
    both = head(feature, torch.tensor([2, 0]))
    assert torch.allclose(both[0], head.branches(feature)[0, 8:], atol=1e-6) and both.shape == (2, 4)


@pytest.mark.parametrize("network", TINY)
@pytest.mark.parametrize("samples", [16, 40])
def test_a_system_restyles_windows_of_any_length(network, samples):
    model = model_of(network)
    motion = torch.randn(21, 3, samples, 15)
    codes = model.encode(motion, torch.tensor([0, 1, 0]))
    axes, hips = model.restyled(motion, codes)
    assert axes.shape == (21, 3, samples, 6)
    assert hips is None if network == "unpaired" else hips.shape == (1, 3, samples, 3)
    other = model.restyled(motion, codes + 1).axes
    assert (axes - other).abs().max() > 1e-4, "a code makes a difference"


@pytest.mark.parametrize("network", TINY)
def test_one_batch_can_be_learned_by_heart(network, data):
    trainer = SystemTrainer(data, network)
    trainer.recipe = replace(trainer.recipe, learning_rate=3e-3)
    batch = trainer.sampler.batch(4)
    trainer.sampler.batch = lambda size: batch
    name, stages = {
        "unpaired": ("content", [0.0]),
        "diverse": ("identity", [0.0]),
        "latent": ("reconstruction", [0.0, 0.5]),
    }[network]
    for progress in stages:
        first = trainer.update(progress)
        for _ in range(80):
            last = trainer.update(progress)
    assert last[name] < 0.7 * first[name]


@pytest.mark.parametrize("network", TINY)
def test_a_resumed_run_is_the_run_that_never_stopped(network, data, tmp_path):
    for progress in (0.0, 0.5):
        whole_run, resumed = (SystemTrainer(data, network, seed) for seed in (1, 7))
        for step in range(4):
            if step == 2:
                whole_run.keep(tmp_path / "checkpoint.pt")
            whole_run.update(progress)
        resumed.restore(tmp_path / "checkpoint.pt")
        for _ in range(2):
            resumed.update(progress)
        for part in ("objective", "average"):
            for a, b in zip(
                getattr(whole_run, part).state_dict().values(), getattr(resumed, part).state_dict().values()
            ):
                assert torch.equal(a, b)


def test_a_discriminator_sees_the_end_of_a_window_by_itself():
    discriminator = unpaired.Discriminator(replace(TINY["unpaired"], labels=LABELS))
    motion = torch.randn(1, 3, 16, 21 * 9)
    other = motion.clone()
    other[:, :, : 16 - unpaired.END] += 1.0
    (first, end), (first_other, end_other) = (discriminator.feature(each).chunk(2) for each in (motion, other))
    assert torch.equal(end, end_other) and not torch.allclose(first, first_other)
    assert discriminator.score(discriminator.feature(motion), torch.tensor([0, 1, 0])).shape == (6, 1)


def test_a_phase_changes_only_what_learns_in_it(data):
    trainer = SystemTrainer(data, "latent")
    before = {name: value.clone() for name, value in trainer.model.named_parameters()}
    trainer.update(0.9)
    changed = {
        name.split(".")[0] for name, value in trainer.model.named_parameters() if not torch.equal(value, before[name])
    }
    assert changed == {"content_encoder", "style_encoder", "generator"}


def test_unlabelled_and_variational_latent_learn_too(data, monkeypatch):
    for change in ({"labelled": False}, {"variational": True}):
        config = replace(TINY["latent"], **change)
        monkeypatch.setitem(latent.CONFIGS, "latent", config)
        trainer = SystemTrainer(data, "latent")
        found = trainer.update(0.0) | trainer.update(0.9)
        assert all(np.isfinite(value) for value in found.values()) and "reconstruction" in found
    assert ("spread" in found) and ("size" not in found)


def test_a_view_is_the_body_turned_and_its_depth_dropped():
    model = model_of("unpaired")
    motion = torch.zeros(21, 1, 4, 15)
    motion[INDEX["LeftHand"], ..., :3] = torch.tensor([0.5, 1.0, 0.2])
    hand = unpaired.POINTS.index("LeftHand")
    rest = torch.from_numpy(walking_clip(4).positions()).float()[None]
    torso = (unpaired.points_of(rest)[..., unpaired.POINTS.index("Neck"), :]).norm(dim=-1)
    assert torch.allclose(torso, torch.tensor(TORSO), atol=0.01), "what a video is measured by is what training saw"
    front, side = (
        model.projected(motion, torch.tensor([yaw]), torch.tensor([scale]))[0, 0, hand]
        for yaw, scale in ((0.0, 1.0), (torch.pi / 2, 2.0))
    )
    assert torch.allclose(front, torch.tensor([0.5, 1.0]), atol=1e-5)  # its left is to the right of who faces it
    assert torch.allclose(side, torch.tensor([-0.4, 2.0]), atol=1e-5)


def test_a_completed_body_has_our_bones_and_true_velocities():
    content = clip_features(walking_clip(90))[::2]
    same = complete_features(content, content[..., 3:9], content[..., 0, :3])
    assert np.allclose(same[1:, :, :9], content[1:, :, :9], atol=1e-6)
    assert np.allclose(same[2:, :, 9:12], content[2:, :, 9:12], atol=0.02)
    standing = complete_features(content, content[..., 3:9], None)
    assert np.allclose(standing[..., :9], same[..., :9], atol=1e-6)


def test_parts_take_what_the_answer_in_their_own_style_says():
    joints = joints_by_code([("a",), None, ("b",), ("a",), None])
    assert set(joints[("a",)]) == set(PARTS["left_leg"] + PARTS["left_arm"]) and set(joints[("b",)]) == set(
        PARTS["spine"]
    )
    result = combine_joints(
        np.zeros((2, 21, 15)), {("a",): np.ones((2, 21, 15)), ("b",): np.full((2, 21, 15), 2.0)}, joints
    )
    assert result[:, 1].min() == 1 and result[:, 9].max() == 2 and result[:, [5, 17]].max() == 0


# ---- the bank, live and offline -----------------------------------------------------------


@pytest.fixture(scope="module")
def poses():
    every = to_pose(walking_clip(60))
    return [every[frame] for frame in range(60)]


@pytest.fixture(scope="module")
def own_file(tmp_path_factory):
    """What the package keeps of the controller's motion, but for three movements only."""
    motion = read_own_motion(own_motion_file())
    few = [motion.gait.movements.index(name) for name in ("stand", "walk_1.3", "run_3.0")]
    gait = Gait(
        tuple(motion.gait.movements[i] for i in few), *(getattr(motion.gait, key)[few] for key in GAIT_NUMBERS), None
    )
    path = own_motion_file(tmp_path_factory.mktemp("own"))
    own = OwnMotion([motion.windows[i] for i in few], [motion.phases[i] for i in few], gait, motion.controller)
    write_own_motion(path, own)
    return path


@pytest.fixture(params=TINY)
def bank(request, tmp_path, monkeypatch, walk_file, own_file):
    """A code bank of the bundled neutral style and one of the user's own, `limp`."""
    model = model_of(request.param)
    with torch.no_grad():
        for name, parameter in model.named_parameters():
            if "affine" in name:
                parameter.mul_(4)  # untrained, the styles would hardly differ
    features = clip_features(walking_clip())
    model.set_statistics(features.mean(0), np.full((21, 15), 0.3))
    monkeypatch.setattr(weight_files, "FOLDER", tmp_path / "weights")
    checkpoint.save(model, weight_files.FOLDER / f"{request.param}.safetensors", licence="none")
    (tmp_path / "styles").mkdir()
    shutil.copy(own_file, tmp_path / "styles")
    monkeypatch.setattr(bank_module, "BUNDLED", tmp_path / "styles")
    build_codes(request.param, weight_files.FOLDER, tmp_path, tmp_path / "styles")
    bank = CodeBank(request.param, tmp_path / "styles", tmp_path / "user")
    bank.add("limp", walk_file)
    return bank


def test_a_bank_knows_its_styles_again(bank):
    again = CodeBank(bank.name, bank.bundled, bank.user)
    assert again.names == bank.names and {"neutral", "limp"} <= set(bank.names)
    assert all(torch.equal(again[name].features, bank[name].features) for name in bank.names)
    assert again["neutral"].gait.movements == ("stand", "walk_1.3", "run_3.0") and again["limp"].gait.movements == (
        "walk",
    )
    with pytest.raises(ValueError, match="comes with Patchwalk"):
        bank.remove("neutral")
    bank.remove("limp")
    assert "limp" not in CodeBank(bank.name, bank.bundled, bank.user).names


def test_styles_of_chance_are_drawn_anew(bank):
    if bank.model.KIND == "unpaired":
        assert not bank.sampled
        with pytest.raises(ValueError, match="clips only"):
            bank.model.code_from_noise(torch.zeros(1, 4), torch.zeros(1, dtype=torch.long))
        return
    assert set(bank.sampled) == {"drawn-old-1", "drawn-proud-1"} < set(bank.names)
    before = bank["drawn-old-1"]
    bank.resample()
    assert not torch.equal(before.features, bank["drawn-old-1"].features)
    bank.resample(0)
    assert torch.equal(before.features, bank["drawn-old-1"].features)


def test_only_labels_that_a_system_learned_are_asked_of_it_by_chance(bank):
    from types import SimpleNamespace

    known, unknown = (SimpleNamespace(style=style) for style in ("old 1", "azuma wd2"))
    assert Sampled(bank.model).targets([unknown, known]) == [known]
    assert Sampled(bank.model).targets([unknown]) == [unknown]


def test_a_user_style_added_for_one_stylizer_is_there_for_motion_puzzle(bank):
    header, tensors = read_checked(bank.user / "limp.safetensors")
    (windows,) = read_windows(tensors)  # of one kind of movement
    assert windows.shape[1:] == (32, 21, 15) and len(windows) > 1
    assert header["weights"] == bank.fingerprint and header["controller"] == bank.controller


def test_live_restyles_only_what_is_worn_and_repeats(bank, poses):
    from stylizer.runtime.whole_body_live import WholeBodyStylizer

    poses = poses[:40]
    styled = [live_stream(WholeBodyStylizer, bank, poses, {"left_arm": ("limp", 1.0)}) for _ in range(2)]
    for first, second, neutral in zip(*styled, poses):
        assert np.array_equal(first.rotations, second.rotations)
        others = [joint for joint in range(21) if joint not in PARTS["left_arm"]]
        assert np.array_equal(first.rotations[others], neutral.rotations[others])
    assert turn(styled[0][-1], poses[-1])[13:17].max() > 0.02
    assert all(a is b for a, b in zip(live_stream(WholeBodyStylizer, bank, poses[:5], {}), poses))


def test_a_live_window_ends_with_its_newest_sample_held(bank, poses, monkeypatch):
    from stylizer.runtime import whole_body_live

    seen, stylize_windows = [], whole_body_live.stylize_windows

    def watched(model, windows, *how, **more):
        seen.append(windows)
        return stylize_windows(model, windows, *how, **more)

    monkeypatch.setattr(whole_body_live, "stylize_windows", watched)
    live_stream(whole_body_live.WholeBodyStylizer, bank, poses[:40], {"spine": ("limp", 1.0)})
    held = bank.model.LOOK_AHEAD
    assert all(window.shape[1] == bank.model.config.window for window in seen)
    last = seen[-1][0]
    assert (last[-1 - held :] == last[-1]).all() and (last[-2 - held] != last[-1]).any()


def test_each_of_a_crowd_moves_as_it_would_alone(bank, poses):
    from sim.body.pose import Pose
    from sim.motion.feature_window import RingBuffer
    from stylizer.runtime.whole_body_live import WholeBodyStylizer

    poses, wears = poses[:12], ({"left_arm": ("limp", 1.0)}, {}, {"spine": ("neutral", 1.0, "limp", 0.5)})
    crowd, history, combine_joints = WholeBodyStylizer(bank).crowd(len(wears)), RingBuffer(), []
    for pose in poses:
        everyone = Pose.stacked([pose] * len(wears))
        history.push(everyone)
        combine_joints.append(crowd.step(history.window(), everyone, wears))
    for one, worn in enumerate(wears):
        for styled, alone in zip(combine_joints, live_stream(WholeBodyStylizer, bank, poses, worn), strict=True):
            assert np.allclose(styled.rotations[one], alone.rotations, atol=1e-9)


def live_stream(kind, bank, poses, style):
    from sim.motion.feature_window import RingBuffer

    stylizer, history, styled = kind(bank), RingBuffer(), []
    for pose in poses:
        history.push(pose)
        styled.append(stylizer.step(history.window(), pose, style))
    return styled


def test_offline_and_evaluation_speak_to_a_system_as_to_motion_puzzle(bank):
    walk = walking_clip(100)
    worn = {"right_arm": ("limp", 1.0), "left_arm": ("neutral", 0.5, "limp", 0.5)}
    styled = stylize(bank.model, walk, resolve_styles(bank, worn))
    apart = np.abs(np.sum(styled.rotations * walk.rotations, axis=-1)).min(axis=0) < 1 - 1e-6
    assert set(np.flatnonzero(apart)) == set(PARTS["left_arm"] + PARTS["right_arm"])
    code = encode_clip(bank.model, clip_features(walk), "old 1")
    target = replace(code, features=code.features + 1)
    result = play_live(
        Styles(bank.model, {"neutral": code, "target": target}), walk, lambda _: {"spine": ("target", 1.0)}
    )
    offline = stylize(bank.model, walk, {"spine": ResolvedStyle(code)})
    assert len(result.styled) == len(result.locked) == len(offline) == 100
    moved = turn_of_clips(result.styled, walk)
    assert moved[:, list(PARTS["spine"])].max() > 0.01 and moved[:, list(PARTS["left_leg"])].max() < 1e-6


@pytest.mark.parametrize("network", ["diverse", "latent"])
def test_styles_by_chance_are_put_on_to_be_judged(network):
    sampled, walk, take = Sampled(model_of(network)), walking_clip(60), SimpleNamespace(style="old 1")
    features, drawn = sampled(walk, take, take)
    assert features.shape == (60, 21, 15) and turn_of_clips(drawn, walk).max() > 0.01


def turn_of_clips(a, b):
    """(frames, 21) angle between the global rotations of two clips."""
    return np.linalg.norm(
        rot.to_rotation_vector(rot.multiply(a.global_rotations(), rot.inverse(b.global_rotations()))), axis=-1
    )


def test_global_motion(bank):
    walk = walking_clip(120)
    worn = dict.fromkeys(PART_NAMES, ("limp", 1.0))
    if bank.model.KIND == "unpaired":
        bank._speeds["limp"] = 2 * bank.speed_of("neutral")
        from stylizer.systems.whole_body import velocity_factor

        pace = bank._speeds["limp"] / velocity_factor(clip_features(walk))
        assert abs(len(change_global_motion(bank, walk, walk, worn)) - 120 / np.clip(pace, 0.5, 2)) < 2
    elif bank.model.KIND == "latent":
        moved = follow_predicted_root(bank.model, walk)
        assert len(moved) == 120 and np.allclose(moved.rotations[:, 1:], walk.rotations[:, 1:])
        assert np.allclose(moved.hips[:, 1], walk.hips[:, 1]) and np.allclose(moved.hips[0], walk.hips[0], atol=1e-6)
    else:
        with pytest.raises(ValueError, match="leave --global-motion out"):
            change_global_motion(bank, walk, walk, worn)


def test_a_stylizer_takes_over_without_a_jump(bank, poses):
    from sim.motion.feature_window import RingBuffer
    from stylizer.runtime.whole_body_live import WholeBodyStylizer

    stylizer, history, styled = WholeBodyStylizer(bank), RingBuffer(), []
    worn = {"left_arm": ("limp", 1.0)}
    for frame, pose in enumerate(poses):
        history.push(pose)
        if frame == 40:
            other = WholeBodyStylizer(Shifted(bank))
            other.transfer_state(stylizer)
            stylizer = other
        styled.append(stylizer.step(history.window(), pose, worn))
    steps = [turn(a, b)[13:17].max() for a, b in zip(styled[1:], styled)]
    assert steps[39] < 0.35 * max(turn(styled[-1], styled[39])[13:17].max(), 0.05) + max(steps[30:39])


class Shifted:
    """The same system, in which every style is another."""

    def __init__(self, bank):
        self.model, self.names, self.sampled, self._bank = bank.model, bank.names, {}, bank

    def __getitem__(self, name):
        style = self._bank[name]
        return replace(style, features=style.features + 2)

    def refresh(self):
        pass


def test_codes_of_another_controller_are_refused_in_one_sentence(bank):
    path = bank.bundled / code_bank.CODES / f"{bank.name}.safetensors"
    header, tensors = checkpoint.read(path)
    save_file(tensors, path, header | {"controller": "another"})
    with pytest.raises(
        ValueError, match=f"{bank.name}.safetensors was computed for another controller: .*styles capture'$"
    ):
        CodeBank(bank.name, bank.bundled, bank.user)


def test_codes_of_other_shapes_are_refused_in_one_sentence(bank):
    path = bank.bundled / code_bank.CODES / f"{bank.name}.safetensors"
    header, tensors = checkpoint.read(path)
    fewer = {**tensors, "neutral": tensors["neutral"][1:].contiguous()}
    for damaged, said in ((fewer, header), (tensors, header | {"movements": "{}"})):
        save_file(damaged, path, said)
        with pytest.raises(ValueError, match=f"{bank.name}.safetensors is damaged, or of another version"):
            CodeBank(bank.name, bank.bundled, bank.user)


def test_the_own_style_of_a_system_changes_nothing_bit_for_bit(bank, poses):
    from stylizer.runtime.whole_body_live import WholeBodyStylizer

    worn = dict.fromkeys(PART_NAMES, ("neutral", 1.0))
    for styled, neutral in zip(live_stream(WholeBodyStylizer, bank, poses[:24], worn), poses):
        assert np.array_equal(styled.rotations, neutral.rotations) and np.array_equal(styled.hips, neutral.hips)


def test_a_named_network_without_weights_is_refused_before_anything_is_judged(tmp_path):
    with pytest.raises(
        ValueError, match="there are no weights of large: name the folder that holds them with --weights"
    ):
        compare(tmp_path, networks=["large"])
