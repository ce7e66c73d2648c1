"""Motion in glTF 2.0 files (.glb, .gltf): the skeleton of one animation, as a general motion.

Sections are the specification's. Joints are given the axes of the world in the bind pose, so that the zero pose of the
motion is the one that the figure is modelled in."""

import warnings
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from sim.io.bvh import Motion
from sim.io.bvh_parser import MAX_JOINTS, MAX_SECONDS, POSITION_ORDER, ROTATION_ORDER, shorten
from sim.io.checks import count_names
from sim.io.gltf_file import GltfFile, reading_gltf, rest_of
from sim.io.gltf_schema import AGAIN
from sim.math import rotations as rot

KEY_RATES = (24, 25, 30, 50, 60, 90, 100, 120)  # frames a second: the one that the keys are nearest to is read
PATHS = {"translation": 3, "rotation": 4}
CUBIC = "CUBICSPLINE"


def read(path: str | Path, fps: float | None = None, animation: str | None = None) -> Motion:
    """The named animation of a glTF file, None for its longest, at the rate of its keys or at `fps`.

    Raises OSError, or ValueError, naming the file, for what is no glTF file with an animated skeleton."""
    path = Path(path)
    with reading_gltf(path):
        return _motion(GltfFile(path), animation, fps)


def _motion(file: GltfFile, name: str | None, fps: float | None) -> Motion:
    parents = file.parents
    animation, times = _chosen(file, name)
    joints = _joints(file, animation)
    fps = fps or _rate(times)
    frames = np.arange(int(max(each[-1] for each in times) * fps + 1e-6) + 1) / fps
    rest = [rest_of(file.nodes[joint]) for joint in joints]
    positions, rotations = (np.tile(np.array([each[which] for each in rest]), (len(frames), 1, 1)) for which in (0, 1))
    place = {joint: index for index, joint in enumerate(joints)}
    for channel in animation["channels"]:
        joint, kind = channel["target"].get("node"), channel["target"]["path"]
        if joint in place and kind in PATHS:
            sampler = animation["samplers"][channel["sampler"]]
            keys = times[channel["sampler"]]
            count = len(keys) * (3 if sampler.get("interpolation") == CUBIC else 1)
            values = file.numbers(sampler["output"], (PATHS[kind],), count, shares=True)
            sampled = _sampled(keys, values, sampler.get("interpolation"), frames, kind)
            (positions if kind == "translation" else rotations)[:, place[joint]] = sampled
    above = [place.get(parents[joint], -1) for joint in joints]
    positions *= _scales(file.nodes, joints, above)[:, None]
    names = [file.name(joint) for joint in joints]
    return _in_world_axes(names, above, positions, rotations, [turn for _, turn, _ in rest], fps)


def _chosen(file: GltfFile, name: str | None) -> tuple[dict[str, Any], list[np.ndarray]]:
    """The animation of a name, or the longest, with a warning where there are others; the times of its samplers."""
    animations = {
        str(each.get("name") or number): each for number, each in enumerate(file.document.get("animations", ()))
    }
    if not animations:
        raise ValueError(f"{file.path} holds no animation: export one with the skeleton")
    if name is not None and name not in animations:
        near = get_close_matches(name, animations, 3) or list(animations)
        raise ValueError(f"{file.path} has no animation '{shorten(name)}': there are {count_names(near, 10)}")
    times = {
        each: [file.numbers(sampler["input"], (1,))[:, 0] for sampler in animations[each]["samplers"]]
        for each in ([name] if name is not None else animations)
    }
    lasting = {each: max((float(keys[-1]) for keys in of_each), default=0.0) for each, of_each in times.items()}
    chosen = max(lasting, key=lambda each: lasting[each])
    if name is None and len(animations) > 1:
        warnings.warn(
            f"{file.path} holds {len(animations)} animations, of which the longest, '{shorten(chosen)}', is read; "
            f"name another as {file.path.name}#NAME: {count_names(animations, 10)}",
            stacklevel=5,
        )
    if not 0 <= lasting[chosen] <= MAX_SECONDS:
        raise ValueError(f"it lasts {lasting[chosen] / 60:.0f} minutes: cut it to {MAX_SECONDS // 60} at most")
    if any((np.diff(keys) < 0).any() for keys in times[chosen]):
        raise ValueError(f"its keys go back in time: {AGAIN}")
    return animations[chosen], times[chosen]


