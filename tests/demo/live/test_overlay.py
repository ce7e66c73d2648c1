"""Nothing covers anything: at every size, with everything on and off, panels and words keep away from each other and
from the figures."""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from demo.figure.body import figure
from demo.figure.colours import part_colours
from demo.live import actions, overlay
from demo.live.live import FRAME_SECONDS, Live
from demo.render.inset import Inset
from demo.ui import canvas, layout, panels
from demo.ui.hud import Highlight, Panel
from sim.body.skeleton import INDEX, PART_NAMES
from sim.command import Command
from sim.math import rotations as rot
from sim.style_spec import StyleSpec
from tests.support.fakes import BENDS, fake_session, offscreen

SIZES = (800, 600), (1152, 648), (1280, 720), (1920, 1080), (2560, 1440), (3840, 2160)
LONG = "limp.bvh cannot be used: " + "its joints have names that nobody has ever heard of " * 2 + "; say with --map"
LEAST_LETTERS = 11  # pixels


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch, offscreen((64, 48)) as window:
        patch.setenv("PATCHWALK_HOME", str(tmp_path_factory.mktemp("home")))
        yield window


@pytest.fixture
def live(opened) -> Live:
    opened.size = 64, 48
    live = Live(fake_session(), tuple(BENDS), opened, clock=lambda: 100.0)
    for _ in range(20):
        live.step()
    return live


def settle(live: Live, size: tuple[int, int], now: float = 100.0) -> None:
    """Shows it in a window of that size, with the camera where it wants to be."""
    live.window.size = size
    for _ in range(2):
        overlay.look(live, now)
        live.view.follow(live.frame, 10.0)


def boxes_of(live: Live) -> dict[str, tuple]:
    """All that is flat in the picture, and the figures, by what they are."""
    size, view, frame = live.window.size, live.view, live.frame
    flat = [*layout.place(view.panels, size), *(each for each in view.over if not isinstance(each.panel, Highlight))]
    boxes = {f"{number}: {str(placed.panel)[:300]}": placed.box for number, placed in enumerate(flat)}
    boxes["figure"] = view.figure_box(frame.styled, size)
    if view.twin:
        boxes["twin"] = view.figure_box(frame.neutral, size, view.twin_shift(frame))
    return boxes


def assert_apart(live: Live) -> None:
    boxes, (width, height) = boxes_of(live), live.window.size
    for name, (left, top, across, down) in boxes.items():
        assert left >= 0 and top >= 0 and left + across <= width and top + down <= height, f"beyond the window: {name}"
    for (one, a), (other, b) in itertools.combinations(boxes.items(), 2):
        if {one, other} != {"figure", "twin"}:
            apart = any(a[axis] + a[axis + 2] <= b[axis] or b[axis] + b[axis + 2] <= a[axis] for axis in (0, 1))
            assert apart, f"one covers the other: {one} at {a}, {other} at {b}"


@pytest.mark.parametrize("size", SIZES)
def test_nothing_covers_anything_whatever_is_on(live, size):
    for hidden, menu, insight, twin, toasts, plays in itertools.product(
        (False, True), (False, True), (False, True), ("", "beside", "ghost"), ([], ["short"], [LONG] * 5), (False, True)
    ):
        live.hidden, live.menu.open, live.view.twin = hidden, menu, twin
        live.seen = set(actions.SEEN) if insight else set()
        live.choice.blending = live.devices.crouching = insight
        live.toasts = [(1e9, text, canvas.INK) for text in toasts]
        live.inset._left, live.inset.style = int(plays), "limp"
        live.labels._until = dict.fromkeys(PART_NAMES, 1e9 if insight else 0.0)
        settle(live, size)
        assert_apart(live)
        shown = [placed.panel for placed in layout.place(live.view.panels, size)]
        style = panels.style_panel(live.choice, False, False)
        assert any(isinstance(panel, Panel) and panel.width == style.width for panel in shown) != hidden
        assert any("stylizer: " in str(panel) for panel in shown) != hidden
        if insight and not (hidden or menu or toasts or plays):
            assert len(shown) == len(live.view.panels), "all there is finds room"


@pytest.mark.parametrize("size", SIZES)
def test_the_help_keeps_away_from_the_buttons_and_the_figure(live, size):
    for page, twin in itertools.product((1, 2), ("", "beside", "ghost")):
        live.helping, live.view.twin = page, twin
        settle(live, size)
        assert_apart(live)
        assert boxes_of(live)["figure"][3] > size[1] / 5, "it is large enough to be looked at"


@pytest.mark.parametrize("size", SIZES)
def test_the_attract_mode_is_as_tidy(live, size):
    live.playing = Command(style=StyleSpec({"arms": "bent"}))
    settle(live, size)
    assert_apart(live)


def test_both_figures_are_whole_and_not_too_small_in_the_smallest_window(live):
    live.view.twin, live.seen = "beside", set(actions.SEEN)
    settle(live, (800, 600))
    assert_apart(live)
    boxes = boxes_of(live)
    assert min(boxes["figure"][3], boxes["twin"][3]) > 600 / 4


@pytest.mark.parametrize("size", SIZES)
def test_no_letters_are_too_small(live, size, monkeypatch):
    seen, scale = [], layout.scale_for(size)
    write = canvas.Canvas.text

    def spy(self, text, x, middle, colour=canvas.INK, size=canvas.TEXT, align=0.0):
        seen.append((canvas._font(size * self._k).get_height() / canvas.OVERSAMPLING, text))
        write(self, text, x, middle, colour, size, align)

    monkeypatch.setattr(canvas.Canvas, "text", spy)
    live.menu.open, live.seen = True, set(actions.SEEN)
    for live.helping in (0, 1, 2):
        settle(live, size)
        for panel in live.view.panels:
            layout.Placed(panel, (0, 0, 1, 1), scale).pixels()
    assert len(seen) > 100 and min(seen)[0] >= LEAST_LETTERS, min(seen)


