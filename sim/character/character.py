"""The user's own character: its skeleton told by names, shape or VRM's table, its rest pose aligned with ours.

Everything of it is turned so that it faces +Z, moved so that it stands on a floor at 0, and scaled so that its legs are
as long as ours: strides, speeds and heights then fit as they are, and `scale` gives its own size back. In that frame a
joint turns as one of ours does: its rotation away from the rest pose is ours times a constant (as in sim/retarget)."""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from sim.body.limb_ik import LEG_LENGTH
from sim.body.skeleton import INDEX, JOINT_COUNT, JOINTS, PARENTS
from sim.character.mesh import SkinnedMesh, read_mesh
from sim.character.pictures import warn_of_lost
from sim.character.rig import Rig, read_rig
from sim.character.soles import Sole, find_sole
from sim.io.bvh import Motion
from sim.io.bvh_parser import POSITION_ORDER, ROTATION_ORDER, shorten
from sim.io.checks import count_names
from sim.io.gltf_file import ENDINGS, GltfFile, reading_gltf
from sim.math import rotations as rot
from sim.math.vectors import FORWARD, UP
from sim.motion.clip import FPS
from sim.retarget import joint_names
from sim.retarget.axis_alignment import align, find_alignment
from sim.retarget.plausibility import SIDES
from sim.retarget.source_skeleton import SourceBody

# A joint between two of ours turns by a share of the way from the one to the other, where nothing else hangs on it.
BETWEEN = (("Spine", "Chest"), ("Neck", "Head"))
ROOT = JOINT_COUNT  # in `owners`: the character's own ground frame, which what is above the hips follows
LEGS = (1e-4, 1e4)  # metres of the file, shortest and longest: whatever unit was taken for metres lies between
FARTHEST = 100.0  # leg lengths from the hips, of a joint or a corner
THUMB = re.compile("thumb", re.IGNORECASE)
LEAST_ROLL, MOST_ROLL = np.radians((35.0, 120.0))  # of a hand whose thumb does not point forwards, to be rolled


@dataclass(frozen=True)
class Character:
    """A skinned humanoid in the rest pose.

    rest: (J, 3) joints; index: our joint -> theirs; constants: (22, 4) what comes before each of our rotations, the
    last that of the ground frame; owners: (J, 2) which two of these a joint follows, and shares (J,) how far it is on
    the way from the first to the second; mesh: in the same frame; turn: (4,) from the file's axes; scale: metres of the
    file to one here; floor: (3,) of the file where the character stands; soles: left and right; notes: sentences about
    what was mended or guessed."""

    path: Path
    file: GltfFile
    rig: Rig
    mesh: SkinnedMesh
    index: dict[str, int]
    rest: np.ndarray
    constants: np.ndarray
    owners: np.ndarray
    shares: np.ndarray
    soles: tuple[Sole, Sole]
    turn: np.ndarray
    scale: float
    floor: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The file's, without its ending."""
        return self.path.stem

    @property
    def joint_names(self) -> tuple[str, ...]:
        """(J) of the file."""
        return tuple(self.rig.names)

    @property
    def height(self) -> float:
        """Metres from the floor to the top of its mesh, in its rest pose and at the size that is drawn."""
        return float(self.mesh.positions[:, 1].max())

    @cached_property
    def under_hips(self) -> np.ndarray:
        """(J, J): 1 where a bone lies between the hips and a joint; rows of joints that do not hang on them are 0."""
        hips, count = self.index["Hips"], len(self.rest)
        result = np.zeros((count, count))
        for joint in range(count):
            chain, each = [], joint
            while each not in (hips, -1):
                chain.append(each)
                each = int(self.rig.parents[each])
            if each == hips:
                result[joint, chain] = 1.0
        return result

    @cached_property
    def hangs(self) -> np.ndarray:
        """(J,) whether a joint is the hips or hangs on them."""
        result: np.ndarray = np.any(self.under_hips, axis=-1, keepdims=False)
        result[self.index["Hips"]] = True
        return result


