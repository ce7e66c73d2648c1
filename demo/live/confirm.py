"""What loses something of the user's is asked for twice."""

from typing import TYPE_CHECKING

from demo.ui.canvas import ALERT

if TYPE_CHECKING:
    from demo.live.live import Live

SECONDS = 8.0  # within which it is to be asked for again


def confirmed(live: "Live", what: str, warning: str) -> bool:
    """Whether `what` is asked for the second time in a row; the first time the warning is shown."""
    asked, until = live.asked
    if asked == what and live.clock() <= until:
        live.asked = "", 0.0
        return True
    live.asked = what, live.clock() + SECONDS
    live.say(warning, ALERT)
    return False
