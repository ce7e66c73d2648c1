"""Eight presets of the whole body's styles: kept in one file in the user's folder, with bundled ones to begin
with."""

import json
from pathlib import Path

from demo.state.bindings import SLOTS
from sim.body.skeleton import GROUPS, PART_NAMES
from sim.io.atomic_write import atomic_write
from sim.io.text_files import read_json
from sim.io.user_dirs import data_folder
from sim.style_spec import StyleSpec

BUNDLED = Path(__file__).parents[1] / "presets.json"
FORMAT = "patchwalk-presets"
Preset = tuple[str, StyleSpec]  # name, styles of the parts


class Presets:
    """slot (1 .. 8) -> preset. Nothing is written before the first `save`."""

    def __init__(self, path: Path | None = None) -> None:
        """Raises ValueError, naming the slot, for a file with a mistake: it would be lost at the next save."""
        self.path = path or data_folder() / "presets.json"
        self.slots = _read(self.path if self.path.exists() else BUNDLED)

    def save(self, slot: int, style: StyleSpec) -> str:
        """Keeps `style` in a slot and on the disk; returns the name it got. Raises OSError where it cannot be
        written."""
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
        with atomic_write(self.path) as temporary:
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        self.slots = slots


def describe(style: StyleSpec) -> str:
    """A short name for a body's styles, such as `old legs, proud arms`; parts of one style go by their
    group."""
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
    return ", ".join(names)


def _read(path: Path) -> dict[int, Preset]:
    try:
        content = read_json(path)
        if (
            not isinstance(content, dict)
            or content.get("format") != FORMAT
            or not isinstance(content.get("slots"), dict)
        ):
            raise ValueError(
                f'{path} holds no presets: it must look like {{"format": "{FORMAT}", "version": 1, "slots": {{...}}}}'
            )
    except ValueError as error:
        raise ValueError(f"{error}; mend the file or move it away") from None
    slots = {}
    for number, preset in content["slots"].items():
        try:
            if number not in map(str, SLOTS) or not isinstance(preset, dict) or not isinstance(preset.get("name"), str):
                raise ValueError(f'slots are 1 .. {len(SLOTS)}, each with a "name" and a "style"')
            slots[int(number)] = preset["name"], StyleSpec().updated(preset.get("style"))
        except ValueError as error:
            raise ValueError(f"{path}, slot {number}: {error}; mend the file or move it away") from None
    return slots
