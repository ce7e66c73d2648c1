"""What each action does to a live run: the table behind keys, mouse, gamepad and menu.

An action may carry an argument after a colon, such as `choose:old` or `strength:0.6`."""

from typing import TYPE_CHECKING, Callable

import numpy as np

from demo.live import capture, users_styles
from demo.live.confirm import confirmed
from demo.render.view import TWINS
from demo.ui import diagram, help
from demo.ui.canvas import ALERT
from sim.style_spec import MAX_STRENGTH

if TYPE_CHECKING:
    from demo.live.live import Live

Action = Callable[["Live", str], None]
TOUCH_REACH = 0.13  # metres from the figure's bones within which a click on the scene means a part


def do(live: "Live", action: str) -> None:
    """Carries out an action; one that is only held, such as walking, needs nothing here."""
    name, argument = parse(action)
    if name in ACTIONS:
        ACTIONS[name](live, argument)


def parse(action: str) -> tuple[str, str]:
    """The name in ACTIONS, and the argument: `pick_legs` is `pick:legs`, and `preset_3` is `preset:3`."""
    name, _, argument = action.partition(":")
    if name.startswith("pick_"):
        name, argument = "pick", name.removeprefix("pick_")
    for group in ("preset", "save"):
        if name.startswith(f"{group}_") and name.removeprefix(f"{group}_").isdigit():
            name, argument = group, name.removeprefix(f"{group}_")
    return name, argument


def is_on(live: "Live", action: str) -> bool | None:
    """Whether what an action turns on and off is on; None for an action of another kind."""
    return {
        "twin": bool(live.view.twin),
        "character": live.view.character is not None,
        "blend": live.choice.blending,
        "record": live.recorder is not None,
        "pace": live.pace,
        "panels": not live.hidden,
        **{name: name in live.seen for name in SEEN},
    }.get(action)


def _pick(live: "Live", part: str) -> None:
    live.choice.pick(part)
    live.glow()


def _pick_next(step: int) -> Action:
    def pick(live: "Live", _: str) -> None:
        live.choice.pick_next(step)
        live.glow()

    return pick


def _on_diagram(live: "Live", at: str) -> None:
    part = diagram.part_at(*map(float, at.split(",")))
    if part:
        _pick(live, part)


def _touch(live: "Live", at: str) -> None:
    """A click on the scene picks the part of the figure that is there."""
    if live.frame is None:
        return
    view, size = live.view, live.window.size
    places = view.pixels(live.frame.styled.positions, size)[:, :2]
    pixel = view.camera.metres_a_pixel(size) * view.camera.distance  # where the figure is
    part = diagram.nearest_part(places, np.array(at.split(","), float), TOUCH_REACH / pixel)
    if part:
        _pick(live, part)


def _blend(live: "Live", wanted: str) -> None:
    live.choice.blending = not live.choice.blending if not wanted else wanted == "on"


def _switch_pace(live: "Live", _: str) -> None:
    live.pace = not live.pace
    live.say(f"the {'leg style' if live.pace else 'stick'} sets the speed")


def _apply_preset(live: "Live", slot: str) -> None:
    number = int(slot)
    if number not in live.presets.slots:
        live.say(f"preset {slot} is empty: Ctrl + Shift + {slot} or a right click saves the current styles here")
        return
    live.preset = number
    name, style = live.presets.slots[number]
    try:
        live.choice.restore(style)
        live.say(f"preset {slot}: {name}")
    except ValueError as error:
        live.say(f"preset {slot}: {error}", ALERT)


def _next_preset(live: "Live", _: str) -> None:
    filled = sorted(live.presets.slots)
    if filled:
        _apply_preset(live, str(next((slot for slot in filled if slot > live.preset), filled[0])))


def _save_preset(live: "Live", slot: str) -> None:
    """A slot that holds another mixture is asked for twice."""
    name, style = live.presets.slots.get(int(slot), ("", live.choice.style))
    if style != live.choice.style and not confirmed(
        live, f"save {slot}", f"once more replaces preset {slot}, “{name}”, by the current styles"
    ):
        return

    def save() -> None:
        live.say(f"saved as preset {slot}: {live.presets.save(int(slot), live.choice.style)}")

    live.guard(save)


def _next_twin(live: "Live", _: str) -> None:
    live.view.twin = TWINS[(TWINS.index(live.view.twin) + 1) % len(TWINS)]


def _see(name: str) -> Action:
    def toggle(live: "Live", _: str) -> None:
        live.seen ^= {name}

    return toggle


def _choose(live: "Live", name: str) -> None:
    """A click in the list, which ends a search."""
    live.choice.choose(name)
    if live.devices.mode == "typing":
        live.type(False)


def _next_stylizer(live: "Live", _: str) -> None:
    """Another system restyles the same motion; the figure glides from one to the other."""
    if _kept_by_recording(live):
        return
    try:
        live.say(f"stylizer: {live.stylizers.next()}")
        live.offer_styles()
    except ValueError as error:
        live.say(str(error), ALERT)


def _resample(live: "Live", _: str) -> None:
    if _kept_by_recording(live):
        return
    try:
        live.stylizers.resample()
        live.say("the styles named drawn-... are others now")
    except ValueError as error:
        live.say(str(error), ALERT)


