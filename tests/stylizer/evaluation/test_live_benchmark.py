"""The live evaluation: what it measures, and that its report has what it promises."""

from types import SimpleNamespace

import pytest

from demo.assemble import build_session
from sim.math.springs import response, soft_spring_step
from stylizer.evaluation.live_benchmark import (
    GROUP_JOINTS,
    MOVEMENTS,
    Reference,
    format_table,
    gait_figures,
    group_distances,
    mean_positions,
    measure_style,
    measure_switches,
    motion_amplitude,
    on_all_parts,
    play,
    reference_for,
    summarize,
)

CONTRACT = {
    "style",
    "movement",
    "sra",
    "top3",
    "cra",
    "mean_pose",
    "motion_amplitude",
    "speed",
    "cadence_hz",
    "stride_m",
    "clip",
    "bounce_cm",
    "toe_cm",
    "skate_cm_s",
    "jerk",
}


@pytest.fixture(scope="module")
def session():
    return build_session()


@pytest.fixture(scope="module")
def walks(session):
    """Two seconds of walking at 1.3 m/s: in two styles, and neutral."""
    return play(session, [MOVEMENTS["walk_1.3"]] * 3, [on_all_parts("old"), on_all_parts("soldier"), {}], seconds=2)[0]


def classifiers(right: float) -> dict:
    panel = SimpleNamespace(knows=bool, share=lambda features, wanted, top=1: right)
    return dict.fromkeys(("style", "upper_style", "content"), panel)


def test_the_neutral_walk_goes_as_it_is_asked(walks):
    figures = gait_figures(walks[-1])
    assert figures["speed"] == pytest.approx(1.3, abs=0.03) and figures["cadence_hz"] == pytest.approx(0.95, abs=0.07)
    assert figures["stride_m"] == pytest.approx(figures["speed"] / figures["cadence_hz"])
    assert 0 < figures["bounce_cm"] < 10 and 3 < figures["toe_cm"] < 15 and 40 < figures["knee_most_bent"] < 90


def test_styles_differ_from_the_neutral_walk_where_they_should(walks):
    old, soldier, neutral = walks
    assert group_distances(mean_positions, old.features, neutral.features)["spine"] > 0.05  # metres: it stoops
    assert gait_figures(soldier)["knee_most_bent"] > gait_figures(neutral)["knee_most_bent"] + 10  # it lifts its knees
    assert group_distances(motion_amplitude, soldier.features, soldier.features) == dict.fromkeys(GROUP_JOINTS, 0.0)


def test_rows_hold_what_is_promised_and_a_perfect_copy_scores_perfectly(walks):
    old, soldier, neutral = walks
    references = {"walk": Reference(old, soldier)}
    found = measure_style("old", "walk_1.3", old, neutral, references, classifiers(0.5))
    assert CONTRACT <= found.keys() and found["sra"] == found["cra"] == 0.5
    for group in GROUP_JOINTS:
        assert found["mean_pose"][group]["drawn"] == 0.0 and found["motion_amplitude"][group]["drawn"] == 1.0
        assert found["mean_pose"][group]["other_take"] > 0.1
    unstyled = measure_style("old", "walk_1.3", neutral, neutral, references, classifiers(0.0))
    assert all(
        unstyled["mean_pose"][group]["drawn"] == 1.0 and unstyled["motion_amplitude"][group]["drawn"] == 0.0
        for group in GROUP_JOINTS
    )


def test_a_movement_without_a_clip_is_compared_with_the_walk(walks):
    references = {"walk": Reference(walks[0], None), "run": Reference(walks[1], None)}
    assert reference_for("run_3.0", references) == ("run", references["run"])
    assert reference_for("strafe", references) == ("walk", references["walk"])
    found = measure_style("old", "stand", walks[1], walks[2], references, classifiers(1.0))
    assert found["cra"] is None and found["mean_pose"]["arms"]["other_take"] is None


def test_a_style_without_a_label_is_measured_and_not_judged(walks):
    found = measure_style(
        "zombie", "walk_1.3", walks[0], walks[2], {"walk": Reference(walks[0], None)}, classifiers(1.0)
    )
    assert found["sra"] is found["top3"] is None and found["mean_pose"]["legs"]["drawn"] == 0.0


def test_the_table_shows_every_movement(walks):
    old, soldier, neutral = walks
    rows = [
        measure_style(name, "walk_1.3", motion, neutral, {"walk": Reference(soldier, None)}, classifiers(1.0))
        for name, motion in (("old", old), ("soldier", soldier), ("proud", neutral))
    ]
    total = summarize(rows, neutral)
    assert total["sra"] == 1.0 and 0 < total["mean_pose"]["legs"]["drawn"] < 1.5
    found = {"count": 2, "over_1500_deg_s": 0, "over_15_cm": 0, "fastest_deg_s": 900.0, "farthest_cm": 7.0}
    report = {"movements": {"walk_1.3": total}, "switches": found, "classifiers": {"style": 0.95}, "arms": []}
    text = format_table(report)
    assert "walk_1.3" in text and "2 switches: 0 with a joint over 1,500 degrees/s" in text


def test_a_switch_is_counted_where_a_joint_whips_round(session, monkeypatch):
    calm = measure_switches(session, ["old", "proud"], count=3)
    assert calm["count"] == 2 and calm["over_1500_deg_s"] == calm["over_15_cm"] == 0
    no_smoothing = response(soft_spring_step, 1e-3, 1 / 60)
    monkeypatch.setattr("stylizer.runtime.inertialization.CLOSE", no_smoothing)
    assert measure_switches(session, ["old", "proud"], count=3)["fastest_deg_s"] > max(1500.0, calm["fastest_deg_s"])
    assert 0 < calm["farthest_cm"] <= 15
