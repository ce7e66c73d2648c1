"""Which key, mouse or gamepad control does what: the one table behind behaviour, help overlay and README."""

from dataclasses import dataclass, field
from typing import Mapping


@dataclass(frozen=True)
class Control:
    """A line of the help, and the actions it stands for.

    keys: action -> pygame key names, all of which do the same. pad: action -> SDL's name of a gamepad button.
    mouse, stick: what the help says of controls that are no buttons."""

    help: str
    keys: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    pad: Mapping[str, str] = field(default_factory=dict)
    mouse: str = ""
    stick: str = ""


PARTS_BY_NUMBER = ("left_leg", "right_leg", "spine", "left_arm", "right_arm", "legs", "arms", "upper", "all")

CONTROLS = (
    Control("walk", {"forward": ("w", "up"), "left": ("a", "left"), "back": ("s", "down"), "right": ("d", "right")},
            stick="left stick"),
    Control("run while held", {"run": ("left shift", "right shift")}, stick="right trigger"),
    Control("turn where it faces", {"face_left": ("q",), "face_right": ("e",)}, stick="right stick"),
    Control("face where it goes again", {"face_free": ("f",)}, {"face_free": "b"}),
    Control("pick a body part or a group",
            {f"pick_{part}": (str(number),) for number, part in enumerate(PARTS_BY_NUMBER, 1)},
            {"part_previous": "dpad_up", "part_next": "dpad_down"}),
    Control("pick the whole body", {"pick_all": ("0",)}, {"pick_all": "x"}),
    Control("change its style", {"style_previous": ("[", "page up"), "style_next": ("]", "page down")},
            {"style_previous": "dpad_left", "style_next": "dpad_right"}, mouse="wheel"),
    Control("change the style's strength", {"weaker": ("-", "keypad -"), "stronger": ("=", "+", "keypad +")},
            {"weaker": "leftshoulder", "stronger": "rightshoulder"}),
    Control("back to its own style", {"own_style": ("backspace",)}, {"own_style": "a"}),
    Control("orbit the camera", mouse="drag", stick="left trigger + right stick"),
    Control("zoom", {"zoom_in": ("z",), "zoom_out": ("x",)}, mouse="ctrl + wheel"),
    Control("neutral twin beside it", {"twin": ("n",)}, {"twin": "y"}),
    Control("record the input, stop recording", {"record": ("r",)}, {"record": "start"}),
    Control("export the last 10 seconds", {"export": ("f9",)}),
    Control("save a picture", {"screenshot": ("f12",)}),
    Control("full screen", {"full_screen": ("f11",)}),
    Control("this help", {"help": ("f1",)}, {"help": "back"}),
    Control("leave", {"leave": ("escape",)}),
)

KEYS = {key: action for control in CONTROLS for action, keys in control.keys.items() for key in keys}
PAD_BUTTONS = {button: action for control in CONTROLS for action, button in control.pad.items()}

# What a newcomer tries first, in this order; each hint stays until one of its actions was done.
HINTS = (
    (("forward", "left", "back", "right", "stick"), "Walk with W A S D or the left stick"),
    (tuple(action for action in KEYS.values() if action.startswith("pick_")) + ("part_previous", "part_next"),
     "Pick a body part with 1 to 9, or up and down on the d-pad"),
    (("style_previous", "style_next"), "Give it a style with [ and ], the mouse wheel, or left and right on the d-pad"),
    (("weaker", "stronger"), "Change how strong it is with - and =, or the shoulder buttons"),
    (("help",), "F1 shows everything else"),
)

# Names as the help shows them, where they are not just in capitals; an empty one is not shown.
_SHOWN = {"left shift": "Shift", "right shift": "", "page up": "PgUp", "page down": "PgDn", "escape": "Esc", "up": "Up",
          "left": "Left", "down": "Down", "right": "Right", "keypad -": "", "keypad +": "", "+": "",
          "backspace": "Backspace"}
_PAD_SHOWN = {"dpad_up": "d-pad up", "dpad_down": "down", "dpad_left": "d-pad left", "dpad_right": "right",
              "leftshoulder": "left shoulder", "rightshoulder": "right shoulder", "back": "Back", "start": "Start"}


def help_rows() -> list[tuple[str, str, str, str]]:
    """(what it does, keys, mouse, gamepad) for every control, as the help overlay and the README show them."""
    return [(control.help, _keys_text(control), control.mouse, _pad_text(control)) for control in CONTROLS]


def _keys_text(control: Control) -> str:
    if len(control.keys) > 4:  # a row of numbers
        first, *_, last = (keys[0] for keys in control.keys.values())
        return f"{first} .. {last}"
    columns = max((len(keys) for keys in control.keys.values()), default=0)
    alternatives = []
    for column in range(columns):
        names = [_SHOWN.get(keys[column], keys[column].upper()) for keys in control.keys.values() if column < len(keys)]
        alternatives.append(" ".join(name for name in names if name))
    return ", ".join(text for text in alternatives if text)


def _pad_text(control: Control) -> str:
    buttons = ", ".join(_PAD_SHOWN.get(button, button.upper()) for button in control.pad.values())
    return " or ".join(text for text in (control.stick, buttons) if text)
