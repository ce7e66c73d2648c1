"""The panels of the live window, each made of widgets from what the program knows."""

from collections import Counter
from pathlib import Path
from typing import Callable, Collection, Iterator, Mapping, Sequence

import numpy as np

from demo.figure.colours import OWN_STYLE, part_colours, spec_colour, style_colour
from demo.state.bindings import MENU_PAGES, SLOTS
from demo.state.presets import Presets
from demo.state.style_choice import HALF, MIXED, OWN, StyleChoice
from demo.ui.canvas import ACCENT, ALERT, FAINT, INK, SMALL, Colour, wrap
from demo.ui.diagram import Diagram
from demo.ui.hud import Panel
from demo.ui.menu import Menu
from demo.ui.plots import Dial, HeatMap, Times
from demo.ui.text import Flow, Hole, Sentence
from demo.ui.widgets import (
    GAP,
    Beside,
    Button,
    Buttons,
    Cell,
    Choice,
    Choices,
    Field,
    Label,
    Slider,
    Stack,
    Table,
    Widget,
)
from sim.body.pose import Pose
from sim.body.skeleton import GROUPS, PART_NAMES
from sim.io.provenance import NONCOMMERCIAL
from sim.latency import Latency
from sim.style_spec import MAX_STRENGTH, PartSpec, StyleSpec

STYLE_PANEL_WIDTH = 282
OFF = (0.42, 0.47, 0.53)  # the dot of a toggle that is off
LISTED = 8  # styles seen at once; the slider of a blend takes the room of one
INSIGHT_WIDTH = 212  # units of what is seen inside
TINY, WORN, INDENT = 13, 14.5, 16  # heights of letters: of a part and of its style; units that a style's dot takes
UP_DOWN = ("style_previous", "style_next")


class Figures:
    """Frame time, drawing time and pictures a second, each the mean of a short while, so that they can be read."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._since: float | None = None
        self._ticks: list[tuple[float, float]] = []  # frame and drawing time of each picture since
        self.frame_ms = self.draw_ms = self.rate = 0.0

    def tick(self, now: float, frame_ms: float, draw_ms: float) -> None:
        """Takes in one picture at time `now` in seconds."""
        if self._since is None:
            self._since, self.frame_ms = now, frame_ms
            return
        self._ticks.append((frame_ms, draw_ms))
        if now - self._since >= self._seconds:
            self.frame_ms, self.draw_ms = (sum(column) / len(self._ticks) for column in zip(*self._ticks, strict=True))
            self.rate = len(self._ticks) / (now - self._since)
            self._since, self._ticks = now, []


def readable(part: str) -> str:
    """A part's or a group's name as it is shown."""
    return "whole body" if part == "all" else part.replace("_", " ")


def spec_text(spec: PartSpec) -> str:
    """`old`, or `old 60% proud` where 60% of the way to proud is gone."""
    return spec.name if spec.other is None else f"{spec.name} › {spec.share:.0%} {spec.other}"


def parts(style: StyleSpec, picked: Collection[str] = ()) -> Panel:
    """The five parts with the styles and strengths of `style` (as in a Command); those that are picked are lit."""
    return Panel((_parts_table(style, picked),), "top left")


def _parts_table(style: StyleSpec, picked: Collection[str]) -> Table:
    rows = []
    for part in PART_NAMES:
        spec = style.get(part)
        swatch = style_colour(spec.name) if spec else OWN_STYLE
        rows.append(
            (
                Cell(readable(part), INK, swatch),
                Cell(spec_text(spec) if spec else OWN, INK if spec else FAINT),
                Cell(f"{spec.strength:.0%}" if spec else ""),
            )
        )
    return Table(tuple(rows), tuple(i for i, part in enumerate(PART_NAMES) if part in picked))


def style_panel(choice: StyleChoice, typing: bool, comparing: bool, naming: tuple[str, str] | None = None) -> Panel:
    """The body to pick a part from, and that part's style, strength, the style blended in. naming: a style of the
    user's and its new name as far as it is typed, None where none is."""
    colours = tuple(tuple(colour) for colour in part_colours(choice.style).round(3).tolist())
    groups = Buttons(
        tuple(
            Button("all" if group == "all" else readable(group), f"pick_{group}", choice.picked == group)
            for group in GROUPS
        ),
        SMALL,
    )
    diagram = Diagram(colours, choice.parts)
    room = STYLE_PANEL_WIDTH - diagram.size()[0] - GAP
    lines = tuple(_style_lines(choice, room))
    listed = choice.shown if choice.search and choice.shown else (OWN, *choice.shown)
    styles = tuple(
        Choice(
            "no blend" if choice.blending and name == OWN else name,
            f"choose:{name}",
            OWN_STYLE if name == OWN else style_colour(name),
            NONCOMMERCIAL if name in choice.noncommercial else "yours" if name in choice.users_own else "",
        )
        for name in listed
    )
    chosen = listed.index(choice.slot) if choice.slot in listed else 0 if choice.search else None  # Enter chooses it
    users = choice.slot in choice.users_own
    colour = OWN_STYLE if choice.name in (OWN, MIXED) else style_colour(choice.name)
    strength = Slider(
        "strength",
        "mixed" if choice.strengths_differ else f"{choice.strength:.0%}",
        choice.strength / MAX_STRENGTH,
        "strength",
        colour,
        ("stronger", "weaker"),
        mark=1 / MAX_STRENGTH,
    )
    widgets: list[Widget] = [
        Beside(diagram, Stack(lines)),
        groups,
        Buttons(
            (Button("style", "blend:off", not choice.blending), Button("blend with", "blend:on", choice.blending)),
            SMALL,
        ),
        Field(choice.search, f"search {len(choice.styles)} styles", typing, "search")
        if naming is None
        else Field(naming[1], f"new name of {naming[0]}", typing, ""),
        Choices(styles, chosen, LISTED - choice.blending - users, UP_DOWN),
        strength,
    ]
    if choice.blending:
        other = OWN_STYLE if choice.other in (OWN, MIXED) else style_colour(choice.other)
        share = "mixed" if choice.shares_differ else f"{choice.share:.0%}"
        widgets.append(Slider("share", share, choice.share, "share", other, ("stronger", "weaker"), mark=HALF))
    if users:
        widgets.append(Buttons((Button("rename", "rename", naming is not None), Button("remove", "remove")), SMALL))
    widgets.append(
        Buttons(
            (
                Button("no style", "own_style"),
                Button("reset all", "reset"),
                Button("random", "random"),
                Button("compare", "compare", comparing, "hold"),
            ),
            SMALL,
        )
    )
    return Panel(tuple(widgets), "top left", STYLE_PANEL_WIDTH)


