"""Pictures of what the stylizer does, after Fig. 9, 11 and 12 of the paper: stick figures walking from left to
right."""

from functools import partial
from pathlib import Path
from typing import Collection, Mapping

import matplotlib
import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.body.skeleton import PARENTS, PART_NAMES, PART_OF_JOINT, expand_part
from sim.io.atomic_write import atomic_write
from sim.math import rotations as rot
from sim.motion.clip import Clip, root_frame
from sim.motion.features import LAYOUT, STRIDE, WINDOW, clip_features
from sim.retarget.retarget import load_clip
from stylizer.runtime.offline import ResolvedStyle, encode_clip, stylize
from stylizer.styles import bundled_styles
from stylizer.styles.clip_table import CLIPS
from stylizer.styles.style_clips import StyleClips
from stylizer.systems import checkpoint
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.style_tensors import take_batch

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402 - after the choice of a backend that needs no display

SOURCE, TARGET, OUTPUT, TOUCHED = "#8a949e", "#d49a1f", "#2c5f8a", "#c8372d"
NEAR, FAR = 1.0, 0.55  # opacity of the limbs on the viewer's side, and of the others
VIEW = np.radians(-60)  # the walkers are seen from their left, a little from in front
POSES, APART = 8, 0.75  # figures in a row, and the metres between them
SECONDS = 1.3  # of motion in a row
START = 0.35  # share of a clip that is let go by first
CONTENT = "accad/Male1_B3_Walk.bvh"  # the walk that is restyled


def save_pictures(folder: Path, data_dir: Path) -> list[Path]:
    """Draws all pictures into a folder, made if missing. Raises ValueError or OSError where clips or folder do not
    serve."""
    read = {name: bundled_styles.read_clip(data_dir, clips[0]) for name, clips in CLIPS.items()}
    clips = {name: clip for name, clip in read.items() if clip}
    content_path = bundled_styles.find_clip(data_dir, CONTENT)
    if len(clips) < 2 or not content_path:
        raise ValueError(f"{data_dir} lacks {CONTENT} or the clips of the bundled styles: unpack the archives there")
    model, _ = checkpoint.load()
    content = load_clip(content_path)
    styles = {name: encode_clip(model, clip_features(clip)) for name, clip in clips.items()}
    drawings = {
        "interpolation": lambda: draw_interpolation(model, content, styles),
        "locality": lambda: draw_locality(model, content, styles, clips),
    }
    for part in ("left_leg", "left_arm") if model.config.attention else ():
        drawings[f"attention-{part}"] = partial(draw_attention, model, content, styles, part)
    for name, style in styles.items():
        drawings[f"style-{name}"] = partial(draw_strip, model, content, clips[name], style, name)
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in drawings.items():
        figure = draw()
        with atomic_write(folder / f"{name}.png") as temporary:
            figure.savefig(temporary, dpi=90)
        plt.close(figure)
    return [folder / f"{name}.png" for name in drawings]


def draw_strip(model: JointPuzzle, content: Clip, clip: Clip, style: StyleClips, name: str) -> Figure:
    """Neutral walk, style clip and output, a row each."""
    output = stylize(model, content, dict.fromkeys(PART_NAMES, ResolvedStyle(style)))
    return _rows({"neutral": (content, SOURCE), f"{name} (clip)": (clip, TARGET), "output": (output, OUTPUT)})


def draw_interpolation(model: JointPuzzle, content: Clip, styles: Mapping[str, StyleClips]) -> Figure:
    """From one style to another in five steps (Fig. 12), whole body and arms alone."""
    first, other = _two(styles)
    figure, panels = plt.subplots(2, 5, figsize=(11, 5), layout="constrained")
    for row, group in zip(panels, ("all", "arms")):
        for axes, share in zip(row, np.linspace(0, 1, 5)):
            output = stylize(
                model,
                content,
                {part: ResolvedStyle(styles[first], 1.0, styles[other], share) for part in expand_part(group)},
            )
            touched = set(expand_part(group))
            _row(axes, output, OUTPUT, TOUCHED, touched if group != "all" else set(), count=2)
            axes.set_title(f"{group}: {1 - share:.0%} {first}, {share:.0%} {other}", fontsize=8)
    return figure


def draw_locality(
    model: JointPuzzle, content: Clip, styles: Mapping[str, StyleClips], clips: Mapping[str, Clip]
) -> Figure:
    """One style on one part of the body at a time (Fig. 11), what is restyled in red."""
    _, name = _two(styles)
    figure, panels = plt.subplots(2, 4, figsize=(14, 5.4), layout="constrained")
    shown: list[tuple[str, Clip, str, set[str]]] = [
        ("source", content, SOURCE, set()),
        (f"{name} (clip)", clips[name], TARGET, set()),
    ]
    for group in (*PART_NAMES, "all"):
        touched = set(expand_part(group))
        output = stylize(model, content, {part: ResolvedStyle(styles[name]) for part in touched})
        shown.append((f"{name} on {group.replace('_', ' ')}", output, OUTPUT, touched))
    for axes, (title, clip, color, touched) in zip(panels.flat, shown):
        _row(axes, clip, color, TOUCHED, touched, count=4)
        axes.set_title(title, fontsize=9)
    return figure


