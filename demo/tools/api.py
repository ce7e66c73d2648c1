"""docs/API.md from the docstrings of what `patchwalk` makes public: `python -m demo.tools.api` writes it again."""

import dataclasses
import inspect
import re
from functools import cached_property
from pathlib import Path
from typing import Any, Callable

import patchwalk

FILE = Path(__file__).parents[2] / "docs" / "API.md"
HEAD = """# The library

    import patchwalk as pw

What stands here is kept: it changes only with a new minor version, and `CHANGELOG.md` then says how. This page is
written from the docstrings by `python -m demo.tools.api`; programs that use it are in `demo/examples/`.
"""


def api_text() -> str:
    """The page."""
    return "\n".join([HEAD, *map(_entry, patchwalk.__all__)])


def _entry(name: str) -> str:
    thing = getattr(patchwalk, name)
    if not inspect.isclass(thing):
        return f"## pw.{name}{_signature(thing)}\n\n{_text(thing)}\n"
    made = "" if issubclass(thing, tuple) else _signature(thing)
    lines = [f"## pw.{name}{made}", "", _text(thing), ""]
    start = inspect.getdoc(thing.__init__) if "__init__" in vars(thing) else None
    if start and not dataclasses.is_dataclass(thing):
        lines += [_paragraphs(start), ""]
    for key, member in vars(thing).items():
        function = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
        if key.startswith("_") or not inspect.getdoc(function):
            continue
        if isinstance(member, (property, cached_property)):
            lines.append(f"- **.{key}**: {_line(member)}")
        elif inspect.isfunction(function):
            lines.append(f"- **.{key}{_signature(function)}**: {_line(function)}")
    return "\n".join([*lines, ""])


def _signature(thing: Callable[..., Any]) -> str:
    """Names and defaults of the parameters; what types they have the text says."""
    parameters = []
    for parameter in inspect.signature(thing).parameters.values():
        if parameter.name in ("self", "cls"):
            continue
        prefix = "\\*" * (parameter.kind == parameter.VAR_POSITIONAL) + "\\*\\*" * (
            parameter.kind == parameter.VAR_KEYWORD
        )
        text = f"{prefix}{parameter.name}"
        if parameter.default is not parameter.empty:
            value = parameter.default
            text += (
                "=..."
                if isinstance(value, Path) or "object at" in repr(value) or "factory" in repr(value)
                else f"={value!r}"
            )
        parameters.append(text)
    return f"({', '.join(parameters)})"


def _text(thing: object) -> str:
    return _paragraphs(inspect.getdoc(thing) or "")


def _paragraphs(text: str) -> str:
    """Docstring paragraphs as Markdown: lines of code keep their indent, of a list of parameters each is a point."""
    return re.sub(r"^(\w+): ", r"- `\1`: ", text, flags=re.MULTILINE)


def _line(thing: object) -> str:
    return " ".join((inspect.getdoc(thing) or "").split())


if __name__ == "__main__":
    FILE.write_text(api_text(), encoding="utf-8")
    print(f"wrote {FILE}")