def load_character(path: str | Path, name_map: dict[str, str] | None = None) -> Character:
    """A skinned humanoid of a glTF or VRM file (.glb, .gltf, .vrm).

    name_map: our joint -> theirs (sim.retarget.joint_names.load); None: told by VRM's table, by names or by shape.
    Raises OSError, or ValueError in one sentence that says what is missing."""
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"{path} is no character: one is a skinned figure as .glb, .gltf or .vrm")
    with reading_gltf(path):
        return _character(path, GltfFile(path), name_map)


def _character(path: Path, file: GltfFile, name_map: dict[str, str] | None) -> Character:
    rig = read_rig(file)
    body = SourceBody(_standing(rig), name_map or vrm_joints(file, rig))
    if body.mirrored:
        raise ValueError("its knees bend backwards: it is mirrored; mirror it back, then export it again")
    constants = {name: rot.multiply(body.turn, constant) for name, constant in find_alignment(body).items()}
    upright = constants["Hips"]
    # As the file has it, `body` turned upright; from here on it faces +Z as well.
    turn = rot.multiply(rot.inverse(upright), body.turn)
    constants = {name: rot.multiply(rot.inverse(upright), constant) for name, constant in constants.items()}
    scale = _scale(body)
    rest = rot.rotate(turn, rig.positions) / scale
    far = np.linalg.norm(rest - rest[body.index["Hips"]], axis=-1)
    if far.max() > FARTHEST * LEG_LENGTH:
        name, much = shorten(rig.names[int(far.argmax())]), far.max() / LEG_LENGTH
        raise ValueError(f"its joint '{name}' lies {much:.0f} leg lengths from its hips: put it right, or leave it out")
    mesh = read_mesh(file, rig)
    file.check_views()  # all of it, for a written .glb holds all of it
    warn_of_lost(file)
    corners = rot.rotate(turn, mesh.positions) / scale
    reach = np.abs(corners - rest[body.index["Hips"]]).max() / LEG_LENGTH
    if not reach <= FARTHEST:
        raise ValueError(
            f"its mesh reaches {reach:.0f} leg lengths from its hips: apply all scales, then export it again"
        )
    owners, shares = _owners(rig, body.index)
    soles = [find_sole(side, body.index, rest, corners, mesh, owners) for side in SIDES]
    middle = (rest[body.index["LeftUpLeg"]] + rest[body.index["RightUpLeg"]]) / 2
    floor = np.array([middle[0], min(sole.floor for sole in soles), middle[2]])
    for side in SIDES:
        _lay_sole(side, body.index, rest, constants)
        _roll_palm(side, rig, body.index, rest, constants)
    inverses = np.tile(rot.IDENTITY, (JOINT_COUNT + 1, 1))
    for ours, joint in INDEX.items():
        known = ours if ours in constants else JOINTS[PARENTS[joint]]
        inverses[joint] = rot.inverse(constants[known]) if known in constants else rot.IDENTITY
    return Character(
        path,
        file,
        rig,
        mesh=replace(mesh, positions=corners - floor, normals=rot.rotate(turn, mesh.normals)),
        index=body.index,
        rest=rest - floor,
        constants=inverses,
        owners=owners,
        shares=shares,
        soles=(soles[0], soles[1]),
        turn=turn,
        scale=scale,
        floor=rot.rotate(rot.inverse(turn), floor * scale),
        notes=tuple(body.notes),
    )


def _scale(body: SourceBody) -> float:
    """Metres of the file to one of ours. Raises ValueError for a size that is a mistake in any unit."""
    leg = body.leg_length()
    if not LEGS[0] <= leg <= LEGS[1]:
        raise ValueError(
            f"its legs are {leg:.3g} m long: glTF counts in metres; scale it to a person's size, then export"
        )
    return leg / LEG_LENGTH


def _standing(rig: Rig) -> Motion:
    """The rest pose as a motion of one frame, joints with the axes of the world."""
    offsets = rig.positions.copy()
    below = rig.parents >= 0
    offsets[below] -= rig.positions[rig.parents[below]]
    channels: list[tuple[str, ...]] = [POSITION_ORDER + ROTATION_ORDER] * len(offsets)
    still = np.tile(rot.IDENTITY, (1, len(offsets), 1))
    return Motion(rig.names, rig.parents.tolist(), offsets, {}, channels, FPS, offsets[None], still)


