"""What a page is told of its visitor: what is chosen and seen, the styles that there are, and the presets; and once,
sentences and files."""

import json
from typing import TYPE_CHECKING, Any, Sequence

from demo.figure.colours import part_colours, style_colour, worn
from demo.serve import attention

if TYPE_CHECKING:
    from demo.serve.visitor import Visitor


TOLD_FRAMES = 6  # the page is told of changes that nobody asked for once in so many frames


class PageMessages:
    """What waits to be told to a page, and what it was told last."""

    def __init__(self) -> None:
        self._waiting: list[str] = []
        self._told: dict[str, str] = {}  # by its kind
        self._attention: dict[str, Any] = {}
        self._attention_at = -1  # in TOLD_FRAMES, when the attention map was computed last

    def add(self, **content: Any) -> None:
        """A message that is told once."""
        self._waiting.append(json.dumps(content))

    def take(self, visitor: "Visitor") -> list[str]:
        """The messages (JSON) since the last call: those that wait, and of the visitor's state what has changed."""
        messages, self._waiting = self._waiting, []
        for kind, content in self._shown(visitor).items():
            text = json.dumps({kind: content})
            if self._told.get(kind) != text:
                self._told[kind] = text
                messages.append(text)
        return messages

    def _shown(self, visitor: "Visitor") -> dict[str, Any]:
        """All that a page shows, by its kind."""
        if self._attention_at != visitor.frames // TOLD_FRAMES:
            self._attention_at = visitor.frames // TOLD_FRAMES
            self._attention = attention.look(visitor) if "attention" in visitor.seen and visitor.frame else {}
        told = {"state": _state(visitor), "styles": _styles(visitor), "presets": _presets(visitor)}
        return told | ({"attention": self._attention} if self._attention else {})


def to_hex(colour: Sequence[float]) -> str:
    """`#ff8800` of a display colour."""
    return "#" + bytes(round(255 * channel) for channel in colour[:3]).hex()


def _state(visitor: "Visitor") -> dict[str, Any]:
    choice = visitor.choice
    shown = worn(visitor.frame) if visitor.playing is not None and visitor.frame else choice.style
    return {
        "picked": choice.picked,
        "parts": choice.parts,
        "style": shown.to_json(),
        "slot": choice.slot,
        "name": choice.name,
        "other": choice.other,
        "strength": choice.strength,
        "strengths_differ": choice.strengths_differ,
        "share": choice.share,
        "shares_differ": choice.shares_differ,
        "blending": choice.blending,
        "pace": visitor.pace,
        "twin": visitor.view.twin,
        "seen": sorted(visitor.seen),
        "recording": visitor.recorder is not None,
        "character": visitor.shown.name if visitor.shown else "",
        "ground": visitor.grounds.name,
        "stylizer": visitor.session.stylizer.name,
        "crouching": visitor.devices.crouching,
        "facing": visitor.devices.facing_held is not None,
        "playing": visitor.playing is not None,
        "replaying": visitor.replaying,
        "recorded": visitor.recorded is not None,
    }


def _styles(visitor: "Visitor") -> list[list[Any]]:
    """Name, colour, whether it is for non-commercial use only, and whether it is the user's own."""
    choice = visitor.choice
    return [
        [name, to_hex(style_colour(name)), name in choice.noncommercial, name in choice.users_own]
        for name in choice.styles
    ]


def _presets(visitor: "Visitor") -> dict[int, list[Any]]:
    """Slot -> its name and the colours of the parts."""
    return {
        slot: [name, [to_hex(colour) for colour in part_colours(style).tolist()]]
        for slot, (name, style) in visitor.presets.slots.items()
    }
