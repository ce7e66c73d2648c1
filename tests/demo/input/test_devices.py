"""Keys, sticks and pads become commands and style choices: the plain functions, then SDL events without a screen."""

import random

import numpy as np
import pygame
import pytest
from pygame._sdl2 import controller, sdl2

from demo.input.devices import Devices, take_events
from demo.live import actions
from demo.state import bindings, steering
from demo.state.bindings import DEFAULT
from demo.state.style_choice import MIXED, OWN, StyleChoice
from sim.body.skeleton import GROUPS, PART_NAMES
from sim.command import Command
from sim.style_spec import MAX_STRENGTH, PartSpec
from tests.support.fakes import click, key, mouse, text
from tests.support.virtual_pad import VirtualPad

# The devices and the pointer act on these.
POSE_CHANNELS = {
    "forward",
    "left",
    "back",
    "right",
    "walk",
    "run",
    "jump",
    "crouch",
    "crouch_toggle",
    "face_left",
    "face_right",
    "face",
    "face_free",
    "compare",
    "orbit",
}
DT = 1 / 60


def handle(devices: Devices, events) -> list[str]:
    """What a turn's events ask for, where nothing of it is carried out."""
    return list(devices.handle(events))


# ---- steering -----------------------------------------------------------


@pytest.mark.parametrize("angle", np.linspace(0, 2 * np.pi, 9))
def test_dead_zone_is_round_and_full_way_is_one(angle):
    x, y = np.cos(angle), np.sin(angle)
    edge = steering.DEAD_ZONE
    assert steering.dead_zone(0.99 * edge * x, 0.99 * edge * y) == (0.0, 0.0)
    assert np.hypot(*steering.dead_zone(1.01 * edge * x, 1.01 * edge * y)) < 0.02, "no jump where it ends"
    np.testing.assert_allclose(steering.dead_zone(x, y), (x, y), atol=1e-12)
    assert np.hypot(*steering.dead_zone(1.4 * x, 1.4 * y)) == pytest.approx(1)


def test_keys_make_a_stick_no_longer_than_one():
    assert steering.stick_of_keys({"forward"}) == (0.0, 1.0)
    assert steering.stick_of_keys({"left", "right"}) == (0.0, 0.0)
    assert np.hypot(*steering.stick_of_keys({"forward", "right"})) == pytest.approx(1)


@pytest.mark.parametrize("angle", np.linspace(0, 2 * np.pi, 9))
def test_a_stick_that_leaves_its_dead_zone_walks(angle):
    x, y = float(np.cos(angle)), float(np.sin(angle))
    assert steering.walking_stick((0.0, 0.0)) == (0.0, 0.0)
    for way in (1e-6, 0.1, 0.5, 1.0):
        walked = steering.walking_stick((way * x, way * y))
        np.testing.assert_allclose(np.array(walked) / np.hypot(*walked), (x, y), atol=1e-12)
        assert np.hypot(*walked) == pytest.approx(steering.SLOWEST + (1 - steering.SLOWEST) * way)


@pytest.mark.parametrize(
    "yaw, away, right", [(0.0, (0, 1), (-1, 0)), (np.pi / 2, (1, 0), (0, 1)), (np.pi, (0, -1), (1, 0))]
)
def test_stick_is_seen_from_the_camera(yaw, away, right):
    """A camera that looks along +Z has +X, the character's left, on its left."""
    np.testing.assert_allclose(steering.to_world((0.0, 1.0), yaw), away, atol=1e-12)
    np.testing.assert_allclose(steering.to_world((1.0, 0.0), yaw), right, atol=1e-12)


def test_no_rounding_makes_a_world_stick_too_long():
    for yaw in np.linspace(-7, 7, 500):
        assert np.hypot(*steering.to_world(steering.stick_of_keys({"forward", "right"}), yaw)) <= 1 + 1e-9


# ---- the choice of styles -----------------------------------------------------------


def test_each_part_wears_its_own_choice():
    choice = StyleChoice(["old", "proud"])
    choice.pick("left_arm")
    choice.cycle(1)
    choice.change_strength(-3)
    choice.pick("legs")
    choice.cycle(-1)
    assert choice.style == {"left_leg": ("proud", 1.0), "right_leg": ("proud", 1.0), "left_arm": ("old", 0.7)}
    assert list(choice.style) == [part for part in PART_NAMES if part in choice.style]