def _style_lines(choice: StyleChoice, room: float) -> Iterator[Label]:
    """What stands beside the body, in lines of so many units: the picked part; then each part, small, and under it its
    style, large, with a dot of its colour."""
    yield Label(readable(choice.picked), ACCENT, 18)
    for part in PART_NAMES:
        spec = choice.style.get(part)
        yield Label(readable(part), ACCENT if part in choice.parts else FAINT, TINY)
        words = f"{spec_text(spec)}{' at' if spec.other else ''} {spec.strength:.0%}" if spec else OWN
        swatch: Colour | None = tuple(spec_colour(spec).round(3).tolist()) if spec else OWN_STYLE
        for line in wrap(words, room - INDENT, WORN):
            yield Label(line, INK if spec else FAINT, WORN, swatch, INDENT)
            swatch = None  # of the first line alone


def presets(slots: Presets) -> Panel:
    """The eight presets: a click uses one, or saves the current styles in an empty one; so does the right button in
    any."""
    buttons = []
    for slot in SLOTS:
        name, style = slots.slots.get(slot, ("", StyleSpec()))
        swatches = tuple(map(tuple, part_colours(style).round(3).tolist())) if name else ()
        save = f"save_{slot}"
        buttons.append(
            Button(name or "save styles here", f"preset_{slot}" if name else save, other=save, swatches=swatches)
        )
    pairs = (tuple(buttons[place : place + 2]) for place in range(0, len(buttons), 2))
    rows = tuple(Buttons(pair, SMALL, STYLE_PANEL_WIDTH) for pair in pairs)
    head = Label("presets: right click saves your styles there", FAINT, TINY)
    return Panel((head, *rows), "top left", STYLE_PANEL_WIDTH)


def corner(menu_open: bool, helping: bool, hidden: bool) -> Panel:
    """The buttons that are always there, for the mouse."""
    buttons = (
        Button("menu", "menu", menu_open),
        Button("help", "help", helping),
        Button("show" if hidden else "hide", "panels"),
    )
    return Panel((Buttons(buttons, SMALL),), "top right", 170)


def menu(state: Menu, slots: Presets, is_on: Callable[[str], bool | None]) -> Panel:
    """The open page of the menu; is_on(action) says whether a toggle is on."""
    tabs = Buttons(tuple(Button(page, f"page:{page}", page == state.page) for page in MENU_PAGES), SMALL)
    dots = {True: ACCENT, False: OFF, None: None}
    choices = tuple(
        Choice(row.text, row.action, dots[is_on(row.action)], row.key, row.other) for row in state.rows(slots.slots)
    )
    widgets: list[Widget] = [tabs, Choices(choices, state.row, 8, ("menu_up", "menu_down"))]
    if state.page == "presets":
        widgets.append(Label("right click or X: save the current styles here", FAINT, SMALL))
    return Panel(tuple(widgets), "top right", 330)