def test_the_figure_glides_where_the_panels_leave_room_and_is_never_covered_by_them_for_long(live):
    size = 1152, 648
    settle(live, size)
    live.seen, live.view.twin = set(actions.SEEN), "beside"
    middles = []
    for _ in range(60):
        overlay.look(live, 100.0)
        live.view.follow(live.frame, FRAME_SECONDS)
        box = boxes_of(live)["figure"]
        middles.append(box[0] + box[2] / 2)
    steps = np.abs(np.diff(middles))
    assert np.ptp(middles) > 40 and steps.max() < 0.25 * np.ptp(middles), "no jump"
    assert steps[-1] < 0.5
    assert_apart(live)


@pytest.mark.parametrize("size", [(800, 600), (1280, 720)])
@pytest.mark.parametrize("move", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0)])
def test_a_figure_that_walks_and_runs_stays_clear_of_the_panels(live, size, move):
    live.seen = set(actions.SEEN)
    settle(live, size)
    for number in range(90):
        gait = "run" if number > 45 else "walk"
        live.frame = live.session.step(Command(move=move, gait=gait))
        overlay.look(live, 100.0)
        live.view.follow(live.frame, FRAME_SECONDS)
        assert_apart(live)


def test_arms_held_out_are_clear_of_the_panels_too(live):
    pose, local = live.frame.styled, live.frame.styled.local_rotations.copy()
    local[[INDEX["LeftArm"], INDEX["RightArm"]]] = rot.IDENTITY
    from sim.body.kinematics import to_global

    wide = pose.with_body(pose.hips, to_global(local))
    live.frame = type(live.frame)(live.frame.command, wide, wide)
    for size in SIZES:
        settle(live, size)
        assert_apart(live)


def test_the_box_of_a_figure_holds_all_its_skin(live):
    from demo.figure.skin import COARSE, load_skin

    skin, size = load_skin(COARSE), (1280, 720)
    for _ in range(5):
        for _ in range(7):
            live.frame = live.session.step(Command(move=(1.0, 0.0), style={"arms": ("flapping", 1.0)}))
            live.view.follow(live.frame, FRAME_SECONDS)
        bones = figure(live.frame.styled, part_colours(StyleSpec())).bones
        corners = skin.posed(bones)[0]
        places = live.view.pixels(corners, size)[:, :2]
        left, top, width, height = live.view.figure_box(live.frame.styled, size)
        assert (places >= [left, top]).all() and (places <= [left + width, top + height]).all()
        assert width * height < 2.5 * np.prod(np.ptp(places, axis=0)), "and not much more"


def test_a_change_of_style_is_named_beside_the_figure_for_a_while(live):
    def named() -> list[str]:
        return [word for each in live.view.over for word in [str(each.panel)] if "bent" in word or "no style'" in word]

    settle(live, (1280, 720))
    assert named() == []
    live.do("pick_legs")
    live.do("style_next")
    live.step()
    settle(live, (1280, 720), now=101.0)
    (words,) = named()
    assert "legs: bent 100%" in words
    settle(live, (1280, 720), now=104.0)
    assert named() == []
    live.do("own_style")
    live.step()
    settle(live, (1280, 720), now=105.0)
    assert "legs: no style" in named()[0]


def test_the_twin_has_a_caption(live):
    for twin, words in (("beside", "neutral"), ("ghost", "neutral, see-through"), ("", None)):
        live.view.twin = twin
        settle(live, (1280, 720))
        captions = [str(each.panel) for each in live.view.over]
        assert captions == [] if words is None else f"text='{words}'" in captions[0]


def test_the_clip_of_a_style_is_played_in_its_panel():
    assert Inset().style == ""


@pytest.mark.parametrize("size", SIZES)
def test_in_a_crowd_who_is_steered_is_pointed_out_and_who_is_near_is_told(live, size):
    here = live.frame.styled
    places = np.array([[1.0, 0, 0.5], [-1.2, 0, -0.5], [9.0, 0, 0]])
    poses = type(here).stacked(
        [replace(here, root_position=here.root_position + at, hips=here.hips + at) for at in places]
    )
    styles = [StyleSpec({"legs": name, "arms": "bent"}) for name in BENDS]
    live.crowd = SimpleNamespace(poses=poses, styles=styles, half=6.0)
    live.crowd_colours = np.array([part_colours(style) for style in styles])
    live.view.camera.stand_at(8.0, 0.5)
    settle(live, size)
    told = [[cell.text for cell in placed.panel.widgets[0].rows[0]] for placed in live.view.over]
    assert told[0] == ["you"] and 1 < len(told) <= 3
    assert all(words in (["bent"], ["flapping", "bent"]) for words in told[1:]), "the third is far off"
    assert_apart(live)


def test_a_crowd_is_looked_down_on_from_farther_away_the_larger_it_is(live):
    eyes = []
    for half in (2.0, 6.0):
        crowd = SimpleNamespace(poses=None, styles=[StyleSpec({"legs": "bent"})], half=half)
        live.join(crowd)
        live.view.follow(live.frame, 10.0)
        eyes.append((live.view.camera.distance, live.view.camera.pitch))
    assert 4 < eyes[0][0] < eyes[1][0] and eyes[0][1] == eyes[1][1] > 0.4
    bent = np.array(part_colours(StyleSpec({"legs": "bent"})))
    assert np.ptp(live.crowd_colours[0], axis=-1).max() < np.ptp(bent, axis=-1).max(), "paler than who is steered"
