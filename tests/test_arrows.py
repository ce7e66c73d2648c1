"""The import arrows between packages and between their rooms, read from the source itself, and that every file says
what lives in it."""

import ast
import sys
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MAY_IMPORT = {  # room: what it may import besides itself and Python's library
    "sim": {"numpy", "scipy", "safetensors", "torch", "PIL"},
    "controller": {"sim", "numpy", "scipy", "torch", "tqdm", "matplotlib"},
    "stylizer": {"sim", "numpy", "scipy", "torch", "tqdm", "matplotlib"},
    "demo": {
        "patchwalk",
        "sim",
        "controller",
        "stylizer",
        "numpy",
        "scipy",
        "torch",
        "tqdm",
        "matplotlib",
        "pygame",
        "OpenGL",
        "playwright",
        "PIL",
        "imageio_ffmpeg",
        "aiohttp",
        "onnx",
        "onnxruntime",
    },
    "patchwalk": {"sim", "controller", "stylizer"},
}
# The rooms of each package, from the ground up: a room imports only itself and those before it. So there are no
# circles, and what runs imports neither training nor evaluation.
ROOMS = {
    "sim": (
        "math",
        "body",
        "ground",
        "motion",
        "feet",
        "hands",
        "style_spec",
        "command",
        "latency",
        "torch_setup",
        "protocols",
        "session",
        "io",
        "retarget",
        "character",
    ),
    "controller": ("model", "runtime", "training", "evaluation"),
    "stylizer": ("networks", "data", "systems", "styles", "runtime", "training", "evaluation"),
    "demo": (
        "assemble",
        "state",
        "figure",
        "ui",
        "input",
        "render",
        "export",
        "live",
        "serve",
        "bench",
        "commands",
        "cli",
        "__main__",
        "tools",
        "examples",
    ),
}
# Names that several files of a room define on purpose, because files of one kind are called alike through their names.
CALLED_ALIKE = {
    "sim/io": {"read", "write"},  # bvh.read, recording.read ...
    "demo/commands": {"add_arguments", "run"},
    "demo/examples": {"main"},
    "demo/tools": {"main"},
    "stylizer/systems": {  # each file is one paper's system, with its own networks
        "Config",
        "Objective",
        "Encoder",
        "ContentEncoder",
        "StyleEncoder",
        "Decoder",
        "Generator",
    },
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
    tree = ast.parse("def late():\n    from controller.model.network import x\n    import pygame.font")
    assert imported(tree) == {"controller", "pygame"}


def rooms_imported(tree: ast.AST, package: str) -> set[str]:
    """The rooms of a package that a file imports from, those imported inside functions included."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == package:
            parts = node.module.split(".")
            found |= {parts[1]} if len(parts) > 1 else {alias.name for alias in node.names}
    return found


@pytest.mark.parametrize("package, path", FILES, ids=[str(path.relative_to(ROOT)) for _, path in FILES])
def test_arrows_between_rooms(package, path):
    room = path.relative_to(ROOT / package).parts[0].removesuffix(".py")
    if room == "__init__":
        return
    order = ROOMS.get(package, (room,))
    allowed = set(order[: order.index(room) + 1])
    assert rooms_imported(ast.parse(path.read_text(encoding="utf-8")), package) & set(order) <= allowed


def test_a_room_that_looks_up_would_be_seen():
    tree = ast.parse("def late():\n    from sim.retarget import retarget\n    from sim import session")
    assert rooms_imported(tree, "sim") == {"retarget", "session"}


def public_definitions(tree: ast.Module) -> list[str]:
    """The functions and classes of a file that others may use, those with several signatures once."""
    kinds = ast.FunctionDef | ast.ClassDef
    names = [node.name for node in tree.body if isinstance(node, kinds) and not node.name.startswith("_")]
    return list(dict.fromkeys(names))


def test_a_name_is_defined_once_in_a_room():
    places = defaultdict(list)
    for _, path in FILES:
        room = str(path.parent.relative_to(ROOT))
        for name in public_definitions(ast.parse(path.read_text(encoding="utf-8"))):
            if name not in CALLED_ALIKE.get(room, ()):
                places[room, name].append(path.name)
    assert places[str(Path("sim/body")), "forward_kinematics"], "definitions are found at all"
    twice = {f"{room}: {name}": files for (room, name), files in places.items() if len(files) > 1}
    assert twice == {"sim/body: forward_kinematics": ["kinematics.py", "torch_kinematics.py"]}, (
        "the same for numpy and for torch; any other name that two files define means two things"
    )