def status(
    stylizer: str,
    figures: Figures,
    slow: str,
    simpler: bool,
    ground: str,
    facing_held: bool,
    crouching: bool,
    recorder: object,
    exported: float | None = None,
) -> Panel:
    """The line below the figure: stylizer, ground, what pictures cost or why the world is slow, and what is going on.

    simpler: whether the picture is simpler than it could be. exported: how much of an export is written, 0 .. 1."""
    cells = [Cell(f"stylizer: {stylizer}"), Cell(f"ground: {Path(ground).name}", FAINT)]
    times = (
        f"{figures.rate:.0f} pictures/s",
        f"drawing {figures.draw_ms:.1f} ms" + ", simplified" * simpler,
        f"computing {figures.frame_ms:.1f} ms",
    )
    cells += [Cell(slow, ALERT)] if slow else [Cell(text, FAINT) for text in times]
    if facing_held:
        cells.append(Cell("facing held: F lets go", ACCENT))
    if crouching:
        cells.append(Cell("crouching: J to stand up", ACCENT))
    if recorder:
        cells.append(Cell("recording: R to stop", INK, ALERT))
    if exported is not None:
        cells.append(Cell(f"exporting: {exported:.0%}", INK, ACCENT))
    return Panel((Flow(tuple(cells)),), "bottom")


def line(text: str, anchor: str, colour: Colour = INK) -> Panel:
    """One sentence, on as many lines as it needs."""
    return Panel((Sentence(text, colour),), anchor)


def messages(said: Sequence[tuple[str, Colour]]) -> Panel:
    """Sentences under each other, the most important first; one that was said several times stands there once, with a
    count. Where there is little room the last ones are left out."""
    counts = Counter(said)
    return Panel(
        tuple(
            Sentence(text if count == 1 else f"{text} ({count} times)", colour)
            for (text, colour), count in counts.items()
        ),
        "top",
    )


def legend(entries: Mapping[str, Colour]) -> Panel:
    """What the colours of lines and figures on the scene mean."""
    return Panel(
        (Flow(tuple(Cell(name, INK, colour) for name, colour in entries.items()), width=INSIGHT_WIDTH),),
        "bottom right",
        INSIGHT_WIDTH,
    )


def times(latency: Latency) -> Panel:
    """Time by stage of the last two seconds."""
    return Panel(
        (Label("time of each stage, last 2 s", FAINT, SMALL), Times.of(latency)), "bottom right", INSIGHT_WIDTH
    )


def dial(pose: Pose) -> Panel:
    """Phase and contacts."""
    contacts = tuple(float(round(contact, 2)) for contact in pose.contacts)
    return Panel((Dial(round(float(pose.phase), 3), contacts),), "bottom right", INSIGHT_WIDTH)


def attention(values: np.ndarray | str, part: str, spec: PartSpec | None) -> Panel:
    """The attention map of a part: values (content samples, style samples), or a sentence why there is none."""
    title = Label(f"attention of the {readable(part)}", FAINT, SMALL)
    if isinstance(values, str):
        return Panel((title, Sentence(values, ALERT, SMALL, INSIGHT_WIDTH)), "bottom right", INSIGHT_WIDTH)
    colour = style_colour(spec.name) if spec else OWN_STYLE
    rows = tuple(map(tuple, values.round(3).tolist()))
    across = f"across: a stride of {' and '.join(spec.names) if spec else 'the neutral motion'}, start to end"
    words = Sentence(f"{across}. Bright: used most", FAINT, SMALL, INSIGHT_WIDTH)
    return Panel((title, HeatMap(rows, tuple(colour)), words), "bottom right", INSIGHT_WIDTH)


def title(stylizer: str) -> tuple[Panel, ...]:
    """What lies over the attract mode."""
    return (
        Panel((Label(f"stylizer: {stylizer}", FAINT, SMALL),), "top left", STYLE_PANEL_WIDTH / 2),
        line("Patchwalk plays by itself: press any key, button or the mouse to take over", "bottom", ACCENT),
        line("F1 help", "top right", FAINT),
    )


def label(text: str, swatch: Colour | None = None) -> Panel:
    """A few words beside the figure."""
    return Panel((Table(((Cell(text, INK, swatch),),), letters=SMALL, line=16),), padding=6)


def mixture(style: StyleSpec) -> Panel:
    """What somebody in a crowd moves in: the styles of legs, spine and arms, in their colours."""
    specs = dict.fromkeys(spec for group in GROUPS for part in GROUPS[group] if (spec := style.get(part)))
    cells = tuple(Cell(spec_text(spec), FAINT, tuple(spec_colour(spec).round(3).tolist())) for spec in specs)
    return Panel((Table((cells,), letters=TINY, line=14),), padding=5)


def clip(style: str, width: float, height: float) -> Panel:
    """The room in which the clip is played that a style was learned from."""
    return Panel((Label(f"{style}: the clip", FAINT, SMALL), Hole(width, height)), "bottom right")
