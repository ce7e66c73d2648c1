"""Eight presets of the whole body's styles: kept in one file in the user's folder, with bundled ones to begin
with."""

import json
import warnings
from itertools import count
from pathlib import Path

from demo.state.bindings import SLOTS
from sim.body.skeleton import GROUPS, PART_NAMES
from sim.io.atomic_write import atomic_write
from sim.io.bvh_parser import shorten
from sim.io.text_files import read_json
from sim.io.user_dirs import data_folder
from sim.style_spec import StyleSpec

BUNDLED = Path(__file__).parents[1] / "presets.json"
FORMAT = "patchwalk-presets"
LONGEST = 44  # letters of a name that is made up
Preset = tuple[str, StyleSpec]  # name, styles of the parts


class Presets:
    """slot (1 .. 8) -> preset. Nothing is written before the first `save`."""

    def __init__(self, path: Path | None = None) -> None:
        """Warns of what cannot be read: of a slot with a mistake, which is left out, or of a whole file, in place of
        which the bundled ones are there. The next save keeps such a file beside the new one."""
        self.path = path or data_folder() / "presets.json"
        self._unread = False  # whether the file holds what could not be read
        try:
            self.slots, self._unread = _read(self.path if self.path.exists() else BUNDLED)
        except (ValueError, OSError) as error:
            reason = f"{self.path}: {error.strerror}" if isinstance(error, OSError) else error
            warnings.warn(f"{reason}; mend it: until then the presets of Patchwalk are there", stacklevel=2)
            self.slots, self._unread = _read(BUNDLED)[0], True

    def save(self, slot: int, style: StyleSpec) -> str:
        """Keeps `style` in a slot and on the disk; returns the name it got. Raises ValueError for another slot than
        1 .. 8, OSError where it cannot be written."""
        if slot not in SLOTS:
            raise ValueError(f"slot {slot}: slots are {SLOTS[0]} .. {SLOTS[-1]}")
        self._write({**self.slots, slot: (describe(style), style)})
        return describe(style)

    def rename(self, name: str, new: str) -> None:
        """A style is called something else from now on, on the disk too. Raises OSError where it cannot be written."""
        slots = {
            slot: (title.replace(name, new), style.renamed(name, new)) if name in style.names else (title, style)
            for slot, (title, style) in self.slots.items()
        }
        if slots != self.slots:
            self._write(slots)

    def _write(self, slots: dict[int, Preset]) -> None:
        content = {
            "format": FORMAT,
            "version": 1,
            "slots": {
                str(number): {"name": name, "style": spec.to_json()} for number, (name, spec) in sorted(slots.items())
            },
        }
        self.path.parent.mkdir(parents=True, exist_ok=True)
        if self._unread and self.path.exists():
            copies = (self.path.with_stem(f"{self.path.stem}-{number}") for number in count(1))
            self.path.rename(next(copy for copy in copies if not copy.exists()))
        self._unread = False
        with atomic_write(self.path) as temporary:
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        self.slots = slots


def describe(style: StyleSpec) -> str:
    """A short name for a body's styles, such as `old legs, proud arms`; parts of one style go by their
    group. Where that is long, the styles alone, or the first one and how many more there are."""
    if not style:
        return "no style"
    left = list(style)
    names = []
    for group, parts in [(group, parts) for group, parts in reversed(GROUPS.items()) if group != "upper"] + [
        (part, (part,)) for part in PART_NAMES
    ]:
        if all(part in left for part in parts) and len({style[part].names for part in parts}) == 1:
            left = [part for part in left if part not in parts]
            what = " and ".join(style[parts[0]].names)
            names.append(what if group == "all" else f"{what} {group.replace('_', ' ')}")
    whole, alone = ", ".join(names), ", ".join(style.names)
    if len(whole) > LONGEST:
        whole = alone if len(alone) <= LONGEST else f"{style.names[0]} and {len(style.names) - 1} more"
    return whole


def _read(path: Path) -> tuple[dict[int, Preset], bool]:
    """The presets of a file, and whether some were left out, each with a warning. Raises ValueError or OSError for what
    holds none."""
    content = read_json(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT or not isinstance(content.get("slots"), dict):
        raise ValueError(
            f'{path} holds no presets: it must look like {{"format": "{FORMAT}", "version": 1, "slots": {{...}}}}'
        )
    slots = {}
    for number, preset in content["slots"].items():
        try:
            if number not in map(str, SLOTS) or not isinstance(preset, dict) or not isinstance(preset.get("name"), str):
                raise ValueError(f'slots are 1 .. {len(SLOTS)}, each with a "name" and a "style"')
            slots[int(number)] = preset["name"], StyleSpec().updated(preset.get("style"))
        except ValueError as error:
            warnings.warn(f"{path}, slot {shorten(number)}: {error}; it is left out until you mend it", stacklevel=3)
    return slots, len(slots) < len(content["slots"])
