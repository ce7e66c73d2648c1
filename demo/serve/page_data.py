"""What the page needs of ours, from the tables that the window draws with: shaders, colours, keys, the body's picture,
grounds."""

import json
import struct
from functools import cache

import numpy as np

from demo.figure import colours, forms
from demo.live import actions
from demo.render import body_shaders, camera, ground_decals, ground_mesh, shaders
from demo.serve import packet
from demo.serve.model_file import MOST_BONES, PLACE
from demo.serve.page_state import to_hex
from demo.serve.remote_input import HELD, PRESSED
from demo.serve.visitor import DONE
from demo.state.bindings import CONTROLS, SLOTS, Bindings
from demo.state.style_choice import OWN
from demo.ui import canvas, diagram
from sim.body.skeleton import BONE_OFFSETS, CONTACT_JOINTS, GROUPS, JOINTS, PARENTS, PART_NAMES, PART_OF_JOINT
from sim.ground.catalogue import NAMES, load_ground
from sim.style_spec import MAX_STRENGTH

VERSION = "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2DShadow;\n"
BY_PAGE = "zoom_in zoom_out search panels help full_screen screenshot export".split()  # what it does by itself
OWN_KEYS = {"video": ("record a video of the picture (start, stop)", ("f8",))}  # what the window has not
HEIGHT_UNIT = 0.001  # metres, of a ground's heights


def world(bindings: Bindings, grounds: tuple[str, ...]) -> bytes:
    """All but models and grounds, as JSON."""
    content = {
        "packet": packet.layout(),
        "shaders": _shaders(),
        "light": ground_mesh.TO_LIGHT.tolist(),
        "visor": forms.VISOR.tolist(),
        "bones": {"most": MOST_BONES, "place": PLACE},
        "camera": _camera(),
        "decals": _decals(),
        "colours": _colours(),
        "parts": PART_NAMES,
        "groups": GROUPS,
        "joints": JOINTS,
        "parents": PARENTS.tolist(),
        "part_of_joint": PART_OF_JOINT.tolist(),
        "offsets": BONE_OFFSETS.tolist(),
        "diagram": _diagram(),
        "keys": {**{name: keys for name, (_, keys) in OWN_KEYS.items()}, **bindings.keys},
        "pad": bindings.pad,
        "held": sorted(HELD),
        "help": _help(bindings),
        "own": OWN,
        "slots": list(SLOTS),
        "max_strength": MAX_STRENGTH,
        "grounds": grounds,
    }
    return json.dumps(content, separators=(",", ":")).encode()


@cache
def heights(name: str) -> bytes:
    """A ground: rows, columns, whether it repeats (uint32), its cell (float32), heights (int16) in HEIGHT_UNIT; empty
    for level floor. Raises ValueError or OSError for what is no ground."""
    ground = load_ground(name)
    if ground is None:
        return b""
    rows, columns = ground.heights.shape
    table = np.clip(np.round(ground.heights / HEIGHT_UNIT), -32768, 32767).astype("<i2")
    return struct.pack("<IIIf", rows, columns, ground.tiled, ground.cell) + table.tobytes()


def ground_names(own: str | None) -> tuple[str, ...]:
    """The grounds that a page may ask for: the named ones, and the one it was told to serve."""
    return tuple(dict.fromkeys((*NAMES, *([own] if own else ()))))


def _help(bindings: Bindings) -> list[tuple[str, str]]:
    """What the page can do, and its keys; a browser keeps Ctrl with a digit to itself."""
    done = {*DONE, *HELD, *PRESSED, *BY_PAGE}
    able = [control for control in CONTROLS if any(actions.parse(action)[0] in done for action in control.keys)]
    shown = [(control.help, bindings.shown(*control.keys).replace("Ctrl", "Alt")) for control in able]
    rows = [(help, keys) for help, keys in shown if keys]  # the rest is on the panels alone
    return rows + [(help, ", ".join(key.upper() for key in keys)) for help, keys in OWN_KEYS.values()]


def _shaders() -> dict[str, str]:
    """The window's, which WebGL 2 takes as they are but for their first line."""
    return {
        name: text.replace(shaders.VERSION, VERSION)
        for name, text in (vars(shaders) | vars(body_shaders)).items()
        if isinstance(text, str) and text.startswith(shaders.VERSION)
    }


def _camera() -> dict[str, object]:
    usual = camera.Camera()
    names = (
        "PITCH_LIMITS DISTANCE_LIMITS AIM FOLLOW_HALF_LIFE LEAD LEAD_HALF_LIFE ORBIT_HALF_LIFE NEAR FAR ANKLES "
        "CLEARANCE"
    ).split()
    return {
        **{name: np.asarray(getattr(camera, name)).tolist() for name in names},
        **{name: getattr(usual, name) for name in ("yaw", "pitch", "distance", "field_of_view")},
    }


def _decals() -> dict[str, object]:
    names = "SHADE CONTACT ARROW_SECONDS RING_RADII SHADE_JOINTS".split()
    return {
        **{name: np.asarray(getattr(ground_decals, name)).tolist() for name in names},
        "WISH": colours.PATHS["asked"],
        "PREDICTED": colours.PATHS["predicted"],
        "PAST": colours.PATHS["walked"],
        "LAST": colours.PAST,
        "CONTACT_JOINTS": CONTACT_JOINTS.tolist(),
        "SKY_LIGHT": ground_mesh.SKY_LIGHT,
        "SUN_LIGHT": ground_mesh.SUN_LIGHT,
        "DARKEST": ground_mesh.DARKEST,
    }


def _colours() -> dict[str, object]:
    panel = {name.lower(): getattr(canvas, name) for name in "INK FAINT ACCENT ALERT BACKGROUND FIELD LIT".split()}
    scene = {name.lower(): getattr(colours, name) for name in "OWN_STYLE TWIN GHOST BONES".split()}
    return {"panel": {name: to_css(colour) for name, colour in panel.items()}, "scene": scene}


def _diagram() -> dict[str, object]:
    """The body from the front as discs (x, y, radius) of its five parts, and the size that they lie in."""
    discs = [[[round(value, 1) for value in disc] for disc in part] for part in diagram.discs()]
    return {"size": [diagram.WIDTH, diagram.HEIGHT], "discs": discs}


def to_css(colour: canvas.Colour) -> str:
    """`#123456`, or with its alpha as `#123456db`."""
    return to_hex(colour) + (bytes([round(255 * colour[3])]).hex() if len(colour) > 3 else "")
