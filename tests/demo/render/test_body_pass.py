"""The pass of bodies: skins of any model drawn by one light, with smooth outlines, shaded by themselves."""

from dataclasses import replace

import numpy as np
import pytest

from demo.figure import body, skin
from demo.figure.forms import BIND
from demo.render.camera import Camera
from demo.render.ground_mesh import TO_LIGHT
from demo.render.quality import QUALITIES
from demo.render.renderer import Renderer, View
from sim.body.skeleton import INDEX, JOINT_COUNT
from sim.command import Command
from sim.math import rotations as rot
from sim.session import Frame
from tests.support.fakes import offscreen

SIDE = 160
GREY = np.full((5, 3), 0.6)


@pytest.fixture
def screen():
    with offscreen((SIDE, SIDE)) as opened:
        yield opened
        from OpenGL import GL

        assert GL.glGetError() == GL.GL_NO_ERROR


def picture(screen, *figures: body.Figure, camera: Camera, smooth: bool = True) -> np.ndarray:
    """(SIDE, SIDE, 3) of figures alone, on black."""
    from demo.render import gl
    from demo.render.body_pass import Bodies

    bodies, target = Bodies(), gl.Target(SIDE, SIDE)
    bodies.pose(figures, [0.005] * len(figures), TO_LIGHT)
    target.bind()
    gl.clear((0.0, 0.0, 0.0))
    gl.clear_depth()
    seen = {"world_to_clip": camera.world_to_clip(1.0), "eye": camera.eye, "half_size": (SIDE / 2, SIDE / 2)}
    bodies.draw(smooth, to_light=TO_LIGHT, **seen)
    return gl.read_pixels(SIDE, SIDE).astype(int)


def painted(model: skin.Model, picture: np.ndarray) -> skin.Model:
    """The figure's skin with a picture laid over it from head to feet, its upper half on the upper half."""
    place = model.medium.positions
    down = 1 - (place[:, 1] - place[:, 1].min()) / np.ptp(place[:, 1])
    materials = np.column_stack([np.ones((len(place), 4)), np.full(len(place), 0.5), down]).astype(np.float32)
    own = replace(model.medium, materials=materials)
    return skin.Model(own, own, model.coarse, picture, model.limbs)


def test_a_skin_with_a_picture_shows_it_where_the_corners_say(screen):
    stripes = np.zeros((2, 1, 4), np.uint8)
    stripes[0, 0], stripes[1, 0] = (255, 0, 0, 255), (0, 0, 255, 255)
    figure = replace(body.figure(BIND, GREY), model=painted(skin.own_model(), stripes))
    pixels = picture(screen, figure, camera=Camera(yaw=np.pi, pitch=0.0))
    red, blue = (np.argwhere(pixels[..., channel] > pixels[..., 2 - channel] + 60) for channel in (0, 2))
    assert len(red) > 300 and len(blue) > 300
    assert np.percentile(red[:, 0], 95) < np.percentile(blue[:, 0], 5) + 30, "red above blue"


def test_a_figure_drawn_as_one_of_many_may_stand_alone(screen):
    own = skin.own_model()
    figure = replace(body.figure(BIND, GREY), model=replace(own, limbs=None))
    pixels = picture(screen, figure, camera=Camera(yaw=np.pi))
    assert (pixels.max(-1) > 60).sum() > 1000


