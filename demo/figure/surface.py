"""The skin as a surface: where a smooth union (log-sum-exp) of the distances to the forms is zero, in the bind pose."""

import numpy as np

from demo.figure import forms
from demo.figure.forms import BIND
from sim.body.skeleton import INDEX, JOINT_COUNT
from sim.math import rotations as rot

MELT, FINGER_MELT, WRIST_MELT = 0.017, 0.0025, 0.008  # metres: how softly forms, fingers, hand and arm run together
REACH = 0.09  # metres round a form beyond which it does not count
FAR = 1e-12  # in place of a nearness of nothing
STEP = 1e-3  # metres over which the surface's direction is measured
OPEN_AT = (0.008, 0.025, 0.05)  # metres from the skin at which is asked how free the way is
# Groups that melt each by itself, before they melt together: fingers do not grow together as limbs do.
_LEFT, _RIGHT = (forms.FORM_JOINT == INDEX[side + "Hand"] for side in ("Left", "Right"))
GROUPS = [
    (np.flatnonzero(~forms.IS_HAND).tolist(), MELT),
    (np.flatnonzero(_LEFT).tolist(), FINGER_MELT),
    (np.flatnonzero(_RIGHT).tolist(), FINGER_MELT),
]

# The forms in the bind pose: where each starts, and its axes.
_TURN = BIND.rotations[forms.FORM_JOINT]
_ORIGIN = BIND.positions[forms.FORM_JOINT] + rot.rotate(_TURN, forms.FORM_START)
_AXES = rot.rotate(_TURN[:, None], forms.form_frames())


def form_distance(form: int, points: np.ndarray) -> np.ndarray:
    """Signed distance (...) from points (..., 3) to one capsule; exact where it is neither tapered nor stretched."""
    local = (points - _ORIGIN[form]) @ (_AXES[form] / forms.FORM_STRETCH[form][:, None]).T
    length = forms.FORM_LENGTH[form]
    along = np.clip(local[..., 1], 0, length)
    gap = np.sqrt(local[..., 0] ** 2 + (local[..., 1] - along) ** 2 + local[..., 2] ** 2)
    radius = np.interp(along / length, forms.PROFILE, forms.FORM_RADII[form])
    return (gap - radius) * forms.FORM_STRETCH[form].min()


def _ends(form: int) -> np.ndarray:
    """(2, 3) the corners of the box outside of which a form does not count."""
    tip = _ORIGIN[form] + _AXES[form][1] * forms.FORM_LENGTH[form]
    thickness = forms.FORM_STRETCH[form].max() * forms.FORM_RADII[form].max() + REACH
    both = np.array([_ORIGIN[form], tip])
    return np.array([both.min(0) - thickness, both.max(0) + thickness])


def distance(points: np.ndarray) -> np.ndarray:
    """Melted distance (n,) at points (n, 3)."""
    near = np.full((len(GROUPS), len(points)), FAR)
    for group, (members, melt) in enumerate(GROUPS):
        for form in members:
            low, high = _ends(form)
            inside = np.flatnonzero(np.all((points > low) & (points < high), axis=-1))
            near[group, inside] += np.exp(-form_distance(form, points[inside]) / melt)
    return _melted([-melt * np.log(near[group]) for group, (_, melt) in enumerate(GROUPS)])


def _melted(groups: list[np.ndarray]) -> np.ndarray:
    """The union (...) of the groups' distances, as soft as a wrist."""
    return -WRIST_MELT * np.log(sum(np.exp(-np.minimum(each, 0.5) / WRIST_MELT) for each in groups))


def grid_distance(axes: list[np.ndarray]) -> np.ndarray:
    """Melted distance on a grid: each form is only asked about the block round it."""
    groups = []
    for members, melt in GROUPS:
        near = np.full([len(axis) for axis in axes], FAR)
        for form in members:
            block = tuple(slice(*np.searchsorted(axis, pair)) for axis, pair in zip(axes, _ends(form).T, strict=True))
            sides = [axis[part] for axis, part in zip(axes, block, strict=True)]
            points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
            near[block] += np.exp(-form_distance(form, points) / melt)
        groups.append(-melt * np.log(near))
    return _melted(groups)


def direction(points: np.ndarray) -> np.ndarray:
    """(n, 3) the direction of steepest growth of the distance at points (n, 3): the skin's normal."""
    return rot.normalize(
        np.stack([distance(points + offset) - distance(points - offset) for offset in STEP * np.eye(3)], axis=-1)
    )


def project(points: np.ndarray) -> np.ndarray:
    """Points (n, 3) near the surface moved onto it."""
    for _ in range(3):
        points = points - direction(points) * distance(points)[:, None]
    return points


def openness(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(n,) 0..1 how much light the folds of the skin in the bind pose let reach points on it."""
    return np.mean([np.clip(distance(points + step * normals) / step, 0, 1) for step in OPEN_AT], axis=0)


def joint_distance(points: np.ndarray) -> np.ndarray:
    """(n, 21) metres from points (n, 3) to the nearest form of each joint."""
    nearest = np.full((len(points), JOINT_COUNT), np.inf)
    for form, joint in enumerate(forms.FORM_JOINT):
        nearest[:, joint] = np.minimum(nearest[:, joint], form_distance(form, points))
    return nearest
