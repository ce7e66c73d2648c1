"""The figure's mesh: `python -m demo.tools.figure_mesh` makes it from the table of forms and writes the file that the
figure is read from."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from demo.figure import forms, simplify, skin, surface
from demo.figure.surface_nets import surface_nets
from sim.body.skeleton import INDEX, JOINT_COUNT, JOINTS, MIRROR, PART_OF_JOINT
from sim.io.provenance import commit
from sim.math import rotations as rot

CELL = 0.0035  # metres of the grid that the surface is cut from
# Of each level: metres that an edge may be off the surface, and its shortest and longest length.
LEVELS = {"fine": (0.00045, 0.0050, 0.022), "medium": (0.00105, 0.0078, 0.030), "coarse": (0.0050, 0.024, 0.065)}
ROUNDS = 4  # of flips and evening out after each level
# Metres over which one joint's hold on the skin passes into the next, by what the joint's name ends with.
HOLD = {"Hand": 0.010, "Toe": 0.010, "Foot": 0.014, "ForeArm": 0.018, "Leg": 0.022, "UpLeg": 0.030, "Arm": 0.026}
TRUNK_HOLD = 0.042
COLLAR = np.array([name.endswith("Shoulder") for name in JOINTS])  # sleeves end at the arms themselves
CLOTH = 0.024  # metres to either side of a seam over which the share of a cloth goes from 1 to 0


def make() -> dict[str, skin.Skin]:
    """The skins by level."""
    positions, triangles = half_surface()
    normals = surface.direction(positions)
    bend = curvature(positions, normals, triangles)
    mesh = simplify.Mesh(positions, normals, np.ones(len(positions)), triangles)
    result = {}
    for level, (off, shortest, longest) in LEVELS.items():
        mesh.lengths = np.clip(np.sqrt(8 * off / np.maximum(bend, 1.0)), shortest, longest)
        mesh.collapse()
        for _ in range(ROUNDS):
            mesh.flip_edges()
            mesh.even_out()
            _settle(mesh)
        result[level] = dress(mesh)
    return result


def half_surface() -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 3) and triangles (m, 3) of the left half of the body, its border on the plane x = 0."""
    low, high = forms.BIND.positions.min(0) - 0.3, forms.BIND.positions.max(0) + 0.3
    axes = [np.arange(a, b, CELL) for a, b in zip((0.0, *low[1:]), high, strict=True)]
    corners, quads = surface_nets(surface.grid_distance(axes))
    positions = np.array([axis[0] for axis in axes]) + corners * CELL
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    positions = _on_surface(positions, _border(triangles, len(positions)))
    return positions, triangles


def _border(triangles: np.ndarray, count: int) -> np.ndarray:
    """(n,) which corners lie on an edge of one triangle only."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    result = np.zeros(count, bool)
    result[edges[uses == 1]] = True
    return result


def _on_surface(positions: np.ndarray, border: np.ndarray) -> np.ndarray:
    positions = np.where(border[:, None], positions * [0.0, 1, 1], positions)
    positions = surface.project(positions)
    return np.where(border[:, None], positions * [0.0, 1, 1], positions)


def _settle(mesh: simplify.Mesh) -> None:
    """The corners that are left back onto the surface, with its normals."""
    used = np.unique(mesh.kept())
    mesh.positions[used] = _on_surface(mesh.positions[used], mesh.on_plane[used])
    mesh.normals[used] = surface.direction(mesh.positions[used])


def curvature(positions: np.ndarray, normals: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n,) one over the metres of radius of the tightest bend about each corner, its neighbours' counted as well."""
    result = np.zeros(len(positions))
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    apart = np.linalg.norm(normals[pairs[:, 1]] - normals[pairs[:, 0]], axis=-1)
    bend = apart / np.maximum(np.linalg.norm(positions[pairs[:, 1]] - positions[pairs[:, 0]], axis=-1), CELL / 4)
    for _ in range(2):
        for column in (0, 1):
            np.maximum.at(result, pairs[:, column], bend)
        bend = np.maximum(result[pairs[:, 0]], result[pairs[:, 1]]) * 0.9
    return result