def vrm_joints(file: GltfFile, rig: Rig) -> dict[str, str] | None:
    """Our joint -> theirs by the humanoid table of VRM 0.x or 1.0; None where the file has none."""
    extensions = file.document.get("extensions", {})
    if "VRMC_vrm" in extensions:
        table = {bone: entry["node"] for bone, entry in extensions["VRMC_vrm"]["humanoid"]["humanBones"].items()}
    elif "VRM" in extensions:
        table = {entry["bone"]: entry["node"] for entry in extensions["VRM"]["humanoid"]["humanBones"]}
    else:
        return None
    joint_of = {int(node): joint for joint, node in enumerate(rig.nodes)}
    known = {bone: rig.names[joint_of[node]] for bone, node in table.items() if node in joint_of}
    try:
        return {ours: known[bone] for ours, bone in joint_names.detect(list(known)).items()}
    except ValueError:
        raise ValueError(f"VRM's table of its bones is not whole: it names {count_names(known, 30)}") from None


def _owners(rig: Rig, index: dict[str, int]) -> tuple[np.ndarray, np.ndarray]:
    """Which of our joints each of theirs follows, (J, 2), and its share (J,) of the second."""
    ours_of = {joint: name for name, joint in index.items()}
    owners, shares = np.full((len(rig.names), 2), ROOT), np.zeros(len(rig.names))
    for joint, parent in enumerate(rig.parents.tolist()):
        if joint in ours_of:
            owners[joint] = INDEX[ours_of[joint]]
        elif parent >= 0:
            owners[joint] = owners[parent, 0]
    for first, second in BETWEEN:
        if first not in index or second not in index:
            continue
        chain, each = [], int(rig.parents[index[second]])
        while each >= 0 and each != index[first]:
            chain.append(each)
            each = int(rig.parents[each])
        if each < 0:
            continue
        for place, joint in enumerate(reversed(chain), 1):
            riders = [each for each, _ in enumerate(owners) if each == joint or _rides(rig, each, joint, ours_of)]
            owners[riders] = INDEX[first], INDEX[second]
            shares[riders] = place / (len(chain) + 1)
    return owners, shares


def _rides(rig: Rig, joint: int, carrier: int, ours_of: dict[int, str]) -> bool:
    """Whether an unmapped joint hangs on a carrier with no mapped one between."""
    while joint >= 0 and joint not in ours_of:
        if joint == carrier:
            return True
        joint = int(rig.parents[joint])
    return False


def _lay_sole(side: str, index: dict[str, int], rest: np.ndarray, constants: dict[str, np.ndarray]) -> None:
    """Feet stand flat in the rest pose, and their toes point where ours do."""
    foot, toe = side + "Foot", side + "Toe"
    ahead = rest[index[toe]] - rest[index[foot]] if toe in index else rot.rotate(constants[foot], FORWARD)
    constants[foot] = align(UP, FORWARD, UP, ahead)
    if toe in index:
        constants[toe] = constants[foot]


def _roll_palm(side: str, rig: Rig, index: dict[str, int], rest: np.ndarray, constants: dict[str, np.ndarray]) -> None:
    """Rolls a hand whose thumb does not point forwards as ours does while the arm is held out, its palm down."""
    hand, forearm = index[side + "Hand"], index[side + "ForeArm"]
    thumb = next((j for j, name in enumerate(rig.names) if THUMB.search(name) and int(rig.parents[j]) == hand), None)
    if thumb is None:
        return
    tip = next((j for j, parent in enumerate(rig.parents.tolist()) if parent == thumb), thumb)
    along = rot.normalize(rest[hand] - rest[forearm])
    across = rest[tip] - rest[hand]
    across = across - along * (across @ along)
    forward = rot.rotate(constants[side + "Hand"], FORWARD)
    forward = forward - along * (forward @ along)
    roll = float(np.arctan2(rot.cross(forward, across) @ along, forward @ across))
    if LEAST_ROLL < abs(roll) < MOST_ROLL:
        constants[side + "Hand"] = rot.multiply(rot.from_axis_angle(along, roll), constants[side + "Hand"])
        half = rot.from_axis_angle(along, roll / 2)  # the forearm takes half of it, so that no wrist is wrung
        constants[side + "ForeArm"] = rot.multiply(half, constants[side + "ForeArm"])
