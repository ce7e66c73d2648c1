"""Which key, mouse button or gamepad control does what: the one table behind behaviour, menu, help, README and
keys.toml.

Keys are named as SDL names them, perhaps after `ctrl+` and `shift+`; gamepad buttons likewise, perhaps after
`lefttrigger+`."""

from dataclasses import dataclass, field
from typing import Mapping

Names = tuple[str, ...]


@dataclass(frozen=True)
class Control:
    """A line of the help, and the actions it stands for.

    keys, pad, mouse: action -> names of keys, gamepad controls and mouse buttons, all of which do the same.
    touch: what the help says of the panels. menu: the page of the menu it is on; its first action is done there, and
    its second one, if there are two, by X or the right button. group: the heading of the help that begins with it."""

    help: str
    keys: Mapping[str, Names] = field(default_factory=dict)
    pad: Mapping[str, Names] = field(default_factory=dict)
    mouse: Mapping[str, Names] = field(default_factory=dict)
    touch: str = ""
    menu: str = ""
    group: str = ""


PARTS_BY_NUMBER = ("left_leg", "right_leg", "spine", "left_arm", "right_arm", "legs", "arms", "upper", "all")
SLOTS = range(1, 9)  # of presets
MENU_PAGES = ("show", "style", "presets", "window")

