"""A visitor: the window's actions without a window, told to the page, recorded and replayed."""

import json

import numpy as np
import pytest

from demo.serve.options import DROP
from demo.serve.visitor import Visitor
from sim.command import Command
from sim.io import recording
from tests.support import fakes
from tests.support.fakes import BENDS
from tests.support.skinned import write

ATTRACT = (Command(move=(0, 1)), Command(move=(0, 1), style={"spine": "bent"}))


class Bender(fakes.Bender):
    styles = tuple(BENDS)

    def movements(self, style):
        return ("walk",)


@pytest.fixture
def visitor(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path))
    session = fakes.fake_session()
    session.stylizer = Bender()
    made = Visitor(session, "flat", ATTRACT, lambda: tmp_path)
    made.said = lambda kind: [json.loads(text)[kind] for text in made.told() if kind in json.loads(text)]
    return made


def steps(visitor, count):
    frames = []
    for _ in range(count):
        visitor.step()
        frames.append(visitor.frame)
    return frames


def test_it_plays_by_itself_until_somebody_steers(visitor):
    first = [frame.command for frame in steps(visitor, 5)]
    assert first == [ATTRACT[i % 2] for i in range(5)]
    visitor.take({"n": 1, "held": [], "yaw": 1.0})
    assert visitor.playing is not None, "a page that opens holds nothing"
    visitor.take({"n": 2, "held": ["forward"], "yaw": 0.0})
    assert steps(visitor, 1)[0].command.move == (0, 1) and visitor.playing is None


def test_attention_is_told_of_the_picked_part_ten_times_a_second(visitor):
    asked = []

    def attention(window, part, one=0):
        asked.append((part, one))
        return np.array([[0.25, 0.75, 0.0], [0.5, 0.5, 0.0]])

    visitor.session.stylizer.attention = attention
    visitor.take({"do": "pick_left_arm"})
    visitor.take({"do": "attention"})
    told = []
    for _ in range(12):
        visitor.step()
        told += visitor.said("attention")
    assert told[0] == {"part": "left_arm", "styles": [], "columns": 3, "map": "55ff00aaaa00"}
    assert asked == [("left_arm", 0)] * 3, "in frames 1, 6 and 12, and not at every message"
    visitor.session.stylizer.attention = lambda *_: (_ for _ in ()).throw(ValueError("none here"))
    steps(visitor, 6)
    assert visitor.said("attention")[0]["why"] == "none here"


def test_the_user_s_own_styles_are_renamed_and_others_are_not(visitor):
    renamed = []
    visitor.session.stylizer.rename = lambda style, new: renamed.append((style, new))
    visitor.choice.offer((*visitor.choice.styles, "limp"), users_own=("limp",))
    for action in ("choose:bent", "rename:crooked", "choose:limp", "rename:hobble"):
        visitor.take({"do": action})
    assert renamed == [("limp", "hobble")] and visitor.choice.style["spine"].name == "hobble"
    said = [text["say"] for text in map(json.loads, visitor.told()) if "say" in text]
    assert any("those that come with Patchwalk stay" in each for each in said)


def test_actions_change_what_is_asked_of_the_parts(visitor):
    for action in ("pick_arms", "choose:flapping", "strength:0.5", "pick:spine", "choose:bent"):
        visitor.take({"do": action})
    assert steps(visitor, 1)[0].command.style == {"arms": ("flapping", 0.75), "spine": "bent"}
    state = visitor.said("state")[-1]
    assert state["style"]["left_arm"] == ["flapping", 0.75] and state["picked"] == "spine"
    assert visitor.said("state") == [], "what has not changed is not told again"


@pytest.mark.parametrize("action", ["choose:nobody", "pick:tail", "preset:one", "strength:much", "pick_"])
def test_a_wrong_action_is_a_sentence(visitor, action):
    visitor.take({"do": action})
    assert len(visitor.said("say")) == 1 and not visitor.choice.style