def test_cycling_goes_round_by_the_own_style():
    choice = StyleChoice(["old", "proud"])
    seen = []
    for _ in range(3):
        choice.cycle(1)
        seen.append(choice.name)
    assert seen == ["old", "proud", OWN] and choice.style == {}


def test_strength_stays_in_its_range_and_steps_by_tenths():
    choice = StyleChoice(["old"])
    choice.choose("old")
    for _ in range(20):
        choice.change_strength(1)
    assert {spec.strength for spec in choice.style.values()} == {MAX_STRENGTH}
    choice.change_strength(-2)
    assert choice.strength == 1.3
    for _ in range(20):
        choice.change_strength(-1)
    assert choice.strength == 0.0 and choice.name == "old"


def test_a_command_keeps_the_style_it_was_given():
    choice = StyleChoice(["old"])
    before = choice.style
    choice.choose("old")
    worn = choice.style
    choice.change_strength(1)
    assert before == {} and worn["spine"] == PartSpec("old", 1.0) and choice.style["spine"] == PartSpec("old", 1.1)


def test_mixed_groups_say_so_and_unknown_names_are_refused():
    choice = StyleChoice(["old", "proud"])
    choice.pick("left_arm")
    choice.choose("old")
    choice.pick("arms")
    assert choice.name == MIXED
    with pytest.raises(ValueError, match="unknown style 'odl'"):
        choice.choose("odl")
    with pytest.raises(ValueError, match="unknown body part"):
        choice.pick("tail")


def test_a_bank_without_styles_can_be_cycled():
    choice = StyleChoice([])
    choice.cycle(1)
    assert choice.style == {} and choice.name == OWN


def test_two_styles_are_blended_on_a_part():
    choice = StyleChoice(["old", "proud", "sad"])
    choice.pick("spine")
    choice.blending = True
    choice.choose("proud")
    assert choice.style == {"spine": ("proud", 1.0)}, "there was nothing to blend it into"
    choice.choose("old")
    choice.change_strength(-1)
    assert choice.style == {"spine": ("proud", 1.0, "old", 0.4)} and (choice.name, choice.other) == ("proud", "old")
    choice.blending = False
    choice.change_strength(2)
    choice.choose("sad")
    assert choice.style == {"spine": ("sad", 1.2, "old", 0.4)}
    choice.blending = True
    choice.choose(OWN)
    assert choice.style == {"spine": ("sad", 1.2)} and choice.share == 0


def test_blending_ends_with_another_part():
    choice = StyleChoice(["old", "proud"])
    choice.restore({"all": "old"})
    choice.pick("spine")
    choice.blending = True
    choice.pick("spine")
    assert choice.blending, "the very same"
    choice.pick("left_arm")
    choice.choose("proud")
    assert not choice.blending and choice.style["left_arm"] == PartSpec("proud")
    choice.blending = True
    choice.pick_next(1)
    assert not choice.blending


def test_parts_that_differ_are_mixed_and_tenths_are_added_to_each():
    choice = StyleChoice(["old", "proud"])
    choice.restore({"left_arm": ("old", 0.4, "proud", 0.2), "right_arm": ("old", 1.4, "proud", 0.2), "spine": "old"})
    choice.pick("arms")
    assert choice.strengths_differ and not choice.shares_differ and choice.strength == pytest.approx(0.9)
    choice.change_strength(2)
    assert [choice.style[part].strength for part in choice.parts] == [0.6, MAX_STRENGTH]
    choice.blending = True
    choice.change_strength(-3)
    assert [choice.style[part].share for part in choice.parts] == [0.0, 0.0]
    choice.set_strength(0.5)
    assert not choice.strengths_differ and choice.strength == 0.5 and choice.style["spine"].strength == 1.0
    choice.pick("legs")
    assert not choice.strengths_differ and choice.strength == 1.0


@pytest.mark.parametrize("everything", [False, True])
def test_a_reset_is_to_full_strength(everything):
    choice = StyleChoice(["old"])
    choice.choose("old")
    choice.set_strength(0.3)
    choice.pick("spine")
    choice.reset(everything)
    choice.choose("old")
    assert choice.strength == 1.0
    choice.pick("left_arm")
    choice.choose("old")
    assert choice.strength == (1.0 if everything else 0.3)