CONTROLS = (
    Control(
        "walk",
        {"forward": ("w", "up"), "left": ("a", "left"), "back": ("s", "down"), "right": ("d", "right")},
        {"walk": ("left stick",)},
        group="Move",
    ),
    Control("run (hold)", {"run": ("left shift", "right shift")}, {"run": ("righttrigger",)}),
    Control("jump", {"jump": ("space",)}, {"jump": ("a",)}),
    Control("crouch (hold)", {"crouch": ("c",)}, {"crouch": ("lefttrigger+leftshoulder",)}),
    Control("crouch (on, off)", {"crouch_toggle": ("j",)}, {"crouch_toggle": ("b",)}),
    Control(
        "face left, right while walking",
        {"face_left": ("q",), "face_right": ("e",)},
        {"face": ("lefttrigger+right stick",)},
    ),
    Control("face forward again", {"face_free": ("f",)}, {"face_free": ("lefttrigger+rightstick",)}),
    Control("speed from the leg style or the stick", {"pace": ("i",)}, menu="style"),
    Control(
        "select a body part or a group",
        {f"pick_{part}": (str(n),) for n, part in enumerate(PARTS_BY_NUMBER[:-1], 1)},
        {"part_previous": ("dpad_up",), "part_next": ("dpad_down",)},
        {"touch": ("left",)},
        touch="on it",
        group="Style",
    ),
    Control("select the whole body", {"pick_all": ("9", "0")}, {"pick_all": ("x",)}),
    Control(
        "change its style",
        {"style_previous": ("[", "page up"), "style_next": ("]", "page down")},
        {"style_previous": ("dpad_left",), "style_next": ("dpad_right",)},
        touch="the list",
    ),
    Control(
        "change its strength",
        {"weaker": ("-", "keypad -"), "stronger": ("=", "+", "keypad +")},
        {"weaker": ("leftshoulder",), "stronger": ("rightshoulder",)},
        touch="the slider",
    ),
    Control(
        "blend in a second style (on, off)",
        {"blend": ("b",)},
        {"blend": ("leftstick",)},
        touch="“blend”",
        menu="style",
    ),
    Control("search the styles", {"search": ("/", "ctrl+f")}, touch="the search line", menu="style"),
    Control(
        "part back to no style",
        {"own_style": ("backspace",)},
        {"own_style": ("lefttrigger+a",)},
        touch="“no style”",
        menu="style",
    ),
    Control("all back to no style", {"reset": ("delete", "shift+backspace")}, touch="“reset all”", menu="style"),
    Control("rename a style of yours", {"rename": ()}, touch="“rename”", menu="style"),
    Control("remove a style of yours", {"remove": ()}, touch="“remove”", menu="style"),
    Control("next stylizer", {"stylizer_next": ("y",)}, {"stylizer_next": ("lefttrigger+b",)}, menu="style"),
    Control("other random styles (drawn-...)", {"reroll": ("u",)}, menu="style"),
    Control(
        "random styles on all parts", {"random": ("v",)}, {"random": ("lefttrigger+x",)}, touch="“random”", menu="style"
    ),
    Control(
        "compare with no styles (hold)",
        {"compare": ("return", "keypad enter")},
        {"compare": ("lefttrigger+rightshoulder",)},
        touch="hold “compare”",
    ),
    Control(
        "next preset", {"preset_next": ("l",)}, {"preset_next": ("rightstick",)}, touch="its button", group="Presets"
    ),
    Control(
        "use a preset", {f"preset_{slot}": (f"ctrl+{slot}",) for slot in SLOTS}, touch="its button", menu="presets"
    ),
    Control(
        "save the styles as a preset",
        {f"save_{slot}": (f"ctrl+shift+{slot}",) for slot in SLOTS},
        touch="right click on it",
        menu="presets",
    ),
    Control("neutral twin (beside, see-through, off)", {"twin": ("n",)}, {"twin": ("y",)}, menu="show", group="Show"),
    Control("skeleton", {"skeleton": ("k",)}, menu="show"),
    Control("path: walked, asked, predicted", {"trajectory": ("t",)}, menu="show"),
    Control("feet on the ground", {"contacts": (",",)}, menu="show"),
    Control("poses of the last half second", {"onion": ("o",)}, menu="show"),
    Control("phase of the stride", {"phase": ("p",)}, menu="show"),
    Control("attention map of the selected part", {"attention": ("h",)}, menu="show"),
    Control("time of each stage", {"times": ("g",)}, {"times": ("lefttrigger+y",)}, menu="show"),
    Control(
        "turn the camera",
        {},
        {"orbit": ("right stick",)},
        {"orbit": ("left", "right", "middle")},
        touch="drag",
        group="Camera",
    ),
    Control(
        "zoom",
        {"zoom_in": ("z",), "zoom_out": ("x",)},
        {"zoom_in": ("lefttrigger+dpad_up",), "zoom_out": ("lefttrigger+dpad_down",)},
        {"zoom_in": ("wheel up",), "zoom_out": ("wheel down",)},
    ),
    Control("next ground", {"ground": ("f2",)}, {"ground": ("lefttrigger+dpad_left",)}, menu="window", group="Window"),
    Control("your character, or the figure", {"character": ("f3",)}, menu="window"),
    Control("menu", {"menu": ("m",)}, {"menu": ("start",)}, touch="“menu”"),
    Control("hide, show the panels", {"panels": ("tab",)}, touch="“hide”", menu="window"),
    Control("record the input (start, stop)", {"record": ("r",)}, menu="window"),
    Control("export the last 10 seconds", {"export": ("f9",)}, menu="window"),
    Control("save a picture", {"screenshot": ("f12",)}, menu="window"),
    Control("full screen", {"full_screen": ("f11",)}, menu="window"),
    Control("help", {"help": ("f1",)}, {"help": ("back",)}, touch="“help”", menu="window"),
    Control("quit", {"leave": ("escape",)}, menu="window"),
)

# While the menu is open or something is typed, these go before the table above; they cannot be changed.
MENU_KEYS = {
    "up": "menu_up",
    "down": "menu_down",
    "left": "menu_left",
    "right": "menu_right",
    "return": "menu_do",
    "x": "menu_other",
    "escape": "menu",
}
MENU_PAD = {
    "dpad_up": "menu_up",
    "dpad_down": "menu_down",
    "dpad_left": "menu_left",
    "dpad_right": "menu_right",
    "a": "menu_do",
    "x": "menu_other",
    "b": "menu",
}
TYPING_KEYS = {
    "return": "typed",
    "keypad enter": "typed",
    "escape": "untyped",
    "backspace": "erase",
    "up": "style_previous",
    "down": "style_next",
}
TYPING_PAD = {"b": "untyped"}