@pytest.mark.parametrize(
    "action", ["quit", "leave", "menu", "full_screen", "text:x", "diagram:0.5,0.5", "__init__", ""]
)
def test_what_belongs_to_a_window_does_nothing(visitor, action):
    visitor.take({"do": action})
    assert visitor.said("say") == [] and visitor.playing is not None


def test_a_recording_replays_to_the_same_poses_here_and_from_its_file(visitor):
    visitor.take({"do": "choose:bent"})
    steps(visitor, 10)
    visitor.take({"do": "record"})
    visitor.take({"n": 1, "held": ["forward"], "yaw": 0.3})
    made = steps(visitor, 30)
    visitor.take({"do": "choose:flapping"})
    visitor.take({"n": 2, "held": ["left", "run"], "yaw": 0.4})
    made += steps(visitor, 30)
    visitor.take({"do": "record"})
    (name,) = visitor.said("file")
    replayed = fakes.fake_session()
    from_file = [replayed.step(command) for command in recording.read(visitor.folder / name)]
    visitor.take({"do": "replay"})
    again = steps(visitor, 60)
    for frames in (from_file, again):
        assert len(frames) == 60
        for a, b in zip(made, frames, strict=True):
            assert np.array_equal(a.styled.positions, b.styled.positions)
    steps(visitor, 1)
    assert visitor.playing is None and "over" in visitor.said("say")[-1]
    assert visitor.choice.style == {"all": "flapping"}, "and it is steered on in what it wore"


def test_a_page_that_goes_ends_its_recording_and_takes_what_it_dropped(visitor, tmp_path):
    drop = tmp_path / f"{DROP}1"
    drop.mkdir()
    visitor.drop([drop / "words.txt"])
    visitor.take({"do": "record"})
    steps(visitor, 3)
    visitor.close()
    (path,) = visitor.folder.glob("*.jsonl")
    assert not drop.exists()
    assert len(recording.read(path)) == 3


def test_dropped_files_that_are_of_no_use_are_a_sentence(visitor, tmp_path):
    (tmp_path / "walk.jsonl").write_text("no recording")
    visitor.drop([tmp_path / "walk.jsonl"])
    visitor.drop([tmp_path / "words.txt"])
    said = []
    while len(said) < 2:
        said += visitor.said("say")
    assert said[0].startswith("walk.jsonl, line 1: this is no recording") and "words.txt cannot be used" in said[1]


def test_a_preset_that_is_saved_is_told_to_all(visitor):
    visitor.take({"do": "choose:bent"})
    visitor.take({"do": "save_8"})
    assert visitor.changed and visitor.presets.slots[8] == ("bent", {"all": "bent"})
    assert visitor.said("presets")[-1]["8"][0] == "bent"


def test_a_page_that_nobody_looks_at_holds_nothing(visitor):
    visitor.take({"n": 1, "held": ["forward"], "yaw": 0.0})
    visitor.take({"hidden": True})
    assert visitor.asleep and not visitor.devices.held
    visitor.take({"hidden": False})
    assert not visitor.asleep


def test_what_is_said_in_alarm_is_marked(visitor):
    visitor.say("well")
    visitor.say("oh", (1.0, 0.0, 0.0))
    assert [json.loads(text)["alert"] for text in visitor.told() if "say" in json.loads(text)] == [False, True]


def test_a_dropped_character_is_packed_for_the_page_and_seen(visitor, tmp_path):
    visitor.drop([write(tmp_path / "hero.glb")])
    steps(visitor, 1)
    alone, models = len(visitor.packet()), []
    while not models:
        steps(visitor, 1)
        visitor.told()
        models += filter(None, [visitor.model()])
    steps(visitor, 1)
    assert len(visitor.packet()) > alone and len(models[0]) > 1000
    assert visitor.said("state")[-1]["character"] == "hero"
    visitor.take({"do": "character"})
    visitor.model()
    assert len(visitor.packet()) == alone and visitor.said("state")[-1]["character"] == ""
