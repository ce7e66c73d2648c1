"""Styles of the user's own, renamed and removed in the window."""

from typing import TYPE_CHECKING

from demo.live.confirm import confirmed
from demo.ui.canvas import ALERT

if TYPE_CHECKING:
    from demo.live.live import Live


def begin_name(live: "Live") -> None:
    """The new name of the chosen style is typed next."""
    if style := _chosen(live):
        live.hidden = False
        live.type(True, naming=style)


def end_name(live: "Live") -> None:
    """What was typed is the style's name; where it cannot be, that is said, and it can be typed on."""
    assert live.naming is not None
    try:
        _rename(live, *live.naming)
        live.type(False)
    except ValueError as error:
        live.say(str(error), ALERT)


def rename(live: "Live", new: str) -> None:
    """The chosen style is called something else. Raises ValueError where it cannot be."""
    if style := _chosen(live):
        _rename(live, style, new.strip())


def _rename(live: "Live", style: str, new: str) -> None:
    def write() -> None:
        live.session.stylizer.rename(style, new)
        live.choice.rename(style, new)
        live.presets.rename(style, new)
        live.say(f"“{style}” is called “{new}” from now on")

    if new not in ("", style):
        live.guard(write)


def remove(live: "Live") -> None:
    """The chosen style is deleted, if that is asked twice."""
    style = _chosen(live)
    if not style:
        return
    if not confirmed(live, f"remove {style}", f"“remove” once more deletes the style “{style}” and its file"):
        return

    def delete() -> None:
        live.session.stylizer.remove(style)
        live.offer_styles()
        live.say(f"removed “{style}”")

    live.guard(delete)


def _chosen(live: "Live") -> str | None:
    """The chosen style, where it is the user's own and may be changed; else that is said."""
    if live.choice.slot not in live.choice.users_own:
        live.say("choose a style of your own first: those that come with Patchwalk stay as they are")
    elif live.recorder:
        live.say("a recording names its styles: stop it first")
    else:
        return live.choice.slot
    return None