def _joints(file: GltfFile, animation: dict[str, Any]) -> list[int]:
    """The nodes of the animated skeleton, parents first: what the animation moves, what skins hang on, all above."""
    wanted = {channel["target"].get("node") for channel in animation["channels"] if channel["target"]["path"] in PATHS}
    wanted |= {joint for skin in file.document.get("skins", ()) for joint in skin["joints"]}
    depths: dict[int, int] = {}
    for node in [node for node in wanted if node is not None and 0 <= node < len(file.nodes)]:
        above = file.above(node)
        depths |= {each: len(above) - place for place, each in enumerate(above)}
    if not 0 < len(depths) <= MAX_JOINTS:
        raise ValueError(f"its animation moves no skeleton of at most {MAX_JOINTS} joints")
    return sorted(depths, key=lambda node: (depths[node], node))


def _rate(times: list[np.ndarray]) -> float:
    """The frame rate that the keys are set at, of the usual ones."""
    steps = np.concatenate([np.diff(each) for each in times] or [np.zeros(0)])
    steps = steps[steps > 1e-4]
    if not len(steps):
        return 30.0
    return float(min(KEY_RATES, key=lambda rate: abs(np.log(rate * np.median(steps)))))


def _sampled(
    times: np.ndarray, values: np.ndarray, interpolation: str | None, frames: np.ndarray, kind: str
) -> np.ndarray:
    """Values (frames, 3 or 4) of a sampler at times in seconds (sec. 3.11); quaternions in our order."""
    cubic = interpolation == CUBIC
    values = values.reshape(len(times), 3 if cubic else 1, PATHS[kind])
    if kind == "rotation":
        values = np.roll(values, 1, axis=-1)
    keys = values[:, 1 if cubic else 0]
    if kind == "rotation" and not cubic:
        keys = rot.make_continuous(rot.normalize(keys))
    if len(times) == 1:
        return np.tile(keys[0], (len(frames), 1))
    after = np.searchsorted(times, frames, side="right").clip(1, len(times) - 1)
    span = np.maximum(times[after] - times[after - 1], 1e-9)
    share = ((frames - times[after - 1]) / span).clip(0.0, 1.0)[:, None]
    first, last = keys[after - 1], keys[after]
    if interpolation == "STEP":
        result = np.where(share < 1.0, first, last)
    elif cubic:
        out, into = values[after - 1, 2] * span[:, None], values[after, 0] * span[:, None]
        s2, s3 = share**2, share**3
        result = (2 * s3 - 3 * s2 + 1) * first + (s3 - 2 * s2 + share) * out
        result += (3 * s2 - 2 * s3) * last + (s3 - s2) * into
    else:
        result = rot.slerp(first, last, share) if kind == "rotation" else first + share * (last - first)
    return rot.normalize(result) if kind == "rotation" else result


def _scales(nodes: list[dict[str, Any]], joints: list[int], above: list[int]) -> np.ndarray:
    """(J,) by how much the nodes above each joint scale its bone."""
    own = [float(np.mean(np.abs(np.array(nodes[joint].get("scale", 1.0), dtype=float)))) for joint in joints]
    result: list[float] = []
    for parent in above:
        result.append(result[parent] * own[parent] if parent >= 0 else 1.0)
    return np.array(result)


def _in_world_axes(
    names: list[str],
    above: list[int],
    positions: np.ndarray,
    rotations: np.ndarray,
    rest: list[np.ndarray],
    fps: float,
) -> Motion:
    """The motion with axes that lie as the world's do in the bind pose."""
    bind: list[np.ndarray] = []
    turned, moved = rotations.copy(), positions.copy()
    for joint, parent in enumerate(above):
        before = bind[parent] if parent >= 0 else rot.IDENTITY
        bind.append(rot.multiply(before, rest[joint]))
        turned[:, joint] = rot.multiply(rot.multiply(before, rotations[:, joint]), rot.inverse(bind[joint]))
        moved[:, joint] = rot.rotate(before, positions[:, joint])
    travels = np.ptp(moved, axis=0).max(axis=-1) > 0
    channels: list[tuple[str, ...]] = [
        POSITION_ORDER + ROTATION_ORDER if travels[joint] or parent < 0 else ROTATION_ORDER
        for joint, parent in enumerate(above)
    ]
    return Motion(names, above, np.median(moved, axis=0), {}, channels, fps, moved, turned)