def test_another_style_has_the_strength_that_the_slider_shows():
    choice = StyleChoice(["old", "proud"])
    choice.restore({"all": ("old", 0.8)})
    choice.choose("proud")
    assert {spec.strength for spec in choice.style.values()} == {0.8}


def test_a_style_that_is_worn_takes_the_place_of_a_blend():
    choice = StyleChoice(["old", "proud"])
    choice.restore({"all": ("old", 0.8, "proud", 0.5)})
    choice.blending = True
    choice.pick("all")
    choice.replace_style("proud")
    assert not choice.blending and set(choice.style.values()) == {PartSpec("proud", 0.8)}


def test_a_style_of_the_user_s_is_renamed_wherever_it_is():
    choice = StyleChoice(["limp", "old"], users_own=["limp"])
    choice.restore({"left_arm": ("limp", 0.5), "spine": ("old", 1.0, "limp", 0.5)})
    choice.rename("limp", "stroll")
    assert choice.styles == ("old", "stroll") and choice.users_own == {"stroll"}
    assert choice.style == {"left_arm": ("stroll", 0.5), "spine": ("old", 1.0, "stroll", 0.5)}


def test_a_search_leaves_what_holds_its_letters():
    choice = StyleChoice(["marching", "masculine", "old"])
    choice.search = "MA"
    assert choice.shown == ("marching", "masculine")
    choice.cycle(-1)
    assert choice.name == "masculine"


def test_a_random_mix_dresses_every_part():
    choice = StyleChoice(["old", "proud"], random.Random(1))
    choice.mix()
    assert list(choice.style) == list(PART_NAMES)
    choice.reset(everything=True)
    assert choice.style == {}


# ---- the table of bindings -----------------------------------------------------------


@pytest.mark.parametrize("device", ["keys", "pad", "mouse"])
def test_no_key_or_button_does_two_things(device):
    names = [(action, name) for action, names in getattr(DEFAULT, device).items() for name in names]
    twice = {name for _, name in names if sum(name == other for _, other in names) > 1}
    assert twice <= {"left"}, "the left button orbits when it is dragged and touches when it is clicked"


def test_every_action_of_the_table_does_something():
    every = {action for device in ("keys", "pad", "mouse") for action in DEFAULT.actions(device).values()}
    picks = {action for action in every if action.startswith("pick_")}
    slots = {f"{what}_{slot}" for what in ("preset", "save") for slot in bindings.SLOTS}
    assert {action.removeprefix("pick_") for action in picks} == {*PART_NAMES, *GROUPS}
    assert every - picks - slots - POSE_CHANNELS <= set(actions.ACTIONS)


def test_every_control_is_explained_and_can_be_reached_with_a_gamepad_alone():
    rows = DEFAULT.help_rows()
    for what, *controls in rows:
        assert what and any(controls)
    assert "W A S D" in [keys.split(",")[0] for _, keys, _, _ in rows]
    assert all(pad for *_, pad in rows)


# ---- devices, with SDL's events -----------------------------------------------------------


