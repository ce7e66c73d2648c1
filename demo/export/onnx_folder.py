"""The folder of `patchwalk export onnx`: graphs, their states at the start, what every tensor is, and a player."""

import json
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from demo.export import onnx_graphs, onnx_state, onnx_styles
from demo.export.onnx_operators import UNSET
from demo.export.onnx_recorder import Graph
from sim.body.pose import PLACES, SHAPES
from sim.body.skeleton import BONE_OFFSETS, GROUPS, JOINTS, PARENTS, PART_NAMES, skeleton_hash
from sim.command import GAIT_SPEEDS
from sim.ground.ground import Ground
from sim.io.atomic_write import atomic_write
from sim.motion.clip import FPS
from sim.session import Session

FORMAT = "patchwalk-onnx-1"
PLAYER, TABLE, GROUND = "player.py", "graphs.json", "ground.npz"


class Part(NamedTuple):
    """One file of the folder: the graph it is cut from, which ground it is for, and which outputs it makes."""

    name: str
    graph: Graph
    state: onnx_state.State
    ground: str
    what: str
    outputs: list[str]


# What each input and output is: shape is the graph's own.
MEANINGS = {
    "state": "what this graph kept of the last frame: its `state` file at the start, then its own `next_state`",
    "next_state": "what this graph is given as `state` in the next frame",
    "paces": "speed and playback rate that the styles of the legs ask for in each gait, as the stylizer said last",
    "gait": "number of the gait in `gaits`",
    "follow": "1 where the styles of the legs set the pace, 0 where the stick alone does",
    "stride": "what the root's step is multiplied by, as the feet said last",
    "pace": "what the stick's velocity is multiplied by, the playback rate, what the root's step is multiplied by",
    "advances": "how often the controller is to be run in this frame: 0, 1 or 2",
    "clock": "0..1 from the last pose of the controller but one to the last",
    "desired_velocity": "what the stick asks: world x and z, m/s, the stick times the gait's speed",
    "around": "m, how high the blurred ground is at `around` of this file, x and z in m from the root",
    "heading": "where it is to face: world x and z, of any length; zeros for no wish",
    "crouch": "1 to crouch",
    "jump": "1 in the frame in which the jump is pressed",
    "moved": "the root's way over the floor since the last frame: x and z, m; the player adds it up",
    "poses": "of the controller's last three frames, laid out as `pose`, over the ground under the root",
    "predicted": "what the network expects in 1/6, 2/6 .. 5/6 s: x and z in m from the root, yaw in radians",
    "root_heights": "the blurred ground under the root at the controller's last three frames, m; zeros on level floor",
    "request": "of each body part: number of the style in `styles` (-1: fade out), strength 0..1.5, number of the "
    "other style (-1: none), share 0..1",
    "neutral": "the neutral pose, laid out as `pose`",
    "neutral_positions": "its joints, m from the root's place over the floor",
    "styled": "the styled pose, laid out as `pose`, before its feet are put in order",
    "legs": "how far the left and the right leg are styled",
    "positions": "of the joints, m from the root's place over the floor",
    "rotations": "of the joints in the world, quaternions w, x, y, z",
    "local_rotations": "of the joints against their parents, the hips' in the world",
    "root_position": "m from the root's place over the floor: only y is not 0",
    "root_facing": "yaw, radians: 0 faces +Z, a quarter turn +X",
    "contacts": "0..1 of left ankle, left toe, right ankle, right toe",
    "phase": "of the stride, radians",
}


def write_folder(folder: Path, session: Session, ground: Ground, double: bool = False) -> list[Path]:
    """Writes the models of a session, in single or in double precision, and a ground to try them on; the paths. Raises
    ValueError for a stylizer that cannot be exported, OSError for a folder that cannot be written."""
    table = onnx_styles.tabulate(session.stylizer)
    folder.mkdir(parents=True, exist_ok=True)
    parts = _parts(session, table, double)
    paths = []
    for part in parts:
        model = part.graph.model(part.outputs, part.what)
        paths.append(_replace(folder / f"{part.name}.onnx", model.SerializeToString()))
        paths.append(_replace(folder / _state_file(part), _start(part).tobytes()))
    paths.append(_replace(folder / TABLE, (json.dumps(_about(session, table, parts), indent=1) + "\n").encode()))
    write_ground(folder / GROUND, ground)
    shutil.copyfile(Path(__file__).with_name("onnx_player.py"), folder / PLAYER)
    return list(dict.fromkeys([*paths, folder / GROUND, folder / PLAYER]))


