"""What is seen of a live run besides its newest frame: panels, and what its toggles show inside."""

from typing import TYPE_CHECKING, Iterator

from demo.figure.colours import worn
from demo.live import actions
from demo.render.inset import SIDES
from demo.ui import hud, panels
from demo.ui.widgets import Region

if TYPE_CHECKING:
    from demo.live.live import Live

GLOW_SECONDS = 0.5
INSET_ROOM = SIDES[1] * 720 + 8  # units that the clip in the lower right corner takes from what stands there


def look(live: "Live", now: float) -> None:
    """Puts what is to be seen into the view, and tells the mouse where it can be touched."""
    view = live.view
    glow = max(0.0, 1 - (now - live.picked_at) / GLOW_SECONDS)
    view.glow = dict.fromkeys(live.choice.parts, glow) if glow else {}
    view.skeleton, view.contacts = "skeleton" in live.seen, "contacts" in live.seen
    view.paths = live.debug_overlay.paths() if "trajectory" in live.seen else None
    view.past = live.debug_overlay.past() if "onion" in live.seen else ()
    view.panels = tuple(_panels(live))
    placed = hud.place(view.panels, live.window.size)
    live.devices.pointer.regions = [region for panel in placed for region in (Region(panel.box, ""), *panel.regions())]
    under = live.devices.pointer.under()
    view.over = (hud.highlight(under, live.window.size),) if under and under.action else ()


def _panels(live: "Live") -> Iterator[hud.Panel]:
    """The panels, those that lie on top last."""
    yield from _main_panels(live)
    for _, text, colour in live.toasts:
        yield panels.line(text, "top", colour)


def _main_panels(live: "Live") -> Iterator[hud.Panel]:
    if live.playing is not None and live.frame:
        yield panels.parts(worn(live.frame))
        yield from panels.title()
        return
    yield panels.corner(live.menu.open, live.helping, live.hidden)
    if live.helping:
        yield panels.help_of(live.bindings)
        return
    if not live.hidden:
        yield panels.style_panel(live.choice, live.devices.mode == "typing", live.devices.holds("compare"))
        yield panels.presets(live.presets)
    yield panels.status(
        live.choice,
        live.figures,
        live.missed,
        live.grounds.name,
        live.devices.facing_held,
        live.devices.crouching,
        live.recorder,
        brief=not live.hidden,
    )
    if live.hints.text:
        yield panels.line(live.hints.text, "bottom")
    if not (live.menu.open and live.inset.playing):  # there is no room for all three
        for panel in live.debug_overlay.panels(live.seen, live.choice):
            yield panels.lift(panel, INSET_ROOM if live.inset.playing else 0)
    if live.menu.open:
        yield panels.menu(live.menu, live.presets, lambda action: actions.is_on(live, action))
