"""What a newcomer tries first, said one thing at a time; each hint stays until it was followed."""

from demo.state.bindings import Bindings

PICKS = ("pick_left_leg", "pick_all")


class Hints:
    """The hints that are left, in their order, naming the user's own keys."""

    def __init__(self, bindings: Bindings) -> None:
        shown = bindings.shown
        self._left = [
            (
                ("forward", "left", "back", "right", "stick"),
                f"Walk with {shown('forward', 'left', 'back', 'right')} or the left stick; "
                "drag the mouse to look round",
            ),
            (
                ("pick_", "part_", "diagram", "touch"),
                f"Pick a body part: click on it, press {shown(PICKS[0])} to 9, or up and down on the d-pad",
            ),
            (
                ("style_", "choose", "typed"),
                f"Give it a style from the list, with {shown('style_previous', 'style_next')}, "
                "or left and right on the d-pad",
            ),
            (
                ("weaker", "stronger", "strength"),
                f"Change how strong it is: the slider, {shown('weaker', 'stronger')}, or the shoulder buttons",
            ),
            (("compare",), f"Hold {shown('compare')} or “compare” to see it without styles"),
            (
                ("jump", "crouch", "ground"),
                f"Jump with {shown('jump')}, crouch with {shown('crouch')}, A and B on a gamepad; "
                f"{shown('ground')} goes on to hills, stairs, rough ground",
            ),
            (("help", "menu"), f"{shown('help')} shows everything else, {shown('menu')} or Start opens the menu"),
        ]

    def done(self, action: str) -> None:
        """An action was done: the hint that is shown goes if it asked for that."""
        if self._left and action.startswith(self._left[0][0]):
            self._left.pop(0)

    @property
    def text(self) -> str | None:
        """The hint to show, or None when all were followed."""
        return self._left[0][1] if self._left else None