@torch.inference_mode()
def draw_attention(model: JointPuzzle, content: Clip, styles: Mapping[str, StyleClips], part: str) -> Figure:
    """Which instants of the style each instant of the content looks at (Fig. 9), and the poses at the brightest
    places."""
    _, name = _two(styles)
    features, place = clip_features(content), PART_NAMES.index(part)
    start = int(START * len(features))
    window = features[start : start + WINDOW * STRIDE : STRIDE]
    motion = model.normalize(torch.from_numpy(window.astype(np.float32))[None])
    own, style = (take_batch(each.features, [0]) for each in (encode_clip(model, features), styles[name]))
    seen = model.attention(model.queries(motion, own, WINDOW), style["keys"])[place, 0].numpy()
    figure, (top, below) = plt.subplots(2, 1, figsize=(11, 6.5), layout="constrained", height_ratios=(1, 1.5))
    length = WINDOW * STRIDE / content.fps
    top.imshow(seen, aspect="auto", cmap="magma", extent=(0, 1, length, 0))
    top.set(
        title=f"attention of the {part.replace('_', ' ')}: a neutral walk looks at '{name}'",
        xlabel="stride of the style",
        ylabel="seconds of the content",
    )
    for number, sample in enumerate(np.linspace(0, len(seen) - 1, 4).round().astype(int)):
        token = int(seen[sample].argmax())
        at = (token + 0.5) / seen.shape[1], (sample + 0.5) / len(seen) * length
        top.plot(*at, "o", markerfacecolor="none", markeredgecolor="w", markersize=9)
        top.annotate(str(number + 1), at, color="w", xytext=(7, -3), textcoords="offset points")
        shown = model.token_pose(style, token)[:, LAYOUT["position"]].double().numpy()
        poses = _upright(content)[start + sample * STRIDE], shown
        for shift, pose, color in zip((0.0, 0.9), poses, (SOURCE, TARGET)):
            draw_pose(below, pose, 2.4 * number + shift, color, TOUCHED, {part})
        below.annotate(f"{number + 1}: content, style", (2.4 * number + 0.45, -0.12), ha="center", fontsize=9)
    finish_axes(below)
    return figure


def _rows(clips: Mapping[str, tuple[Clip, str]], step: int = 1) -> Figure:
    """A row of poses for each named clip and colour. step: frames are so many sixtieths of a second apart."""
    figure, panels = plt.subplots(len(clips), 1, figsize=(6.2, 1.75 * len(clips)), layout="constrained", squeeze=False)
    for axes, (name, (clip, color)) in zip(panels[:, 0], clips.items()):
        _row(axes, clip, color, step=step)
        axes.set_ylabel(name, fontsize=9)
    return figure


def _row(
    axes: Axes,
    clip: Clip,
    color: str,
    touched_color: str = "",
    touched: Collection[str] = (),
    count: int = POSES,
    step: int = 1,
) -> None:
    """`count` poses of SECONDS of a clip, side by side."""
    span = SECONDS * 60 / step * count / POSES
    first = min(int(START * len(clip)), max(0, len(clip) - int(span) - 1))
    frames = np.minimum(first + np.linspace(0, span, count).astype(int), len(clip) - 1)
    for place, pose in enumerate(_upright(clip)[frames]):
        draw_pose(axes, pose, APART * place, color, touched_color, touched)
    finish_axes(axes)


def _upright(clip: Clip) -> np.ndarray:
    """Joint positions (frames, 21, 3) about each frame's own root, all facing the same way."""
    root = root_frame(clip.positions(), clip.fps)
    return rot.rotate(rot.from_yaw(-root.facing)[:, None], clip.positions() - root.positions[:, None])


def draw_pose(
    axes: Axes, joints: np.ndarray, at: float, color: str, touched_color: str, touched: Collection[str]
) -> None:
    """One pose (21, 3), drawn as capsules `at` metres to the right; limbs on the far side are paler."""
    seen = rot.rotate(rot.from_yaw(VIEW + np.pi), joints)
    depth = seen[:, 2]
    for joint in np.argsort(depth):
        if joint:
            part = PART_NAMES[PART_OF_JOINT[joint]]
            near = part == "spine" or part.startswith("left")
            ends = seen[[PARENTS[joint], joint]]
            axes.plot(
                at + ends[:, 0],
                ends[:, 1],
                color=touched_color if part in touched else color,
                lw=3.2 if near else 2.6,
                alpha=NEAR if near else FAR,
                solid_capstyle="round",
            )
    axes.plot(
        at + seen[12, 0], seen[12, 1] + 0.1, "o", color=touched_color if "spine" in touched else color, markersize=7
    )


def finish_axes(axes: Axes) -> None:
    axes.axhline(0, color="#c9d0d6", lw=0.8, zorder=0)
    axes.set(aspect="equal", ylim=(-0.2, 1.9), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)


def _two(named: Mapping) -> tuple[str, str]:
    """Two styles that look different."""
    names = [name for name in ("old", "marching", *named) if name in named]
    return names[0], names[1]