@pytest.fixture
def devices(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
    controller.quit()  # SDL asks whether it may listen without the keyboard's focus when it starts to
    pygame.joystick.quit()
    pygame.display.quit()
    pygame.display.init()
    pygame.display.set_mode((64, 64))
    yield Devices()
    pygame.display.quit()


def command_of(devices: Devices, camera_yaw=0.0, facing=0.0, style=None) -> Command:
    return devices.command(camera_yaw, facing, style or {}, DT)


def test_keys_walk_and_run_and_stop(devices):
    handle(devices, [key("w"), key("left shift")])
    command = command_of(devices)
    assert command.move == pytest.approx((0, 1)) and command.gait == "run" and command.face is None
    handle(devices, [key("w", False), key("left shift", False)])
    assert command_of(devices).move == (0, 0) and command_of(devices).gait == "walk"


def test_keys_held_while_the_window_loses_the_keyboard_are_let_go(devices):
    handle(devices, [key("w")])
    handle(devices, [pygame.event.Event(pygame.WINDOWFOCUSLOST)])
    assert command_of(devices).move == (0, 0)


def test_facing_keys_turn_from_where_the_character_faces_and_hold_it(devices):
    handle(devices, [key("q")])
    for _ in range(30):
        face = command_of(devices, facing=0.5).face
    assert np.arctan2(*face) == pytest.approx(0.5 + steering.TURN_RATE * 0.5)
    handle(devices, [key("q", False)])
    assert command_of(devices, facing=-2.0).face == face, "it stays until it is freed"
    handle(devices, [key("f")])
    assert command_of(devices).face is None


def test_the_mouse_orbits_zooms_and_touches_the_scene(devices):
    drag = [
        mouse(pygame.MOUSEBUTTONDOWN, (5, 5), button=1),
        mouse(pygame.MOUSEMOTION, (15, 10), rel=(10, 5), buttons=(1, 0, 0)),
        mouse(pygame.MOUSEBUTTONUP, (15, 10), button=1),
    ]
    assert handle(devices, drag) == ["wake"], "a drag is no click"
    orbit, lift = devices.take_camera()
    assert orbit < 0 < lift and devices.take_camera() == (0, 0)
    assert handle(devices, click((7, 9))) == ["wake", "touch:7,9"]
    assert handle(devices, [pygame.event.Event(pygame.MOUSEWHEEL, y=2, x=0)]) == ["wake", "zoom_in", "zoom_in"]


def test_modifiers_make_other_keys_but_shift_still_runs(devices):
    ctrl, shift = pygame.KMOD_LCTRL, pygame.KMOD_LSHIFT
    assert handle(devices, [key("1", mod=ctrl)])[1:] == ["preset_1"]
    assert handle(devices, [key("1", mod=ctrl | shift)])[1:] == ["save_1"]
    assert handle(devices, [key("1", mod=shift)])[1:] == ["pick_left_leg"]
    assert handle(devices, [key("backspace", mod=shift)])[1:] == ["reset"]
    handle(devices, [key("w", mod=shift)])
    assert command_of(devices).move == pytest.approx((0, 1))


def test_while_typing_letters_are_text(devices):
    devices.mode = "typing"
    assert handle(devices, [key("w"), text("w"), key("return")]) == ["wake", "text:w", "wake", "typed"]
    assert command_of(devices).move == (0, 0)


def test_a_word_typed_within_a_turn_is_text_and_no_shortcut(devices):
    """SDL reports letters beside the keys only where the search was open before the turn began."""
    typed, letters = [], "/giant"
    keys = [pygame.event.Event(pygame.KEYDOWN, key=ord(letter), mod=0, unicode=letter) for letter in letters]
    after = [key("return"), key("g"), key("/")]
    for action in devices.handle([*keys, *after, text("x")]):
        typed.append(action)
        if action in ("search", "typed"):
            devices.mode = "typing" if action == "search" else ""
    assert [each for each in typed if each != "wake"] == [
        "search",
        *(f"text:{letter}" for letter in "giant"),
        "typed",
        "times",
        "search",
        "text:x",
    ]


def test_the_letter_of_the_key_that_opens_the_search_is_not_typed(devices):
    devices.mode, seen = "typing", []
    for action in devices.handle([key("return"), key("/"), text("/"), key("g"), text("g")]):
        seen.append(action)
        devices.mode = {"typed": "", "search": "typing"}.get(action, devices.mode)
    assert [each for each in seen if each != "wake"] == ["typed", "search", "text:g"]


def test_a_key_that_is_let_go_within_its_turn_counts_for_that_turn(devices):
    handle(devices, [key("w"), key("left shift"), key("left shift", False), key("w", False)])
    for _ in range(3):  # frames of the turn
        command = command_of(devices)
        assert command.move != (0, 0) and command.gait == "run"
    handle(devices, [])
    command = command_of(devices)
    assert command.move == (0, 0) and command.gait == "walk"


def test_the_menu_takes_the_arrows_and_leaves_the_letters(devices):
    devices.mode = "menu"
    assert handle(devices, [key("down"), key("return"), key("w")]) == [
        "wake",
        "menu_down",
        "wake",
        "menu_do",
        "wake",
        "forward",
    ]


def test_the_command_carries_the_style(devices):
    style = {"spine": ("old", 0.5)}
    assert command_of(devices, style=style).style == style


def test_a_gamepad_comes_steers_and_goes(devices):
    assert devices.pad_name is None
    pad = VirtualPad()
    assert "pad_added" in handle(devices, pygame.event.get()) and devices.pad_name
    pad.move(pygame.CONTROLLER_AXIS_LEFTX, 1.0)
    pad.move(pygame.CONTROLLER_AXIS_RIGHTY, -1.0)
    pad.move(pygame.CONTROLLER_AXIS_TRIGGERRIGHT, 1.0)
    pad.move(pygame.CONTROLLER_AXIS_TRIGGERLEFT, 1.0)
    assert "stick" in handle(devices, pygame.event.get())
    command = command_of(devices, camera_yaw=np.pi)
    assert command.move == pytest.approx((1, 0), abs=1e-3) and command.gait == "run"
    assert command.face == pytest.approx((0, -1), abs=1e-3), "held, it faces away from the camera"
    assert devices.take_camera() == (0, 0)
    pad.press(pygame.CONTROLLER_BUTTON_DPAD_UP)
    assert handle(devices, pygame.event.get()) == ["wake", "zoom_in"]
    pad.move(pygame.CONTROLLER_AXIS_TRIGGERLEFT, -1.0)
    assert command_of(devices).face is None and devices.take_camera() != (0, 0), "without it, it orbits"
    pad.press(pygame.CONTROLLER_BUTTON_DPAD_RIGHT)
    assert handle(devices, pygame.event.get()) == ["wake", "style_next"]

    pad.pull()
    assert command_of(devices).move == (0, 0), "even before SDL's event is read"
    assert "pad_removed" in handle(devices, pygame.event.get()) and devices.pad_name is None
    handle(devices, [key("w")])
    assert command_of(devices).move == pytest.approx((0, 1))


def test_of_two_gamepads_the_one_used_last_steers(devices):
    first, second = VirtualPad(), VirtualPad()
    handle(devices, pygame.event.get())
    for pad, x in ((first, 1.0), (second, -1.0), (first, 0.9)):
        pad.move(pygame.CONTROLLER_AXIS_LEFTX, x)
        handle(devices, pygame.event.get())
        assert np.sign(command_of(devices, camera_yaw=np.pi).move[0]) == np.sign(x)
    first.pull()
    handle(devices, pygame.event.get())
    assert command_of(devices, camera_yaw=np.pi).move == pytest.approx((-1, 0), abs=1e-3), "the other one takes over"
    second.pull()
    handle(devices, pygame.event.get())


def test_a_trigger_counts_as_it_was_when_the_button_was_pressed(devices):
    pad = VirtualPad()
    handle(devices, pygame.event.get())
    for pulled in (1.0, -1.0):
        pad.move(pygame.CONTROLLER_AXIS_TRIGGERLEFT, pulled)
        pad.press(pygame.CONTROLLER_BUTTON_A)
    actions = [action for action in handle(devices, pygame.event.get()) if action not in ("wake", "stick")]
    assert actions == ["own_style", "jump"]


def test_a_pad_that_is_there_from_the_start_counts_once(devices):
    pad = VirtualPad()
    again = Devices()
    assert again.pad_name
    assert handle(again, pygame.event.get()) == [], "its event of being added tells nothing new"
    pad.pull()
    again.handle(pygame.event.get())


def test_a_gamepad_that_is_gone_when_it_is_opened_is_none(screen, monkeypatch):
    """SDL's own module raises its own kind of error."""

    def gone(_):
        raise sdl2.error("Invalid index")

    monkeypatch.setattr(controller, "get_count", lambda: 2)
    monkeypatch.setattr(controller, "Controller", gone)
    assert Devices().pad_name is None


def test_events_that_pygame_stumbles_over_are_none(monkeypatch):
    def stumble():
        raise SystemError("<built-in function get> returned a result with an exception set")

    monkeypatch.setattr(pygame.event, "get", stumble)
    assert take_events() == []


def test_a_pad_that_comes_as_another_goes_is_seen(screen):
    first = VirtualPad()
    devices = Devices()
    handle(devices, pygame.event.get())
    first.pull()
    second = VirtualPad()
    removed = [event for event in pygame.event.get() if event.type == pygame.CONTROLLERDEVICEREMOVED]
    assert handle(devices, removed) == ["pad_removed"] and devices.pad_name, "announced under an old index"
    second.pull()
    handle(devices, pygame.event.get())
    assert devices.pad_name is None
