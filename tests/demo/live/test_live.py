"""The live loop, driven by synthetic SDL events and a clock of its own, without a screen."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pygame
import pytest

from demo.live import capture, overlay
from demo.live.live import FRAME_SECONDS, MAX_CATCH_UP, Live, run_live
from demo.render.quality import QUALITIES
from demo.state.stylizers import Stylizers
from demo.ui import panels
from sim.command import Command
from sim.ground.catalogue import load_ground
from sim.io import recording
from tests.demo.conftest import SIZE
from tests.support.fakes import BENDS, Bender, fake_session, key

STYLES = tuple(BENDS)


class Clock:
    """Stands still but for what sleeps, and what `costs` names for each picture."""

    def __init__(self, costs=()) -> None:
        self.now, self.costs = 100.0, list(costs)

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0
        self.now += seconds

    def on(self, window):
        """Each picture that `window` shows takes its time."""

        def show() -> None:
            self.now += self.costs.pop(0) if self.costs else 0.0

        window.show = show
        return window


def play(screen, script: dict[int, list], seconds: float, session=None, styles=STYLES, **options) -> tuple[Live, list]:
    """Runs with the events of `script` posted before their frame; gives the run and every command that was stepped."""
    session, clock, commands = session or fake_session(), Clock(), []
    live = Live(session, styles, screen, clock=clock, **options)
    step, plain_step = live.step, session.step

    def step_with_events() -> None:
        for event in script.get(live.frames, []):
            pygame.event.post(event)
        step()

    def spy(command):
        commands.append(command)
        return plain_step(command)

    live.step, session.step = step_with_events, spy
    live.run(seconds, clock.sleep)
    capture.stop_recording(live)
    return live, commands


def test_a_run_on_time_misses_nothing(screen):
    clock = Clock()
    session = fake_session()
    report = run_live(session, STYLES, seconds=0.5, window=screen, clock=clock, sleep=clock.sleep)
    assert (report.frames, report.pictures, report.missed, report.files) == (30, 30, 0, ())
    assert len(session.latency.seconds["render"]) == 30
    assert clock.now == pytest.approx(100.0 + 29 * FRAME_SECONDS)


def test_slow_pictures_are_made_up_for_with_more_steps(screen):
    """At 30 pictures a second simulated time still runs at 60 frames."""
    clock = Clock([1.9 * FRAME_SECONDS] * 100)
    report = run_live(fake_session(), STYLES, seconds=1.0, window=clock.on(screen), clock=clock, sleep=clock.sleep)
    assert report.frames == 60 and report.missed == 0 and 30 <= report.pictures <= 34
    assert clock.now - 100 == pytest.approx(1.0, abs=5 * FRAME_SECONDS)


def test_a_long_stop_is_counted_and_not_raced_after(screen):
    stop = 30
    clock = Clock([0, 0, (stop + 0.5) * FRAME_SECONDS])
    report = run_live(fake_session(), STYLES, seconds=0.5, window=clock.on(screen), clock=clock, sleep=clock.sleep)
    assert report.missed == stop - MAX_CATCH_UP and report.frames == 30
    assert report.pictures == 30 - (MAX_CATCH_UP - 1)


def test_keys_steer_pick_style_and_leave(screen):
    script = {
        2: [key("w"), key("left shift")],
        10: [key("4"), key("]"), key("-"), key("-")],
        20: [key("n")],
        30: [key("escape")],
    }
    live, commands = play(screen, script, seconds=5)
    assert live.leaving and live.frames < 40 and live.view.twin == "beside"
    assert commands[0].move == (0, 0)
    assert np.hypot(*commands[15].move) == pytest.approx(1) and commands[15].gait == "run"
    away = live.view.camera.forward[[0, 2]]
    np.testing.assert_allclose(commands[15].move, away / np.linalg.norm(away), atol=0.02)
    assert commands[5].style == {} and commands[-1].style == {"left_arm": ("bent", 0.8)}


def test_closing_the_window_leaves(screen):
    live, _ = play(screen, {3: [pygame.event.Event(pygame.QUIT)]}, seconds=5)
    assert live.leaving and live.frames < 10


def test_a_recording_holds_the_commands_that_were_stepped(screen):
    script = {5: [key("r")], 10: [key("d")], 20: [key("1"), key("]")], 25: [key("i")], 30: [key("w")], 40: [key("r")]}
    live, commands = play(screen, script, seconds=1)
    (path,) = live.files
    assert path.parent == Path.cwd() and path.suffix == ".jsonl" and live.recorder is None
    recorded = list(recording.read(path))
    start = next(i for i in range(len(commands)) if commands[i : i + len(recorded)] == recorded)
    assert len(recorded) == 35 and start in (5, 6)
    assert recorded[-1].style == {"left_leg": ("bent", 1.0)} and recorded[0].pace and not recorded[-1].pace
    assert '"pace": true' in path.read_text().splitlines()[0], "the header says who sets the pace"


def test_a_recording_ends_when_the_window_is_closed(screen):
    pygame.event.post(key("r"))
    clock = Clock()
    report = run_live(fake_session(), STYLES, seconds=0.2, window=screen, clock=clock, sleep=clock.sleep)
    assert len(recording.read(report.files[0])) == 11


def test_a_recording_that_cannot_be_written_is_said_on_screen(screen):
    def refuse(path, stylizer, pace, ground, seed):
        raise PermissionError(13, "Permission denied", str(path))

    live, _ = play(screen, {3: [key("r")]}, seconds=0.2, recorder_factory=refuse)
    assert live.frames == 12 and live.files == [] and live.recorder is None
    assert any("Permission denied" in text for _, text, _ in live.toasts)


def test_a_style_that_the_bank_refuses_is_said_and_taken_back(screen):
    live, commands = play(screen, {3: [key("]")], 6: [key("w")]}, seconds=0.3, styles=("gone",))
    assert any("unknown style 'gone'" in text for _, text, _ in live.toasts)
    assert live.choice.style == {} and commands[-1].style == {} and live.frames == 18


def test_a_screenshot_is_the_picture_with_its_text(screen):
    live, _ = play(screen, {4: [key("f12")]}, seconds=0.2)
    (path,) = live.files
    saved = pygame.surfarray.array3d(pygame.image.load(str(path))).swapaxes(0, 1)
    assert saved.shape == (*SIZE[::-1], 3) and saved.std() > 10


def test_hints_go_as_they_are_followed(screen):
    live, _ = play(screen, {}, seconds=0.05)
    first = live.hints.text
    live.do("style_next")
    assert live.hints.text == first and "W A S D" in first, "in their order"
    for action in ("forward", "pick_spine", "style_next", "stronger", "compare", "jump", "help"):
        live.do(action)
    assert live.hints.text is None


def test_resizing_reaches_the_renderer(screen):
    live, _ = play(screen, {}, seconds=0.05)

    def follow_size() -> bool:
        screen.size = (160, 90)
        return True

    screen.follow_size = follow_size
    live.do("resized")
    live.draw()
    assert live.renderer.size == (160, 90)


def texts(panel) -> str:
    (flow,) = panel.widgets
    return " ".join(cell.text for cell in flow.cells)


def test_the_status_line_names_stylizer_ground_and_times_or_slow_motion():
    figures = panels.Figures(0.25)
    for now in np.arange(0, 1, 0.125):
        figures.tick(now, 5.0, 12.0)
    text = texts(panels.status("joints", figures, "", True, "maps/moon.png", False, True, None))
    times = "computing 5.0 ms", "drawing 12.0 ms, simplified", "8 pictures/s"
    for part in ("stylizer: joints", *times, "ground: moon.png", "crouching: J"):
        assert part in text
    slow = texts(
        panels.status("joints", figures, "slow motion: drawing takes 100 ms", True, "flat", False, False, None)
    )
    assert "slow motion: drawing takes 100 ms" in slow and "pictures/s" not in slow


class Chance(Bender):
    """A stylizer that draws styles by chance, with other styles than the first."""

    styles = ("bent", "drawn")

    def __init__(self) -> None:
        super().__init__()
        self.draws = 0

    def resample(self) -> None:
        self.draws += 1


def test_another_stylizer_is_worn_where_it_has_the_style_and_chance_is_drawn_anew(screen, monkeypatch):
    session, other = fake_session(), Chance()

    def change(self) -> str:
        session.stylizer = other
        return "other"

    monkeypatch.setattr("demo.state.stylizers.Stylizers.next", change)
    script = {5: [key("1"), key("]")], 10: [key("y")], 15: [key("u")]}
    live, _ = play(screen, script, 0.5, session)
    assert session.stylizer is other and other.draws == 1
    assert live.choice.styles == other.styles and "left_leg" in live.choice.style
    assert any("stylizer: other" in text for _, text, _ in live.toasts)


@pytest.mark.parametrize("own_of", ["this one", "another", None])
def test_a_stylizer_for_another_controller_is_not_taken(monkeypatch, own_of):
    session = fake_session()
    session.controller.fingerprint = "this one"
    other = SimpleNamespace(name="other", own_of=own_of, transfer_state=lambda before: None)
    monkeypatch.setattr("stylizer.systems.weight_files.names", lambda: ("joints", "other"))
    monkeypatch.setattr("stylizer.runtime.catalogue.from_pretrained", lambda name: other)
    stylizers, before = Stylizers(session), session.stylizer
    if own_of == "another":
        with pytest.raises(ValueError, match="captured from another controller"):
            stylizers.next()
        assert session.stylizer is before
    else:
        assert stylizers.next() == "other" and session.stylizer is other


def test_a_recording_keeps_its_stylizer(screen, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("demo.state.stylizers.Stylizers.next", lambda self: pytest.fail("changed while recording"))
    live, _ = play(screen, {2: [key("r")], 6: [key("y")], 8: [key("u")]}, 0.3)
    assert any("stop it first" in text for _, text, _ in live.toasts)


def test_each_ground_in_turn_is_stood_on_from_the_start_point(screen):
    session = fake_session()
    script = {0: [key("w")], 20: [key("f2")], 40: [key("f2")], 50: [key("f2")], 55: [key("f2")]}
    seen, walk = [], session.step

    def step(command):
        frame = walk(command)
        seen.append((session.ground, frame.styled.root_position))
        return frame

    session.step = step
    live, _ = play(screen, script, 1.0, session)
    grounds = [ground for place, (ground, _) in enumerate(seen) if place == 0 or ground is not seen[place - 1][0]]
    assert grounds == [None, *map(load_ground, ("hills", "stairs", "rough")), None]
    starts = [place for place in range(1, len(seen)) if seen[place][0] is not seen[place - 1][0]]
    assert np.hypot(*seen[starts[0] - 1][1][::2]) > 0.15
    assert all(np.abs(seen[start][1]).max() < 0.05 for start in starts)
    assert live.view.ground is None and live.grounds.other is None
    assert any("ground: stairs" in text for _, text, _ in live.toasts)


def test_the_attract_mode_starts_over_on_uneven_ground(screen):
    """A recording that goes round a hill would not find it where it ended."""
    places = {}
    for ground in ("flat", "rough"):
        session = fake_session()
        walk, seen = session.step, []

        def step(command, walk=walk, seen=seen):
            frame = walk(command)
            seen.append(frame.styled.root_position)
            return frame

        session.step = step
        play(screen, {}, 0.7, session, attract=[Command((0.0, 1.0))] * 20, ground=ground)
        places[ground] = np.array(seen)
    np.testing.assert_allclose(places["rough"][20:40], places["rough"][:20])
    assert places["flat"][20:40, 2].min() > places["flat"][:20, 2].max()


def test_there_may_be_no_other_stylizer(screen, monkeypatch):
    monkeypatch.setattr("stylizer.systems.weight_files.names", lambda: ("joints",))
    live, _ = play(screen, {2: [key("y")], 4: [key("u")]}, 0.2)
    texts = [text for _, text, _ in live.toasts]
    assert any("no other stylizer" in text for text in texts)
    assert any("samples no styles" in text for text in texts)


def test_a_run_goes_on_where_the_bank_refuses_the_first_frame(screen):
    live, _ = play(screen, {}, 0.1, attract=[Command(style={"spine": "gone"})])
    assert live.frames == 6 and live.frame is not None and "gone" in live.toasts[0][1]


def test_what_is_said_at_the_start_stays_however_long_the_first_picture_takes(screen):
    clock = Clock([600.0])
    live = Live(fake_session(), STYLES, clock.on(screen), clock=clock)
    live.say("a file of yours is left out")
    live.run(0.5, clock.sleep)
    assert live.toasts[0][1] == "a file of yours is left out"


def test_recorded_time_is_the_world_s_however_slow_the_pictures_are(screen):
    """At three pictures a second the world makes 4 frames to each, and so many are recorded."""
    clock, session = Clock([0.33] * 100), fake_session()
    live, walk, frames = Live(session, STYLES, clock.on(screen), clock=clock), session.step, []

    def step(command):
        frame = walk(command)
        if live.recorder:
            frames.append(frame)
        return frame

    session.step = step
    live.do("record")
    for event in (key("w"), key("d")):
        pygame.event.post(event)
        live.run((live.frames + 40) / 60, clock.sleep)
    live.do("record")
    recorded = list(recording.read(live.files[0]))
    assert len(recorded) == len(frames) == 80 and clock.now - 100 > 5, "in more than five seconds"
    again = fake_session()
    for command, frame in zip(recorded, frames, strict=True):
        np.testing.assert_array_equal(frame.styled.positions, again.step(command).styled.positions)


def test_slow_pictures_are_made_simpler_and_slow_motion_is_said(screen):
    clock = Clock([0.05] * 40 + [0.1] * 200)
    live = Live(fake_session(), STYLES, clock.on(screen), clock=clock)
    best = live.renderer._quality
    live.run(1.0, clock.sleep)
    assert live.renderer._quality != best and not live.load.slow, "before the world is slow"
    live.playing = None
    live.run(8.0, clock.sleep)
    assert live.load.level == len(QUALITIES) - 1 and live.missed > 0
    live.window.size = (1280, 720)  # where there is room for the line
    overlay.look(live, clock())
    shown = [
        cell.text for panel in live.view.panels for widget in panel.widgets for cell in getattr(widget, "cells", ())
    ]
    assert any(text.startswith("slow motion: ") for text in shown)
