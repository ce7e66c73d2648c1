"""The evaluation: halves that do not share a take, judges that learn what is to be seen, and a report of the promised
form."""

import numpy as np
import pytest

from sim.body.skeleton import INDEX, PART_NAMES
from sim.io import bvh
from sim.math import rotations as rot
from stylizer.data import style_labels
from stylizer.evaluation import classifier, figures, held_out_pairs, report, transfer_benchmark
from stylizer.evaluation.classifier import load_classifier
from stylizer.systems import weight_files
from tests.support.walker import walking_clip

STYLES = {"normal": 0.0, "proud": 0.6, "old": -0.9}  # how far the left arm is raised, radians


@pytest.fixture
def data(tmp_path):
    """A folder of labelled walks, two takes each but for one that has a single long one, and a clip that is no walk of
    ours."""
    folder = tmp_path / "mocap" / "deep"
    folder.mkdir(parents=True)
    for style, angle in STYLES.items():
        for take in range(1 if style == "old" else 2):
            clip = walking_clip(220 if style == "old" else 110)
            raised = np.full(len(clip), angle + 0.05 * take)
            clip.rotations[:, INDEX["LeftArm"]] = rot.from_axis_angle(np.array([0.0, 0, 1]), raised)
            bvh.write(folder / f"dataset-1_walk_{style}_00{take}.bvh", clip)
    bvh.write(folder / "dataset-1_bow_old_001.bvh", walking_clip(80))
    return folder.parent


@pytest.fixture
def quick(bank, monkeypatch, tmp_path):
    """A tiny network that is the shipped one, and little of everything."""
    (weight_files.FOLDER / "tiny.safetensors").rename(weight_files.FOLDER / "joints.safetensors")
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(transfer_benchmark, "TRIALS", 2)
    for name, value in {
        "TRIALS": 2,
        "REAL_SIZE": 6,
        "SAME_CONTENT_SIZE": 2,
        "STEPS": 30,
        "ROWS": (("full", "offline", 2), ("joints", "offline", 2), ("joints", "live", 2)),
    }.items():
        monkeypatch.setattr(report, name, value)
    monkeypatch.setattr(classifier, "STEPS", 30)
    monkeypatch.setattr(classifier, "BATCH", 12)
    for name, value in {"LONGEST": 70, "REBUILT": 1, "SWITCH_EVERY": 20}.items():
        monkeypatch.setattr(figures, name, value)


def test_the_halves_share_no_frames(data):
    halves = style_labels.load(data)
    assert (
        {take.style for take in halves.generate}
        == {f"{style} 1" for style in STYLES}
        == {t.style for t in halves.classify}
    )
    assert {take.content for take in halves.generate} == {"walk"}
    for take in halves.generate:
        (other,) = [t for t in halves.classify if t.style == take.style]
        assert take.path != other.path or len(take.clip) + len(other.clip) == 220
    with pytest.raises(ValueError, match="holds no labelled motion"):
        style_labels.load(data / "deep" / "nothing")


def test_a_judge_learns_what_is_to_be_seen_and_is_kept(data, quick, tmp_path):
    halves = style_labels.load(data)
    first = load_classifier("style", halves.classify, tmp_path / "classifiers")
    seen = np.concatenate([style_labels.windows(take.features, [0, 20, 40]) for take in halves.generate])
    names, features = first.names(seen)
    assert names == [take.style for take in halves.generate for _ in range(3)]
    assert features.shape == (9, classifier.WIDTHS[-1])
    steps = []
    again = load_classifier("style", halves.classify, tmp_path / "classifiers", tick=lambda: steps.append(1))
    assert np.array_equal(again.names(seen)[1], features) and len(steps) == 30
    assert len(list((tmp_path / "classifiers").iterdir())) == 1


