"""The user's own bindings: `keys.toml` in the user's folder, laid over the table of demo.state.bindings."""

import warnings
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import pygame

from demo.state.bindings import CONTROLS, DEFAULT, Bindings, Names
from sim.io.bvh_parser import shorten
from sim.io.text_files import read_toml
from sim.io.user_dirs import data_folder

DEVICES = {"keys": "keys", "gamepad": "pad", "mouse": "mouse"}  # section of the file -> field of Bindings
MOUSE = ("left", "middle", "right", "back", "forward", "wheel up", "wheel down")
PAD = tuple(
    name.removeprefix("CONTROLLER_BUTTON_").lower()
    for name in sorted(vars(pygame))
    if name.startswith("CONTROLLER_BUTTON_") and name != "CONTROLLER_BUTTON_MAX" and "INVALID" not in name
) + ("lefttrigger", "righttrigger", "left stick", "right stick")
PREFIXES = {"keys": ("ctrl+", "shift+"), "gamepad": ("lefttrigger+",), "mouse": ()}

HEAD = """# Patchwalk: which key, mouse button or gamepad control does what.
# Lines that you do not change may go; `action = []` leaves an action without a key.
# Keys: SDL's names, perhaps after "ctrl+" and "shift+". Gamepad: SDL's names, perhaps after "lefttrigger+".
# Mouse: left, middle, right, back, forward, "wheel up", "wheel down".
"""


def path() -> Path:
    """Where the file is looked for; it need not exist."""
    return data_folder() / "keys.toml"


def load(file: Path | None = None) -> Bindings:
    """The user's bindings, or the built-in ones where there is no file.

    A name that the file gives to an action is taken from the action that has it in the table. What has a mistake counts
    for nothing, with a warning that names the line or the field."""
    file = file or path()
    if not file.exists():
        return DEFAULT
    try:
        content = read_toml(file)
    except (ValueError, OSError) as error:
        reason = f"{file}: {error.strerror}" if isinstance(error, OSError) else error
        warnings.warn(
            f"{reason}; the built-in keys count until you mend it, and `patchwalk keys` prints them", stacklevel=2
        )
        return DEFAULT
    bindings = DEFAULT
    for section, entries in content.items():
        if section not in DEVICES or not isinstance(entries, dict):
            warnings.warn(
                f"{file}: unknown section '{shorten(section)}'; there are [{'], ['.join(DEVICES)}]", stacklevel=2
            )
            continue
        table = _laid_over(getattr(DEFAULT, DEVICES[section]), entries, section, file)
        bindings = replace(bindings, **{DEVICES[section]: table})
    return bindings


def template(bindings: Bindings = DEFAULT) -> str:
    """A whole file with the given bindings, each line explained."""
    text = HEAD
    for section, name in DEVICES.items():
        text += f"\n[{section}]\n"
        for control in CONTROLS:
            actions = getattr(control, name)
            if actions:
                text += f"# {control.help}\n"
            for action in actions:
                names = ", ".join('"' + key.replace("\\", "\\\\") + '"' for key in getattr(bindings, name)[action])
                text += f"{action} = [{names}]\n"
    return text


def _laid_over(table: dict[str, Names], entries: dict, section: str, file: Path) -> dict[str, Names]:
    own: dict[str, Names] = {}
    taken: dict[str, str] = {}
    for action, names in entries.items():
        try:
            _check_entry(action, names, table, section, taken)
        except ValueError as error:
            warnings.warn(f"{file}, [{section}] {shorten(action)}: {error}", stacklevel=3)
            continue
        own[action] = tuple(names)
        taken |= dict.fromkeys(names, action)
    return {
        action: own.get(action, tuple(name for name in names if name not in taken)) for action, names in table.items()
    }


def _check_entry(action: str, names: object, table: dict[str, Names], section: str, taken: dict[str, str]) -> None:
    """Raises ValueError for a line that cannot count; taken: names that lines before it gave to actions."""
    if action not in table:
        near = get_close_matches(action, table, 1)
        hint = f"did you mean '{near[0]}'?" if near else "`patchwalk keys` lists them all"
        raise ValueError(f"there is no such action; {hint}")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError(f'give a list of names, such as {action} = ["{(table[action] or ("w",))[0]}"]')
    for name in names:
        _check(name, section)
        if name in taken and {action, taken[name]} != {"touch", "orbit"}:  # one button clicks and drags
            raise ValueError(f"'{name}' is given to {taken[name]} already; leave it out of one of them")


def _check(name: str, section: str) -> None:
    plain = name
    for prefix in PREFIXES[section]:
        plain = plain.removeprefix(prefix)
    known = {"gamepad": PAD, "mouse": MOUSE}.get(section)
    if known is not None and plain not in known:
        raise ValueError(f"there is no '{shorten(name)}'; use {', '.join(known)}")
    if known is None:
        try:
            with warnings.catch_warnings(action="ignore"):  # pygame doubts its own answer before a window is open
                pygame.key.key_code(plain)
        except ValueError:
            raise ValueError(
                f"there is no key '{shorten(name)}'; use names such as w, space, left shift, f5, "
                "page up, keypad 1, ctrl+1"
            ) from None