def dress(mesh: simplify.Mesh) -> skin.Skin:
    """The whole skin of a half: mirrored, tied to the joints, with its cloth."""
    used, triangles = mesh.compact()
    positions, normals = mesh.positions[used], mesh.normals[used]
    away = surface.joint_distance(positions)
    joints = away.argmin(axis=1)
    materials = np.column_stack([_cloth_shares(away), surface.openness(positions, normals)])
    middle = mesh.on_plane[used]
    twins = np.where(middle, np.arange(len(used)), len(used) + np.cumsum(~middle) - 1)
    other = ~middle
    flip = np.array([-1.0, 1, 1])
    # of the middle line half the joints would be left ones: those of the midline alone hold it
    joints = np.where(middle & (MIRROR[joints] != joints), INDEX["Hips"], joints)
    positions = np.concatenate([positions, positions[other] * flip])
    normals = np.concatenate([normals, normals[other] * flip])
    joints = np.concatenate([joints, MIRROR[joints[other]]])
    swapped = [1, 0, 3, 2, 4, 5]  # left leg, right leg, left arm, right arm, gloves and shoes, openness
    materials = np.concatenate([materials, materials[other][:, swapped]])
    triangles = np.concatenate([triangles, twins[triangles][:, ::-1]])
    hold = np.array(
        [next((HOLD[e] for e in HOLD if name.endswith(("Left" + e, "Right" + e))), TRUNK_HOLD) for name in JOINTS]
    )
    weights = spread(positions, triangles, np.eye(JOINT_COUNT)[joints], hold[joints])
    order = np.argsort(-weights, axis=1)[:, : skin.TIES]
    strongest = np.take_along_axis(weights, order, axis=1)
    strongest = np.where(strongest < skin.SLACK, 0.0, strongest)
    return skin.Skin(
        positions,
        rot.normalize(normals),
        order,
        strongest / strongest.sum(axis=1, keepdims=True),
        triangles,
        materials,
    )


def _cloth_shares(away: np.ndarray) -> np.ndarray:
    """(n, 5) shares of the four limbs, and of gloves and shoes, 0 .. 1, from the metres (n, 21) to each joint's forms:
    a half on the seam, where two cloths are as near."""
    cloths = [*(PART_OF_JOINT == limb for limb in skin.LIMBS), forms.IS_GLOVE > 0]
    shares = []
    for own in cloths:
        within, beyond = (away[:, which & ~COLLAR].min(axis=1) for which in (own, ~own))
        shares.append(np.clip(0.5 + (beyond - within) / (2 * CLOTH), 0, 1))
    return np.column_stack(shares)


def spread(positions: np.ndarray, triangles: np.ndarray, values: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Values (n, k) at the corners spread over the skin, as heat would, `reach` (n,) metres far."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    a, b = np.concatenate([pairs, pairs[:, ::-1]]).T
    # Half a Laplacian from edges alone: corners lie evenly, so an edge counts by one over the square of its length.
    flow = ((reach[a] + reach[b]) / 2) ** 2 / np.sum((positions[a] - positions[b]) ** 2, axis=-1) / 3
    count = len(positions)
    graph = sparse.csr_matrix((flow, (a, b)), (count, count))
    graph = graph / 2  # every edge is in two triangles
    steps = 3
    system = sparse.identity(count) + (sparse.diags(np.asarray(graph.sum(axis=1)).ravel()) - graph) / steps
    solve = splu(system.tocsc()).solve
    for _ in range(steps):
        values = solve(values)
    return values


def write() -> None:
    """Makes the skins and writes them."""
    skin.write(make(), {"command": "python -m demo.tools.figure_mesh", "commit": commit()})


if __name__ == "__main__":
    write()