def write_ground(path: Path, ground: Ground) -> None:
    """Writes a ground as the player's HeightMap reads it."""
    tables = {"heights": ground.heights, "smooth_heights": ground.blurred}
    with atomic_write(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, cell=ground.cell, tiled=ground.tiled, **tables)  # type: ignore[arg-type]


def _replace(path: Path, content: bytes) -> Path:
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)
    return path


def _parts(session: Session, table: onnx_styles.StyleTable, double: bool) -> list[Part]:
    """All files: each graph whole, and for uneven ground also what of it says where the ground is to be looked at."""
    controller: Any = session.controller
    recorded = [
        ("pace", onnx_graphs.record_pace(double), "any"),
        ("stylizer", onnx_graphs.record_stylizer(table, double), "any"),
        *(
            (name + suffix, record(uneven), ground)
            for name, record in (
                ("controller", lambda uneven: onnx_graphs.record_controller(controller, uneven, double)),
                ("feet", lambda uneven: onnx_graphs.record_feet(uneven, double)),
            )
            for uneven, suffix, ground in ((False, "", "flat"), (True, "_uneven", "uneven"))
        ),
    ]
    parts = []
    for name, (graph, state, what), ground in recorded:
        asked = [output for output in graph.outputs if output.startswith("places_of_")]
        parts.append(Part(name, graph, state, ground, what, [o for o in graph.outputs if o not in asked]))
        if asked:
            where = f"The places, m from the root's, at which {name} wants to know the ground."
            parts.append(Part(name.replace("uneven", "places"), graph, state, ground, where, asked))
    return parts


def _state_file(part: Part) -> str:
    """Level and uneven graphs keep the same."""
    return part.name.partition("_")[0] + ".state"


def _start(part: Part) -> np.ndarray:
    return np.nan_to_num(part.state.numbers, nan=UNSET).astype(part.graph.kinds["f"].newbyteorder("<"))


def _about(session: Session, table: onnx_styles.StyleTable, parts: list[Part]) -> dict[str, Any]:
    """The contents of graphs.json."""
    bank = table.stylizer.bank
    return {
        "format": FORMAT,
        "made_from": {
            "controller": session.controller.fingerprint,
            "stylizer": bank.fingerprint,
            "skeleton": skeleton_hash(),
        },
        "numbers": parts[0].graph.kinds["f"].name,
        "fps": FPS,
        "axes": "metres; +Y up, +Z forwards at yaw 0, +X to the character's left: right-handed; quaternions w, x, y, z",
        "unset": UNSET,
        "joints": JOINTS,
        "parents": PARENTS.tolist(),
        "bone_offsets": BONE_OFFSETS.tolist(),
        "around": onnx_state.AROUND.tolist(),
        "parts": PART_NAMES,
        "groups": GROUPS,
        "gaits": GAIT_SPEEDS,
        "styles": [
            {"name": name, "licence": bank.licences.get(name, ""), "movements": bank[name].gait.movements}
            for name in table.names
        ],
        "pose": [{"name": name, "first": PLACES[name].start, "shape": shape} for name, shape in SHAPES.items()],
        "order": [
            "pace",
            "controller, `advances` times (on uneven ground: controller_places, look at the ground, controller_uneven)",
            "stylizer",
            "feet (on uneven ground: feet_places, look at the ground, feet_uneven)",
        ],
        "graphs": {
            part.name: {
                "file": f"{part.name}.onnx",
                "what": part.what,
                "ground": part.ground,
                "state": _state_file(part),
                "inputs": _tensors(part, part.graph.needed(part.outputs)),
                "outputs": _tensors(part, {name: part.graph.shapes[name] for name in part.outputs}),
                "state_layout": part.state.layout,
            }
            for part in parts
        },
    }


def _tensors(part: Part, shapes: dict[str, tuple[int, ...]]) -> list[dict[str, Any]]:
    return [{"name": name, "shape": shape, "what": _meaning(name)} for name, shape in shapes.items()]


def _meaning(name: str) -> str:
    kind = "the blurred ground, which the body follows," if "smooth" in name else "the ground"
    if name.startswith("places_of_"):
        return f"x and z, m from the root's place, at which {kind} is asked for as `{name.removeprefix('places_of_')}`"
    return f"m, how high {kind} is at `places_of_{name}`" if "heights_" in name else MEANINGS[name]
