"""The real window driven by events from end to end: steer, pick, search, blend, presets, looks inside, menu, attract
mode."""

import json
import random
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pygame
import pytest
from pygame._sdl2 import controller

from demo import cli
from demo.live import actions, overlay
from demo.live.live import Live
from demo.state import bindings, user_bindings
from demo.state.bindings import DEFAULT, SLOTS
from demo.state.presets import Presets, describe
from demo.ui import diagram
from sim.body.skeleton import GROUPS, PART_NAMES
from sim.command import Command
from sim.style_spec import PartSpec, StyleSpec
from tests.demo.live.test_live import Clock
from tests.support.fakes import BENDS, click, fake_session, key, mouse, offscreen, text
from tests.support.virtual_pad import VirtualPad

SIZE = (960, 540)
STYLES = tuple(BENDS)


@pytest.fixture
def window(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
    controller.quit()  # SDL asks whether it may listen without the keyboard's focus when it starts to
    pygame.joystick.quit()
    with offscreen(SIZE) as opened:
        yield opened


@pytest.fixture
def pad(window):
    plugged = VirtualPad()
    yield plugged
    plugged.pull()
    pygame.event.get()


class Player:
    """A live run, and somebody at its controls: every method posts SDL events and lets a few frames pass."""

    def __init__(self, window, **options) -> None:
        self.clock = Clock()
        self.commands, session = [], fake_session()
        step = session.step
        session.step = lambda command: (self.commands.append(command), step(command))[1]
        self.live = Live(session, STYLES, window, clock=self.clock, **options)
        self.post()

    def post(self, *events, frames: int = 2) -> None:
        for event in events:
            pygame.event.post(event)
        self.live.run((self.live.frames + frames) / 60, self.clock.sleep)

    def press(self, *names: str, mod: int = 0) -> None:
        for name in names:
            self.post(key(name, mod=mod), key(name, False))

    def region(self, action: str):
        """Where the panels show something that does an action."""
        self.live.draw()
        return next(region for region in self.live.devices.pointer.regions if region.action == action)

    def click(self, action: str, share=(0.5, 0.5), button: int = 1) -> None:
        left, top, width, height = self.region(action).box
        self.post(*click((left + share[0] * width, top + share[1] * height), button))

    @property
    def style(self):
        return self.live.choice.style


@pytest.fixture
def player(window) -> Player:
    return Player(window)


# ---- style by hand -----------------------------------------------------------


@pytest.mark.parametrize("part", PART_NAMES)
def test_a_part_is_picked_on_the_diagram(player, part):
    joint = diagram.forms.BIND.positions[
        diagram.PARENTS == np.flatnonzero(diagram.PART_OF_JOINT == PART_NAMES.index(part))[1]
    ]
    x, y = joint[0, :2]
    share = 0.5 + x / diagram.METRES * diagram.HEIGHT / diagram.WIDTH, 1 - y / diagram.METRES
    player.click("diagram", share)
    assert player.live.choice.picked == part


def test_a_part_is_picked_on_the_figure_itself(player):
    player.live.hidden = True
    player.post(frames=60)
    camera, (width, height) = player.live.view.camera, SIZE
    hand = np.append(player.live.frame.styled.positions[19], 1) @ camera.world_to_clip(width / height).T
    at = (hand[0] / hand[3] + 1) / 2 * width, (1 - hand[1] / hand[3]) / 2 * height
    player.post(*click(at))
    assert player.live.choice.picked == "right_arm"
    player.post(*click((at[0], 5)))
    assert player.live.choice.picked == "right_arm", "a click into the sky changes nothing"


def test_style_and_strength_by_mouse_alone(player):
    player.click("pick_legs")
    player.click("choose:flapping")
    assert player.style == dict.fromkeys(GROUPS["legs"], ("flapping", 1.0))
    player.click("strength", (0.2, 0.5))
    assert player.style["left_leg"][:2] == ("flapping", pytest.approx(0.3, abs=0.01))
    yaw = player.live.view.camera._wanted["yaw"]
    slider = player.region("strength").box
    middle = slider[1] + slider[3] / 2
    player.post(
        mouse(pygame.MOUSEBUTTONDOWN, (slider[0] + 1, middle), button=1),
        mouse(pygame.MOUSEMOTION, (slider[0] + slider[2] + 80, middle), rel=(90, 0), buttons=(1, 0, 0)),
        mouse(pygame.MOUSEBUTTONUP, (0, 0), button=1),
    )
    assert player.style["left_leg"] == PartSpec("flapping", 1.5), "dragged past its end"
    assert player.live.view.camera._wanted["yaw"] == yaw, "a slider is no way to turn the camera"
    player.click("own_style")
    assert player.style == {}


def test_the_wheel_over_the_list_chooses_and_over_the_scene_zooms(player):
    box = player.region("choose:bent").box
    distance = player.live.view.camera._wanted["distance"]
    player.post(mouse(pygame.MOUSEWHEEL, (box[0] + 5, box[1] + 5), y=-1, x=0))
    assert player.live.choice.name == STYLES[0] and player.live.view.camera._wanted["distance"] == distance
    player.post(mouse(pygame.MOUSEWHEEL, (SIZE[0] * 0.6, SIZE[1] / 2), y=1, x=0))
    assert player.live.view.camera._wanted["distance"] < distance


def test_searching_by_typing(player):
    player.press("/")
    player.post(text("Mar"), key("w"), text("w"), key("backspace"))
    assert player.live.choice.shown == ("marching",) and player.commands[-1].move == (0, 0)
    player.press("return")
    assert player.live.choice.name == "marching" and player.live.devices.mode == ""
    player.press("/")
    player.post(text("zzz"))
    player.click("search")
    player.press("escape")
    assert player.live.choice.search == "" and not player.live.leaving and player.live.choice.name == "marching"


def test_searching_with_the_mouse_ends_with_a_click(player):
    player.click("search")
    player.post(text("flap"))
    player.click("choose:flapping")
    assert player.live.choice.name == "flapping" and player.live.devices.mode == "" and player.live.choice.search == ""


def test_two_styles_are_blended_on_a_part(player):
    player.press("4", "]", "b", "]", "]")
    assert player.style == {"left_arm": ("bent", 1.0, "flapping", 0.5)}
    player.press("=")
    assert player.commands[-1].style == {"left_arm": ("bent", 1.0, "flapping", 0.6)}
    player.click("share", (0.25, 0.5))
    assert player.style["left_arm"].share == pytest.approx(0.25, abs=0.01)
    player.click("blend:off")
    player.click("choose:marching")
    assert player.style["left_arm"][:3] == ("marching", 1.0, "flapping")


def test_styled_legs_set_the_pace_until_the_stick_alone_does(player):
    assert player.commands[-1].pace is True
    player.press("i")
    assert player.commands[-1].pace is False and player.live.toasts[-1][1] == "the stick sets the speed"
    assert not actions.is_on(player.live, "pace")
    player.press("m", "right")
    player.click("pace")
    assert player.commands[-1].pace is True and player.live.toasts[-1][1] == "the leg style sets the speed"
    assert actions.is_on(player.live, "pace")


def test_neutral_while_a_key_or_the_button_is_held(player):
    player.press("]")
    player.post(key("return"))
    assert player.commands[-1].style == {} and player.style
    player.post(key("return", False))
    assert player.commands[-1].style == player.style
    box = player.region("compare").box
    player.post(mouse(pygame.MOUSEBUTTONDOWN, (box[0] + 3, box[1] + 3), button=1))
    assert player.commands[-1].style == {}
    player.post(mouse(pygame.MOUSEBUTTONUP, (box[0] + 3, box[1] + 3), button=1))
    assert player.commands[-1].style == player.style


def test_a_jump_is_in_one_command_for_each_press(player):
    player.post(key("space"), frames=5)
    assert sum(command.jump for command in player.commands) == 1
    player.clock.costs = [3 / 60]  # a slow picture, which the next ones make up for with more frames
    player.post(key("space", False), key("space"), frames=6)
    player.press("space", "w")
    assert sum(command.jump for command in player.commands) == 3


def test_crouching_while_held_and_until_pressed_again(player):
    player.post(key("c"), key("w"), key("left shift"))
    assert player.commands[-1].gait == "crouch", "whoever crouches does not run"
    player.post(key("c", False))
    assert player.commands[-1].gait == "run"
    player.press("j")
    assert player.commands[-1].gait == "crouch" and player.live.devices.crouching
    player.press("j")
    assert player.commands[-1].gait == "run"


def test_a_gamepad_jumps_crouches_and_goes_on_to_another_ground(player, pad):
    button = {name: getattr(pygame, f"CONTROLLER_BUTTON_{name}") for name in ("A", "B", "DPAD_LEFT")}
    player.post()
    pad.press(button["A"])
    pad.press(button["B"])
    player.post()
    assert sum(command.jump for command in player.commands) == 1
    assert player.commands[-1].gait == "crouch"
    pad.move(pygame.CONTROLLER_AXIS_TRIGGERLEFT, 1.0)
    pad.press(button["DPAD_LEFT"])
    player.post()
    assert player.live.grounds.name == "hills"


def test_random_mix_and_reset(player):
    player.live.choice._chance = random.Random(3)
    player.press("v")
    assert set(player.style) == set(PART_NAMES)
    player.press("delete")
    assert player.style == {}


# ---- presets -----------------------------------------------------------


def test_presets_are_kept_for_the_next_start(player, tmp_path):
    player.press("6", "]")
    for _ in range(2):  # there is another in it: it is asked for twice
        player.press("3", mod=pygame.KMOD_LCTRL | pygame.KMOD_LSHIFT)
    player.press("delete", "l")
    player.press("3", mod=pygame.KMOD_LCTRL)
    assert player.style == dict.fromkeys(GROUPS["legs"], ("bent", 1.0))
    kept = Presets()
    assert kept.path == tmp_path / "home" / "presets.json"
    assert kept.slots[3] == ("bent legs", dict.fromkeys(GROUPS["legs"], ("bent", 1.0)))
    assert len(kept.slots) == len(Presets(tmp_path / "none.json").slots), "the bundled ones are still there"


def test_presets_by_mouse(player):
    player.press("]")
    player.click("save_8")  # it is empty
    player.press("delete")
    player.click("preset_8")
    assert player.style == dict.fromkeys(PART_NAMES, ("bent", 1.0))
    player.press("]")
    player.click("preset_8", button=3)
    assert player.live.presets.slots[8][1]["spine"].name == "bent", "asked for once"
    player.click("preset_8", button=3)
    assert player.live.presets.slots[8][1]["spine"].name == "flapping"


def test_a_preset_whose_style_is_gone_is_said(player):
    player.press("1", mod=pygame.KMOD_LCTRL)
    assert player.style == {} and any("unknown style 'zombie'" in text for _, text, _ in player.live.toasts)


def test_a_preset_that_cannot_be_written_is_said(player, monkeypatch, tmp_path):
    (tmp_path / "home").write_text("a file where the folder should be")
    player.press("]")
    player.press("8", mod=pygame.KMOD_LCTRL | pygame.KMOD_LSHIFT)
    assert any("cannot write" in text for _, text, _ in player.live.toasts)


def test_bundled_presets_use_bundled_styles(tmp_path):
    from stylizer.styles.bank import BUNDLED
    from stylizer.systems import checkpoint

    styles = {path.stem for path in (BUNDLED / checkpoint.SHIPPED).glob("*.safetensors")}
    slots = Presets(tmp_path / "none.json").slots
    assert set(slots) <= set(SLOTS) and len(slots) >= 6
    assert {name for _, style in slots.values() for name in style.names} <= styles


@pytest.mark.parametrize(
    "content, said",
    [
        ("[", "not a JSON file"),
        ("{}", "holds no presets"),
        (json.dumps({"format": "patchwalk-presets", "slots": {"9": {}}}), "slot 9"),
        (
            json.dumps({"format": "patchwalk-presets", "slots": {"1": {"name": "a", "style": {"tail": None}}}}),
            "slot 1: unknown body",
        ),
    ],
)
def test_of_a_bad_presets_file_the_rest_is_there_and_nothing_is_lost(tmp_path, content, said):
    path = tmp_path / "presets.json"
    path.write_text(content)
    with pytest.warns(UserWarning, match="presets.json") as caught:
        presets = Presets(path)
    (warning,) = caught
    assert said in str(warning.message) and "\n" not in str(warning.message) and "mend it" in str(warning.message)
    assert path.read_text() == content
    presets.save(8, StyleSpec({"spine": "old"}))
    assert Presets(path).slots == presets.slots and presets.slots[8][0] == "old spine"
    assert (tmp_path / "presets-1.json").read_text() == content
    presets.save(8, StyleSpec())
    assert not (tmp_path / "presets-2.json").exists(), "there is nothing else to keep"


def test_presets_that_cannot_be_opened_are_the_bundled_ones(tmp_path):
    (tmp_path / "presets.json").mkdir()
    with pytest.warns(UserWarning, match="presets.json: Is a directory; mend it"):
        assert Presets(tmp_path / "presets.json").slots == Presets(tmp_path / "none.json").slots


def test_a_slot_with_a_mistake_takes_no_other_with_it(tmp_path):
    good, bad = {"name": "a", "style": {"legs": ["old", 1.0]}}, {"name": "b", "style": {"tail": None}}
    path = tmp_path / "presets.json"
    path.write_text(json.dumps({"format": "patchwalk-presets", "slots": {"1": bad, "2": good}}))
    with pytest.warns(UserWarning, match="slot 1: unknown body part"):
        assert list(Presets(path).slots) == [2]


def test_names_of_what_is_worn():
    legs, arms = (dict.fromkeys(GROUPS[group], ("old", 1.0)) for group in ("legs", "arms"))
    assert describe(StyleSpec()) == "no style"
    many = {part: (f"{'x' * 12}{number}", 1.0) for number, part in enumerate(PART_NAMES)}
    assert describe(StyleSpec(many)) == "xxxxxxxxxxxx0 and 4 more"
    few = {part: ("tired" if "leg" in part else "not-confident", 1.0) for part in ("left_leg", "spine", "right_arm")}
    assert describe(StyleSpec(few)) == "tired, not-confident"
    assert describe(StyleSpec({**legs, "spine": ("sad", 1.0, "old", 0.5)})) == "old legs, sad and old spine"
    assert describe(StyleSpec({**legs, **arms, "spine": ("old", 0.5)})) == "old"
    assert describe(StyleSpec({"left_arm": "old"})) == "old left arm"


# ---- see inside, menu, window -----------------------------------------------------------


@pytest.mark.parametrize(
    "name, pressed",
    [("skeleton", "k"), ("onion", "o"), ("phase", "p"), ("times", "g"), ("attention", "h"), ("contacts", ",")],
)
def test_each_look_inside_changes_the_picture_and_goes_again(player, name, pressed):
    player.post(key("w"), frames=50)
    player.post(key("w", False), frames=1)
    live = player.live

    def picture():
        overlay.look(live, player.clock())
        live.paint()
        return live.window.read_pixels().astype(int)

    before = picture()
    player.live.do(DEFAULT.actions("keys")[pressed])
    assert (name in live.seen) != (name == "contacts")
    assert np.abs(picture() - before).max() > 40
    player.live.do(name)
    assert np.abs(picture() - before).max() < 10


def test_the_twin_stands_beside_then_about_then_not(player):
    seen = []
    for _ in range(3):
        player.press("n")
        seen.append(player.live.view.twin)
    assert seen == ["beside", "ghost", ""]


def test_the_menu_does_everything_with_arrows_and_with_a_click(player):
    player.press("m", "down", "return")
    assert "skeleton" in player.live.seen and player.commands[-1].move == (0, 0)
    player.click("trajectory")
    assert "trajectory" in player.live.seen
    player.press("right", "right", "up")
    assert player.live.menu.page == "presets" and player.live.menu.row == 7
    player.press("escape")
    assert not player.live.menu.open and not player.live.leaving


def test_a_gamepad_alone_reaches_the_menu_and_saves_a_preset(player, pad):
    button = {
        name: getattr(pygame, f"CONTROLLER_BUTTON_{name}") for name in ("START", "X", "A", "B", "DPAD_RIGHT", "DPAD_UP")
    }

    def press(*names: str) -> None:
        for name in names:
            pad.press(button[name])
            player.post()

    player.post()
    press("DPAD_RIGHT", "START", "DPAD_RIGHT", "DPAD_RIGHT", "DPAD_UP", "X")
    assert Presets().slots[8][0] == "bent"
    press("B")
    assert not player.live.menu.open


def test_every_row_of_the_menu_is_an_action(player):
    for page in bindings.MENU_PAGES:
        player.live.menu.turn_to(page)
        rows = player.live.menu.rows(player.live.presets.slots)
        desired = {row.action for row in rows}
        if page == "presets":
            assert desired == {f"preset_{slot}" for slot in SLOTS} and "preset" in actions.ACTIONS
        else:
            assert len(desired) == len(rows) > 0 and desired <= set(actions.ACTIONS)


def test_panels_can_be_hidden_and_the_mouse_brings_them_back(player):
    player.click("panels")
    assert not any(region.action == "diagram" for region in player.live.devices.pointer.regions)
    player.click("panels")
    player.region("diagram")


def test_help_closes_before_the_window_does(player):
    player.press("f1", "escape")
    assert not player.live.helping and not player.live.leaving
    player.press("escape")
    assert player.live.leaving


# ---- the first minute -----------------------------------------------------------


@pytest.mark.parametrize(
    "event", [lambda: key("w"), lambda: mouse(pygame.MOUSEBUTTONDOWN, (500, 300), button=1)], ids=["key", "mouse"]
)
def test_it_plays_by_itself_until_somebody_touches_a_control(window, event):
    recorded = [Command((1.0, 0.0), style={"spine": ("bent", 1.0)})] * 10
    player = Player(window, attract=recorded)
    player.post(frames=24)
    assert player.commands == recorded * 2 + recorded[: len(player.commands) - 20], "over and over, at its own pace"
    assert not player.live.devices.pointer.regions or all(
        not region.action for region in player.live.devices.pointer.regions
    )
    player.post(mouse(pygame.MOUSEMOTION, (400, 300), rel=(1, 1), buttons=(0, 0, 0)))
    assert player.live.playing is not None, "a mouse that is only moved takes nothing over"
    player.post(event())
    assert player.live.playing is None and player.commands[-1].style == {} and player.commands[-1].pace
    player.region("diagram")


def test_a_stick_ends_the_attract_mode(window, pad):
    player = Player(window, attract=[Command()])
    pad.move(pygame.CONTROLLER_AXIS_LEFTX, 1.0)
    player.post()
    assert player.live.playing is None and np.hypot(*player.commands[-1].move) == pytest.approx(1, abs=1e-3)


# ---- the user's own bindings -----------------------------------------------------------


def test_keys_of_the_users_own(window, tmp_path):
    file = tmp_path / "keys.toml"
    file.write_text(
        '[keys]\ntwin = ["q", "ctrl+t"]\n[mouse]\norbit = ["right"]\nrandom = ["middle"]\n[gamepad]\ntwin = ["x"]\n'
    )
    with pytest.warns(UserWarning, match=r"\[mouse\] random: there is no such action"):
        assert user_bindings.load(file).pad["twin"] == ("x",), "the rest counts"
    file.write_text(file.read_text().replace('random = ["middle"]\n', ""))
    file.write_text(file.read_text().replace("[mouse]", "pick_left_leg = []\nforward = []\n[mouse]"))
    table = user_bindings.load(file)
    assert all(map(len, table.help_rows())) and table.help_rows()[0][1].startswith("A S D")
    assert table.keys["face_left"] == () and table.pad["pick_all"] == () and table.pad["twin"] == ("x",)
    player = Player(window, bindings=table)
    player.press("q")
    assert player.live.view.twin == "beside"
    player.press("n")
    assert player.live.view.twin == "beside"
    player.press("t", mod=pygame.KMOD_LCTRL)
    assert player.live.view.twin == "ghost" and "trajectory" not in player.live.seen


def test_the_template_is_what_it_says(tmp_path):
    file = tmp_path / "keys.toml"
    assert user_bindings.load(file) == DEFAULT, "no file, no change"
    file.write_text(user_bindings.template(), encoding="utf-8")
    assert user_bindings.load(file) == DEFAULT


@pytest.mark.parametrize(
    "content, said",
    [
        ("[keys\n", "line 1"),
        ("[kyes]\n", "unknown section 'kyes'"),
        ("keys = 3\n", "unknown section 'keys'"),
        ("[keys]\ntwn = ['n']\n", "[keys] twn: there is no such action; did you mean 'twin'?"),
        ("[keys]\ntwin = 'n'\n", "[keys] twin: give a list"),
        ("[keys]\ntwin = ['nn']\n", "there is no key 'nn'"),
        ("[gamepad]\ntwin = ['z']\n", "[gamepad] twin: there is no 'z'"),
        ("[keys]\ntwin = ['n']\nskeleton = ['n']\n", "'n' is given to twin already"),
    ],
)
def test_a_bad_file_of_bindings_is_one_sentence(tmp_path, content, said):
    file = tmp_path / "keys.toml"
    file.write_text(content)
    with pytest.warns(UserWarning, match="keys.toml") as caught:
        bindings = user_bindings.load(file)
    (warning,) = caught
    assert said in str(warning.message) and "\n" not in str(warning.message)
    assert bindings == DEFAULT


def test_the_command_writes_the_file_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path))
    assert cli.main(["keys", "--write"]) == 0 and user_bindings.load(tmp_path / "keys.toml") == DEFAULT
    assert cli.main(["keys", "--write"]) == 2 and "is there already" in capsys.readouterr().err


@pytest.mark.parametrize("name, content", [("keys.toml", "[keys]\ntwn = []\n"), ("presets.json", "[]")])
def test_a_mistake_in_the_users_files_stops_nothing_and_is_said(tmp_path, monkeypatch, capsys, name, content):
    shown = []

    def run_live(*_, notes, **__):
        shown.extend(notes)
        return SimpleNamespace(files=[])

    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path))
    monkeypatch.setenv("SDL_VIDEODRIVER", "offscreen")
    monkeypatch.setattr("demo.live.live.run_live", run_live)
    monkeypatch.setattr("demo.assemble.build_session", lambda *_: fake_session())
    (tmp_path / name).write_text(content)
    assert cli.main([]) == 0
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and name in error and len(shown) == 1 and name in shown[0]


def test_readme_shows_the_keys_that_there_are():
    readme = (Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8")
    for row in DEFAULT.help_rows():
        assert "| " + " | ".join(row) + " |" in readme, f"README's Keys: write {row}"
