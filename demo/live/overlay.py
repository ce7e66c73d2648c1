"""What is seen of a live run besides its newest frame: panels, and what its toggles show inside."""

from typing import TYPE_CHECKING, Iterator

from demo.figure.colours import worn
from demo.live import actions
from demo.render.inset import SIDES
from demo.ui import help, hud, layout, panels
from demo.ui.text import Hole
from demo.ui.widgets import Region

if TYPE_CHECKING:
    from demo.live.live import Live

GLOW_SECONDS = 0.5
MOST_TOASTS = 3  # seen at once, the newest ones


def look(live: "Live", now: float) -> None:
    """Puts what is to be seen into the view, and tells the mouse where it can be touched."""
    view, size = live.view, live.window.size
    glow = max(0.0, 1 - (now - live.picked_at) / GLOW_SECONDS)
    view.glow = dict.fromkeys(live.choice.parts, glow) if glow else {}
    view.skeleton, view.contacts = "skeleton" in live.seen, "contacts" in live.seen
    view.paths = live.debug_overlay.paths() if "trajectory" in live.seen else None
    view.past = live.debug_overlay.past() if "onion" in live.seen else ()
    if live.crowd and live.crowd.poses:
        view.crowd = live.crowd.poses, live.crowd_colours
    view.panels = tuple(_panels(live))
    placed = layout.place(view.panels, size)
    live.inset_box = next((box for panel in placed if (box := panel.box_of(Hole))), None)
    live.devices.pointer.regions = [region for panel in placed for region in (Region(panel.box, ""), *panel.regions())]
    under = live.devices.pointer.under()
    view.over = (hud.highlight(under, size),) if under and under.action else ()
    view.make_room(size)
    if live.frame:
        live.labels.follow(live.frame, now)
        view.over += tuple(live.labels.place(live.frame, view, size, now, live.crowd.styles if live.crowd else ()))


def _panels(live: "Live") -> Iterator[hud.Panel]:
    """The panels, the most important first: where there is little room the last ones are left out."""
    if live.playing is not None and live.frame:
        yield panels.parts(worn(live.frame))
        yield from panels.title(live.session.stylizer.name)
    else:
        yield panels.corner(live.menu.open, bool(live.helping), live.hidden)
        if live.helping:
            pages = help.pages(live.bindings, live.window.size)
            yield pages[min(live.helping, len(pages)) - 1]
            return
        if live.menu.open:
            yield panels.menu(live.menu, live.presets, lambda action: actions.is_on(live, action))
        if not live.hidden:
            yield from _main_panels(live)
    if live.toasts:
        said = [(text, colour) for _, text, colour in reversed(live.toasts)]
        newest = list(dict.fromkeys(said))[:MOST_TOASTS]
        yield panels.messages([each for each in said if each in newest])
    if live.inset.playing:
        width, height = (720 * side for side in SIDES)
        yield panels.clip(live.inset.style, width, height)
    if not live.hidden:
        yield from live.debug_overlay.panels(live.seen, live.choice)


def _main_panels(live: "Live") -> Iterator[hud.Panel]:
    """Those that are there unless they are hidden."""
    comparing = live.devices.holds("compare")
    yield panels.style_panel(live.choice, live.devices.mode == "typing", comparing, live.naming)
    yield panels.presets(live.presets)
    yield panels.status(
        live.session.stylizer.name,
        live.figures,
        live.load.describe(live.session.latency.last_ms("frame") / 1000),
        live.load.level > 0,
        live.grounds.name,
        live.devices.facing_held,
        live.devices.crouching,
        live.recorder,
        live.takes.progress,
    )
    if live.hints.text:
        yield panels.line(live.hints.text, "bottom")