def test_figures_of_two_models_stand_in_one_picture(screen):
    white = np.full((1, 1, 4), 255, np.uint8)
    left = body.figure(BIND, np.tile([0.9, 0.2, 0.2], (5, 1)), (0.7, 0.0, 0.0))
    right = replace(body.figure(BIND, GREY, (-0.7, 0.0, 0.0)), model=painted(skin.own_model(), white))
    pixels = picture(screen, left, right, camera=Camera(yaw=np.pi, pitch=0.0, distance=6.0))
    redness = pixels[..., 0] - pixels[..., 1]
    halves = [redness[:, : SIDE // 2].max(), redness[:, SIDE // 2 :].max()]
    assert max(halves) > 80 and min(halves) < 40, "one is red, the other is not"


def test_outlines_are_smooth(screen):
    """Along a ragged outline lies a strip a pixel wide, anything from hardly covered to nearly whole."""
    camera = Camera(yaw=np.pi + 0.6)
    figure = body.figure(BIND, np.ones((5, 3)))
    ragged, smooth = (picture(screen, figure, camera=camera, smooth=smooth) for smooth in (False, True))
    outside = (ragged.max(-1) == 0) & (smooth.max(-1) > 0)
    beside = np.zeros_like(outside)
    for axis in (0, 1):
        for step in (-1, 1):
            beside |= np.roll(ragged.max(-1) > 0, step, axis)
    assert outside.sum() > 150, "a strip lies along the outline"
    assert (outside & beside).sum() > 0.85 * outside.sum(), "it is a pixel wide"
    strengths = smooth[outside].max(-1)
    assert np.percentile(strengths, 10) < 60 < 130 < np.percentile(strengths, 90), (
        "some of it hardly covered, some nearly"
    )


def test_an_arm_throws_its_shadow_on_the_body(screen):
    """A forearm held into the light before the breast: where it was lit without the arm, it is dark."""
    camera = Camera(yaw=np.pi + 0.4, pitch=0.1, distance=2.0)
    camera.target = BIND.positions[INDEX["Chest"]] + [0.0, 0.1, 0.0]
    rotations = BIND.rotations.copy()
    forward = rot.from_axis_angle(np.array([0.0, 1.0, 0.0]), -np.radians(75))
    for name in ("LeftArm", "LeftForeArm", "LeftHand"):
        rotations[INDEX[name]] = rot.multiply(forward, rot.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.radians(20)))
    raised = BIND.with_body(BIND.hips, rotations)
    down, up = (picture(screen, body.figure(pose, GREY), camera=camera) for pose in (BIND, raised))
    darker = (down.max(-1) - up.max(-1) > 35) & (up.max(-1) > 0)
    assert darker.sum() > 60


def test_a_wide_picture_takes_the_fine_skin_when_the_eye_is_near(screen):
    pose = BIND
    frame = Frame(Command(), pose, pose)
    drawn = []
    for distance in (1.2, 14.0):
        renderer = Renderer((SIDE, SIDE))
        view = View(Camera(distance=distance))
        view.camera.target = pose.positions[INDEX["Spine"]]
        screen.bind()
        renderer.draw(frame, view)
        (posed,) = renderer._bodies._posed
        drawn.append(len(posed[1].corners[0]))
    assert drawn == sorted(drawn, reverse=True) and len(skin.load_skin(skin.MEDIUM).positions) == drawn[1]


def test_a_supersampled_picture_is_the_same_but_for_its_edges(screen):
    frame = Frame(Command(), BIND, BIND)
    pictures = []
    for supersample in (1, 2):
        screen.bind()
        Renderer((SIDE, SIDE), samples=0, supersample=supersample).draw(frame, View(arrow=False))
        pictures.append(screen.read_pixels().astype(int))
    assert 0 < np.abs(pictures[0] - pictures[1]).mean() < 3


@pytest.mark.parametrize("samples", [0, 4])
def test_a_small_picture_is_magnified_without_blocks(screen, samples):
    renderer = Renderer((SIDE, SIDE), samples=samples)
    steps = []
    for level in (0, next(level for level, quality in enumerate(QUALITIES) if quality.shrink == 3)):
        screen.bind()
        renderer.simplify(level)
        renderer.draw(Frame(Command(), BIND, BIND), View(arrow=False, contacts=False))
        steps.append(np.abs(np.diff(screen.read_pixels().astype(int), axis=1)).max())
    assert steps[1] < 0.6 * steps[0], "from one pixel to the next there is less than an outline: blocks have all of it"


def test_skins_of_other_skeletons_are_posed_by_their_own_bones():
    count = JOINT_COUNT + 9
    places = np.random.default_rng(0).normal(size=(12, 3))
    joints = np.full((12, 4), count - 1)
    weights = np.tile([1.0, 0, 0, 0], (12, 1))
    other = skin.Skin(places, places, joints, weights, np.arange(12).reshape(4, 3), np.zeros((12, 6)))
    bones = np.tile(np.eye(4, 3, dtype=np.float32), (count, 1))
    bones[-1] = [0.0, 2.0, 0.0]
    corners = other.posed(bones)
    np.testing.assert_allclose(corners[0], places + [0, 2.0, 0], atol=1e-6)
    np.testing.assert_allclose(corners[1], places, atol=1e-6)