def _switch_character(live: "Live", _: str) -> None:
    if live.own is None:
        live.say("drop a character on the window: a skinned figure as a .glb or .vrm file")
        return
    live.dress(None if live.view.character else live.own)
    live.say(f"“{live.own.character.name}”" if live.view.character else "the figure")


def _next_ground(live: "Live", _: str) -> None:
    """The character starts again on another ground."""
    if not _kept_by_recording(live):
        live.say(f"ground: {live.grounds.next()}")
        live.start_over()


def _kept_by_recording(live: "Live") -> bool:
    """A recording names one stylizer and one ground: while it runs, those stay."""
    if live.recorder:
        live.say("a recording keeps its stylizer and its ground: stop it first")
    return live.recorder is not None


def _search(live: "Live", _: str) -> None:
    live.hidden = False
    live.type(True)


def _write(live: "Live", text: str) -> None:
    """Letters for a style's new name, or for the search."""
    if live.naming:
        live.naming = live.naming[0], live.naming[1] + text
    else:
        live.choice.search += text


def _erase(live: "Live", _: str) -> None:
    if live.naming:
        live.naming = live.naming[0], live.naming[1][:-1]
    else:
        live.choice.search = live.choice.search[:-1]


def _typed(live: "Live", _: str) -> None:
    """Enter: a style gets its new name; or what is found is worn, and the whole list is back."""
    if live.naming:
        users_styles.end_name(live)
        return
    if live.choice.search and live.choice.shown and live.choice.slot not in live.choice.shown:
        live.choice.choose(live.choice.shown[0])
    live.type(False)


def _menu(live: "Live", _: str) -> None:
    live.menu.open = not live.menu.open
    live.devices.mode = "menu" if live.menu.open else ""


def _help(live: "Live", _: str) -> None:
    """Opens the help, turns to its next page, closes it after the last."""
    live.helping = (live.helping + 1) % (len(help.pages(live.bindings, live.window.size)) + 1)


def _leave(live: "Live", _: str) -> None:
    """Esc closes the help first."""
    live.helping, live.leaving = 0, not live.helping


def _toggle(name: str) -> Action:
    return lambda live, _: setattr(live, name, not getattr(live, name))


SEEN = ("skeleton", "trajectory", "contacts", "onion", "phase", "attention", "times")  # what can be seen inside

ACTIONS: dict[str, Action] = {
    "pick": _pick,
    "part_previous": _pick_next(-1),
    "part_next": _pick_next(1),
    "diagram": _on_diagram,
    "touch": _touch,
    "style_previous": lambda live, _: live.choice.cycle(-1),
    "style_next": lambda live, _: live.choice.cycle(1),
    "choose": _choose,
    "weaker": lambda live, _: live.choice.change_strength(-1),
    "stronger": lambda live, _: live.choice.change_strength(1),
    "strength": lambda live, share: live.choice.set_strength(float(share) * MAX_STRENGTH),
    "share": lambda live, share: live.choice.set_share(float(share)),
    "blend": _blend,
    "pace": _switch_pace,
    "own_style": lambda live, _: live.choice.reset(),
    "reset": lambda live, _: live.choice.reset(everything=True),
    "stylizer_next": _next_stylizer,
    "reroll": _resample,
    "random": lambda live, _: live.choice.mix(),
    "character": _switch_character,
    "ground": _next_ground,
    "preset": _apply_preset,
    "save": _save_preset,
    "preset_next": _next_preset,
    "search": _search,
    "typed": _typed,
    "untyped": lambda live, _: live.type(False),
    "text": _write,
    "erase": _erase,
    "rename": lambda live, _: users_styles.begin_name(live),
    "remove": lambda live, _: users_styles.remove(live),
    "twin": _next_twin,
    **{name: _see(name) for name in SEEN},
    "zoom_in": lambda live, _: live.view.camera.zoom(1),
    "zoom_out": lambda live, _: live.view.camera.zoom(-1),
    "menu": _menu,
    "page": lambda live, page: live.menu.turn_to(page),
    "menu_up": lambda live, _: live.menu.move(-1, live.presets.slots),
    "menu_down": lambda live, _: live.menu.move(1, live.presets.slots),
    "menu_left": lambda live, _: live.menu.turn(-1),
    "menu_right": lambda live, _: live.menu.turn(1),
    "menu_do": lambda live, _: live.menu.do(live.do, live.presets.slots),
    "menu_other": lambda live, _: live.menu.do(live.do, live.presets.slots, other=True),
    "panels": _toggle("hidden"),
    "help": _help,
    "record": lambda live, _: capture.toggle_recording(live),
    "export": lambda live, _: capture.export(live),
    "screenshot": lambda live, _: capture.screenshot(live),
    "full_screen": lambda live, _: live.window.toggle_full_screen(),
    "resized": lambda live, _: live.resize(),
    "leave": _leave,
    "quit": lambda live, _: setattr(live, "leaving", True),
    "wake": lambda live, _: live.wake(),
    "stick": lambda live, _: live.wake(),
    "pad_added": lambda live, _: live.say(f"gamepad plugged in: {live.devices.pad_name}"),
    "pad_removed": lambda live, _: live.say(f"gamepad unplugged; {live.devices.pad_name or 'the keyboard'} steers"),
}
