"""The import arrows of DESIGN.md, Sec. 2, read from the source itself, and that every file says what lives in it."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MAY_IMPORT = {  # room: what it may import besides itself and Python's library
    "sim": {"numpy", "scipy"},
    "controller": {"sim", "numpy", "scipy", "torch", "safetensors", "tqdm", "matplotlib"},
    "stylizer": {"sim", "numpy", "scipy", "torch", "safetensors", "tqdm", "matplotlib"},
    "demo": {"sim", "controller", "stylizer", "numpy", "scipy", "torch", "tqdm", "matplotlib", "pygame", "OpenGL", "PIL",
             "imageio_ffmpeg"},
}
FILES = [(room, path) for room in MAY_IMPORT for path in sorted((ROOT / room).rglob("*.py"))]


def imported(tree: ast.AST) -> set[str]:
    """Top-level names of all imports, those inside functions included."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are written in full"
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("room, path", FILES, ids=[str(path.relative_to(ROOT)) for _, path in FILES])
def test_arrows(room, path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert imported(tree) - set(sys.stdlib_module_names) <= MAY_IMPORT[room] | {room}
    assert ast.get_docstring(tree), "a file starts with a line that says what lives in it"


def test_a_forbidden_import_would_be_seen():
    tree = ast.parse("def late():\n    from controller.network import x\n    import pygame.font")
    assert imported(tree) == {"controller", "pygame"}
