"""A frame as it goes to the page, packed small: numbers of which the page knows the places (`layout`).

Rotations go as four 16-bit shares of a unit quaternion, places as 32-bit floats: 24 kB a second where 64-bit floats
would be 95, and no joint is drawn farther off than a hair's breadth (see tests/demo/serve/test_packet.py)."""

import numpy as np

from demo.figure.colours import part_colours, worn
from demo.render.ground_mesh import tangent_plane
from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, PART_NAMES
from sim.ground.ground import Ground
from sim.latency import STAGES, Latency
from sim.session import Frame

UNIT = 32767  # of a quaternion's share that is 1
MICROSECONDS = 10  # of a count of a stage's time
TIMED = tuple(stage for stage in STAGES if stage != "render")

FRAME = np.dtype(
    [
        ("number", "<u4"),  # of the frame
        ("answers", "<u4"),  # number of the newest input that it knows of
        ("root", "<f4", 3),
        ("hips", "<f4", 3),
        ("desired_velocity", "<f4", 2),
        ("plane", "<f4", 3),  # of the ground under it (demo.render.ground_mesh.tangent_plane)
        ("rotations", "<i2", (JOINT_COUNT, 4)),  # global, (w, x, y, z)
        ("times", "<u2", len(TIMED)),  # MICROSECONDS each
        ("facing", "<i2"),  # of the whole turn as 16 bits
        ("phase", "<u2"),
        ("contacts", "u1", 4),
        ("colours", "u1", (len(PART_NAMES), 3)),
        ("flags", "u1"),  # of FLAGS
    ]
)
TWIN = np.dtype([("hips", "<f4", 3), ("rotations", "<i2", (JOINT_COUNT, 4))])  # behind it, where the twin is seen
PATHS = np.dtype([("desired", "<f4", (5, 2)), ("predicted", "<f4", (5, 2))])  # behind that, where they are seen
FLAGS = {"playing": 1, "twin": 2, "paths": 4, "character": 8}


def layout() -> dict[str, object]:
    """What the page needs to read a packet: of each record its size, and the place, kind and count of each field."""
    return {
        "records": {name: _fields(kind) for name, kind in (("frame", FRAME), ("twin", TWIN), ("paths", PATHS))},
        "unit": UNIT,
        "flags": FLAGS,
        "timed": TIMED,
        "microseconds": MICROSECONDS,
    }


def pack(
    frame: Frame,
    number: int,
    answers: int = 0,
    latency: Latency | None = None,
    playing: bool = False,
    twin: bool = False,
    paths: tuple[np.ndarray, np.ndarray] | None = None,
    ground: Ground | None = None,
    bones: bytes = b"",
) -> bytes:
    """The bytes of a frame. answers: number of the newest input that it knows of; twin: with the neutral pose; paths:
    with the ways (5, 2) that are asked for and predicted; ground: what it stands on, None for level floor;
    bones: of the character that is seen (demo.serve.model_file), none for the figure."""
    record = np.zeros((), FRAME)
    styled = frame.styled
    record["number"], record["answers"] = number, answers
    record["root"], record["hips"], record["rotations"] = styled.root_position, styled.hips, _packed(styled)
    record["desired_velocity"] = frame.command.desired_velocity
    record["plane"] = tangent_plane(ground, styled.root_position[[0, 2]])
    record["facing"] = round(float(styled.root_facing) / np.pi * UNIT)
    record["phase"] = round(float(styled.phase) / (2 * np.pi) * 65535)
    record["contacts"] = np.round(np.clip(styled.contacts, 0, 1) * 255)
    record["colours"] = np.round(part_colours(worn(frame)) * 255)
    if latency:
        counts = [latency.last_ms(stage) * 1000 / MICROSECONDS for stage in TIMED]
        record["times"] = np.minimum(counts, 65535)
    seen = {"playing": playing, "twin": twin, "paths": paths is not None, "character": bool(bones)}
    record["flags"] = sum(FLAGS[name] for name, is_seen in seen.items() if is_seen)
    blocks = [record]
    if twin:
        blocks.append(np.array((frame.neutral.hips, _packed(frame.neutral)), TWIN))
    if paths is not None:
        blocks.append(np.array(paths, PATHS))
    return b"".join(block.tobytes() for block in blocks) + bones


def unpack_pose(rotations: np.ndarray) -> np.ndarray:
    """(21, 4) rotations of those of a record, as the page makes them."""
    q = rotations.astype(np.float32)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def _packed(pose: Pose) -> np.ndarray:
    return np.round(pose.rotations * UNIT).astype(np.int16)


def _fields(kind: np.dtype) -> dict[str, object]:
    fields = {}
    for name, (of, offset, *_) in (kind.fields or {}).items():
        base, shape = of.subdtype or (of, ())
        fields[name] = [offset, base.kind + str(8 * base.itemsize), int(np.prod(shape, dtype=int))]
    return {"size": kind.itemsize, "fields": fields}