@dataclass(frozen=True)
class Bindings:
    """What each action is bound to: action -> names, for the three kinds of devices."""

    keys: Mapping[str, Names]
    pad: Mapping[str, Names]
    mouse: Mapping[str, Names]

    def actions(self, device: str) -> dict[str, str]:
        """name of a key, gamepad control or mouse button -> action; device is `keys`, `pad` or `mouse`."""
        return {name: action for action, names in getattr(self, device).items() for name in names}

    def help_rows(self) -> list[tuple[str, str, str, str]]:
        """(what it does, keys, mouse, gamepad) for every control, as the help overlay and the README show them."""
        rows = []
        for control in CONTROLS:
            keys = _text([self.keys[action] for action in control.keys], _SHOWN)
            pad = _text([self.pad[action] for action in control.pad], _PAD_SHOWN)
            mouse = _text([self.mouse[action] for action in control.mouse], _MOUSE_SHOWN)
            by_menu = "menu" if control.menu else ""
            rows.append((control.help, keys, " ".join(filter(None, (mouse, control.touch))) or by_menu, pad or by_menu))
        return rows

    def help_groups(self) -> dict[str, list[tuple[str, str, str, str]]]:
        """The rows of the help under their headings."""
        groups: dict[str, list[tuple[str, str, str, str]]] = {}
        for control, row in zip(CONTROLS, self.help_rows(), strict=True):
            if control.group:
                groups[control.group] = rows = []
            rows.append(row)
        return groups

    def shown(self, *actions: str) -> str:
        """The keys of some actions as text, such as `W A S D`."""
        return _text([self.keys[action][:1] for action in actions], _SHOWN)


def _merged(field_name: str) -> dict[str, Names]:
    return {action: names for control in CONTROLS for action, names in getattr(control, field_name).items()}


DEFAULT = Bindings(_merged("keys"), _merged("pad"), _merged("mouse"))

# Names as the help shows them, where they are not just in capitals; an empty one is not shown.
_SHOWN = {
    "left shift": "Shift",
    "right shift": "",
    "page up": "PgUp",
    "page down": "PgDn",
    "escape": "Esc",
    "up": "Up",
    "left": "Left",
    "down": "Down",
    "right": "Right",
    "keypad -": "",
    "keypad +": "",
    "+": "",
    "space": "Space",
    "return": "Enter",
    "keypad enter": "",
    "backspace": "Backspace",
    "delete": "Del",
    "tab": "Tab",
    "ctrl": "Ctrl",
    "shift": "Shift",
}
ARROWS = "Up Left Down Right"
_PAD_SHOWN = {
    "dpad_up": "d-pad up",
    "dpad_down": "down",
    "dpad_left": "d-pad left",
    "dpad_right": "right",
    "leftshoulder": "LB",
    "rightshoulder": "RB",
    "back": "Back",
    "start": "Start",
    "righttrigger": "RT",
    "lefttrigger": "LT",
    "left stick": "left stick",
    "right stick": "right stick",
    "leftstick": "press left stick",
    "rightstick": "press right stick",
}
_MOUSE_SHOWN = {"left": "click", "right": "", "middle": "", "wheel up": "wheel", "wheel down": ""}


def _text(columns: list[Names], shown: Mapping[str, str]) -> str:
    """Names of several actions: the first of each together, then the second of each, and so on."""
    if len(columns) > 4 and all(columns):  # a row of numbers
        return f"{_name(columns[0][0], shown)} .. {_name(columns[-1][0].split('+')[-1], shown)}"
    rows = [
        [names[place] for names in columns if place < len(names)] for place in range(max(map(len, columns), default=0))
    ]
    texts = [_row(row, shown) for row in rows]
    return ", ".join("arrows" if text == ARROWS else text for text in texts if text)


def _row(names: list[str], shown: Mapping[str, str]) -> str:
    """Names that are shown together; a prefix that they share is said once."""
    prefix = names[0][: names[0].rfind("+", 0, -1) + 1]
    rest = [names[0], *(name.removeprefix(prefix) for name in names[1:])]
    return " ".join(filter(None, (_name(name, shown) for name in rest)))


def _name(name: str, shown: Mapping[str, str]) -> str:
    """`ctrl+f` as `Ctrl + F`."""
    parts = [name] if name in shown or name.endswith("+") else name.split("+")
    return " + ".join(shown.get(part, part.upper()) for part in parts)