def test_a_network_that_copies_keeps_content_and_one_that_swaps_takes_style(data, quick, tmp_path):
    halves = style_labels.load(data)
    classifiers = transfer_benchmark.Classifiers(
        *(load_classifier(kind, halves.classify, tmp_path) for kind in ("content", "style"))
    )

    class Swap:
        """Answers with the target's own motion."""

        def __call__(self, content, source, target):
            return target.features[-len(content) :], target.clip[-len(content) :]

    class Copy:
        def __call__(self, content, source, target):
            return source.features[-len(content) :], content

    swapped, copied = (
        transfer_benchmark.measure_transfer(kind(), halves.generate, classifiers, 6, lambda: None)
        for kind in (Swap, Copy)
    )
    assert swapped["sra"][0] == swapped["drawn_sra"][0] == 1.0 and copied["sra"][0] < 0.7
    assert copied["geodesic"][0] < 1e-6 < swapped["geodesic"][0] and copied["jitter_ratio"][0] == pytest.approx(1.0)


def test_judges_are_asked_about_real_motion_whose_content_they_never_saw_in_that_style(data, quick, tmp_path):
    known = [(content, style) for style in ("old 1", "proud 1") for content in ("dash", "run", "walk")] + [
        ("walk", "lean wd2")
    ]
    shared = held_out_pairs.split_folds(known)
    # each once, but who only walks
    assert sorted(set().union(*shared)) == sorted(known[:-1]) and sum(map(len, shared)) == 6
    assert all(len({style for _, style in fold}) == len(fold) for fold in shared)
    halves, asked = style_labels.load(data), []
    real = held_out_pairs.measure_real_unknown(halves, [{("walk", "proud 1")}], tmp_path, lambda: asked.append(1))
    assert real == {"sra": 0.0, "cra": 1.0, "takes": 1} and len(asked) == 60  # a style never seen cannot be named


def test_the_report_has_the_promised_form(data, quick):
    steps = {"all": 0, "done": 0}

    def progress(count):
        steps["all"] = count

        def tick():
            steps["done"] += 1

        return tick

    result = report.evaluate_transfer(data, progress=progress)
    assert steps["all"] == steps["done"] > 0
    assert set(result.report["real"]) >= {"sra", "cra"}
    assert [(row["model"], row["mode"]) for row in result.report["rows"]] == [("joints", "offline"), ("joints", "live")]
    for row in result.report["rows"]:
        for name in ("sra", "cra", "fmd", "geodesic", "skate_cm_s", "jitter_ratio", "parameters", "ms_per_frame"):
            assert len(row[name]) == 2 and np.isfinite(row[name]).all()
    further = result.report["figures"]
    assert set(further["arrives"]["live"]["mean_pose"]) == set(PART_NAMES) == set(further["locality"]["live"])
    assert further["strength_0"]["farthest_cm"] < 1e-6
    assert any(note.startswith("no weights for full") for note in result.notes)


def test_further_figures_want_neutral_walks(data, bank):
    takes = [take for take in style_labels.load(data).generate if not take.style.startswith("normal")]
    with pytest.raises(ValueError, match="no walk that is 'normal'"):
        figures.Further(bank.model, takes)


def test_the_pictures_are_drawn(data, quick, bank, monkeypatch, tmp_path):
    from stylizer.evaluation import pictures

    names = {style: (f"deep/dataset-1_walk_{style}_000.bvh",) for style in ("proud", "old")}
    monkeypatch.setattr(pictures, "CLIPS", names)
    monkeypatch.setattr(pictures, "POSES", 2)
    monkeypatch.setattr(pictures, "CONTENT", "deep/dataset-1_walk_normal_001.bvh")
    paths = pictures.save_pictures(tmp_path / "pictures", data)
    assert {path.stem for path in paths} >= {"attention-left_leg", "interpolation", "locality", "style-old"}
    assert all(path.stat().st_size > 5000 for path in paths)
    with pytest.raises(ValueError, match="unpack the archives there"):
        pictures.save_pictures(tmp_path / "pictures", tmp_path / "home")
