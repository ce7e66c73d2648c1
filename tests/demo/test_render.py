"""The picture: the camera as plain numbers, then the renderer without a screen, once against a golden picture."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pygame
import pytest

from demo.figure import colours
from demo.render import ground_decals, renderer, window
from demo.render.camera import Camera
from demo.render.quality import QUALITIES
from demo.render.renderer import Renderer, View
from demo.render.view import Paths
from demo.render.window import NoDisplay, NoGL, open_window
from demo.ui.hud import Panel
from demo.ui.layout import place
from demo.ui.widgets import Cell, Table
from sim.body.pose import Pose
from sim.body.skeleton import JOINT_COUNT, REST_HIPS_HEIGHT
from sim.command import Command
from sim.ground.catalogue import load_ground
from sim.ground.ground import Ground
from sim.session import Frame
from sim.style_spec import StyleSpec
from tests.support.fakes import fake_session, offscreen
from tests.support.golden import assert_golden

SIZE = (320, 180)
STYLE = {"left_arm": ("bent", 1.0), "right_arm": ("bent", 1.0), "spine": ("flapping", 0.5)}


PLACE = (np.arange(800) - 400) * 0.1
RAMP = Ground(np.tile(0.4 * PLACE, (800, 1)).astype(np.float32), 0.1, tiled=False)  # rises along x
VALLEY = Ground(np.minimum(0.5 * np.hypot(PLACE, PLACE[:, None]), 4).astype(np.float32), 0.1, tiled=False)


def frame_of(steps: int = 50, move=(1.0, 0.3), style=STYLE, ground: Ground | None = None) -> Frame:
    session = fake_session(ground)
    for _ in range(steps):
        frame = session.step(Command(move=tuple(np.array(move) / max(1, np.hypot(*move))), style=style))
    return frame


def view_of(frame: Frame, **settings) -> View:
    view = View(**settings)
    view.follow(frame, 10.0)
    return view


# ---- camera -----------------------------------------------------------


def project(camera: Camera, point, aspect=16 / 9) -> np.ndarray:
    clip = camera.world_to_clip(aspect) @ np.append(point, 1.0)
    return clip[:3] / clip[3]


def test_camera_has_its_target_in_the_middle_and_its_right_on_the_right():
    camera = Camera(yaw=0.7)
    np.testing.assert_allclose(project(camera, camera.target)[:2], 0, atol=1e-9)
    assert project(camera, camera.target + camera.right)[0] > 0.1
    assert project(camera, camera.target + [0, 0.5, 0])[1] > 0.1


def test_camera_follows_eases_and_keeps_its_limits():
    camera = Camera()
    camera.follow(np.array([1.0, 0, 0]), 1 / 60)
    assert 0 < camera.target[0] < 0.5
    camera.orbit(1.0, -9.0)
    camera.zoom(1000)
    camera.follow(np.array([1.0, 0, 0]), 10.0)
    assert camera.target[0] == pytest.approx(1.0) and camera.eye[1] > 0 and camera.distance > 1
    assert camera.yaw == pytest.approx(np.pi + 1.6)


def test_camera_puts_the_figure_into_its_room_and_glides_to_another():
    camera = Camera(yaw=0.7)
    camera.make_room(0.5, 0.2, 0.5, 0.6, 0.8)
    np.testing.assert_allclose(project(camera, camera.target)[:2], [0.5, 0.0], atol=1e-9)
    foot, head = (project(camera, camera.target + [0, height, 0])[1] for height in (-0.9, 0.9))
    assert -0.6 < foot < head < 0.6, "within the room's height"
    camera.make_room(0.0, 0.0, 0.5, 1.0, 0.8)
    places = []
    for _ in range(60):
        camera.follow(np.zeros(3), 1 / 60)
        places.append(project(camera, camera.target)[0])
    assert 0.3 < places[0] < 0.5 and np.all(np.diff(places) < 0) and places[-1] == pytest.approx(-0.5, abs=0.02)
    camera.make_room(0.0, 0.0, 1.0, 1.0, 0.8)
    camera.jump(np.zeros(3))
    assert project(camera, camera.target)[0] == pytest.approx(0, abs=1e-9), "at once"


def test_whoever_runs_stays_in_the_middle():
    camera = Camera()
    for number in range(120):
        place = np.array([4.0 * number / 60, 0.0, 0.0])
        camera.follow(place, 1 / 60)
    np.testing.assert_allclose(camera.target[[0, 2]], place[[0, 2]], atol=0.1)
    camera.jump(np.zeros(3))
    camera.follow(np.zeros(3), 1 / 60)
    np.testing.assert_allclose(camera.target[[0, 2]], 0, atol=1e-9)


@pytest.mark.parametrize("room", [(0, 0, 1, 1), (0.4, 0.1, 0.5, 0.6)])
def test_the_sky_begins_where_the_ground_ends(room):
    camera = Camera(yaw=0.3, pitch=0.1)
    camera.make_room(*room, 0.8)
    far = camera.eye * [1, 0, 1] + renderer.GROUND_SEEN * np.array([np.sin(camera.yaw), 0, np.cos(camera.yaw)])
    horizon, (middle, growth) = renderer._sky(camera, (1600, 900))
    assert horizon == pytest.approx(project(camera, far)[1], abs=1e-6)
    for y, sine in ((0.0, middle), (1.0, middle + growth)):
        up = np.array([0, sine, 0]) + np.sqrt(1 - sine**2) * np.array([np.sin(camera.yaw), 0, np.cos(camera.yaw)])
        assert project(camera, camera.eye + 10 * up)[1] == pytest.approx(y, abs=1e-6)


def test_camera_goes_up_and_down_with_the_ground_but_not_with_a_jump():
    frame = frame_of(60, ground=RAMP)
    view = view_of(frame, ground=RAMP)
    height = RAMP.smooth_height_at(frame.styled.root_position[[0, 2]])
    assert height > 0.3 and view.camera.target[1] == pytest.approx(height + 0.88, abs=1e-3)
    jumping = Frame(frame.command, frame.neutral, moved(frame.styled, (0, 0.4, 0)))
    view.follow(jumping, 1.0)
    assert view.camera.target[1] == pytest.approx(height + 0.88, abs=1e-3)


@pytest.mark.parametrize("yaw", np.arange(0, 2 * np.pi, np.pi / 4))
def test_camera_stays_over_the_ground_and_sees_the_feet(yaw):
    camera = Camera(yaw=yaw, pitch=0.0, distance=6.0)
    camera.jump(np.zeros(3), VALLEY)
    line = camera.target - [0, 0.7, 0] + np.linspace(0.1, 1, 20)[:, None] * (camera.eye - camera.target + [0, 0.7, 0])
    assert (line[:, 1] > VALLEY.height_at(line[:, [0, 2]])).all()
    pitch = camera.pitch
    camera.follow(np.zeros(3), 0.1, VALLEY)
    assert camera.pitch == pytest.approx(pitch, abs=0.01), "it does not sink and rise"
    camera.follow(np.zeros(3), 10.0)
    assert camera.pitch == pytest.approx(0.0, abs=1e-6), "back to where it was put"


def test_body_stays_in_a_picture_that_is_higher_than_wide():
    for x in (-0.7, 0.7):
        assert abs(project(Camera(yaw=np.pi), (x, 0.9, 0.0), aspect=0.5)[0]) < 1


def test_parts_take_on_a_styles_colour_as_it_grows():
    half, full = (colours.part_colours(StyleSpec({"spine": ("old", strength)}))[2] for strength in (0.5, 1.0))
    np.testing.assert_allclose(half, (full + colours.OWN_STYLE) / 2)
    np.testing.assert_allclose(colours.part_colours(StyleSpec()), np.tile(colours.OWN_STYLE, (5, 1)))


# ---- windows -----------------------------------------------------------


def test_nothing_of_opengl_is_imported_before_a_window_is_open():
    code = "import sys, demo.live.live, demo.render.renderer, demo.render.window; sys.exit('OpenGL' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2]).returncode == 0


def test_no_display_and_no_gl_are_said_in_a_sentence(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    if sys.platform == "linux":
        with pytest.raises(NoDisplay, match="DISPLAY"):
            open_window()

    def refuse(*_, **__):
        raise pygame.error("no such thing")

    monkeypatch.setattr(pygame.display, "set_mode", refuse)
    with pytest.raises(NoGL, match="apt-get install libegl1"):
        open_window(visible=False)


@pytest.mark.parametrize(
    "screen_size, size",
    [
        ((1920, 1080), (1280, 720)),
        ((3840, 2160), (2560, 1440)),
        ((1366, 768), (1229, 691)),
        ((2560, 1440), (1600, 900)),
        ((1280, 1024), (1152, 648)),
    ],
)
def test_a_window_is_as_large_as_its_screen_allows(screen_size, size):
    assert window.size_for(screen_size) == size


@pytest.mark.parametrize("samples", [0, 4])
def test_a_picture_is_made_simpler_step_by_step_and_better_again(screen, samples):
    frame = frame_of()
    drawing, pictures = Renderer(screen.size, samples=samples), []
    levels = range(len(QUALITIES))
    for level in (*levels, 0):
        drawing.simplify(level)
        drawing.draw(frame, view_of(frame))
        pictures.append(screen.read_pixels().astype(int))
    off = [np.abs(each - pictures[0]).mean() for each in pictures]
    assert off[-1] == 0 and 0 < min(off[1:-1]) and max(off) < 6 and off[-2] == max(off)


def test_an_old_opengl_is_refused(monkeypatch):
    monkeypatch.setattr(window, "GL_VERSION", (9, 9))
    with pytest.raises(NoGL):
        open_window(visible=False)


# ---- pictures -----------------------------------------------------------


@pytest.fixture
def screen():
    with offscreen(SIZE) as opened:
        yield opened
        from OpenGL import GL

        assert GL.glGetError() == GL.GL_NO_ERROR


def picture(screen, frame: Frame, view: View, **options) -> np.ndarray:
    Renderer(screen.size, **options).draw(frame, view)
    return screen.read_pixels().astype(int)


def test_golden_picture(screen):
    frame = frame_of()
    assert_golden("walk_320x180", picture(screen, frame, view_of(frame, twin="beside"), samples=0))


def test_golden_picture_of_what_is_seen_inside(screen):
    frame = frame_of()
    displacement = np.linspace(0, 1, 6)[:, None]
    paths = Paths(
        displacement * [-1.0, 0.2] + frame.styled.root_position[[0, 2]],
        frame.styled.root_position[[0, 2]] + displacement * [1.0, 0.3],
        frame.styled.root_position[[0, 2]] + displacement * [0.8, 0.5],
    )
    past = tuple(moved(frame.neutral, (-0.12 * age, 0, 0)) for age in (3, 2, 1))
    view = view_of(frame, twin="ghost", skeleton=True, paths=paths, past=past)
    assert_golden("inside_320x180", picture(screen, frame, view, samples=0))


def test_sky_is_above_and_ground_below(screen):
    pixels = picture(screen, frame_of(1), View())
    assert pixels.shape == (180, 320, 3)
    top, bottom = pixels[0].mean(0), pixels[-1].mean(0)
    assert top[2] - top[0] > 30, "blue sky in the first row"
    assert abs(bottom[2] - bottom[0]) < 20, "grey ground in the last"


def body_mask(screen, frame, view) -> np.ndarray:
    """Pixels that differ from the same scene with the character far away."""
    away = Frame(frame.command, frame.neutral, moved(frame.styled, (0, 0, 500.0)))
    return np.abs(picture(screen, frame, view) - picture(screen, away, view)).max(-1) > 40


def moved(pose: Pose, shift) -> Pose:
    return replace(pose, root_position=pose.root_position + shift, hips=pose.hips + shift)


def test_the_character_is_in_the_middle_and_whole(screen):
    frame = frame_of(1, move=(0, 0), style={})
    rows, columns = np.nonzero(body_mask(screen, frame, View()))
    assert 0.5 < (rows.max() - rows.min()) / SIZE[1] < 0.9
    assert rows.min() > 10 and rows.max() < 170 and abs(columns.mean() - 160) < 15


def test_a_styled_part_wears_its_colour(screen):
    plain = frame_of(1, move=(0, 0), style={})
    styled = Frame(Command(style={"spine": ("old", 1.0)}), plain.neutral, plain.styled)
    view = View(arrow=False)
    changed = np.abs(picture(screen, styled, view) - picture(screen, plain, view)).max(-1) > 25
    rows, _ = np.nonzero(changed)
    assert changed.sum() > 300 and rows.max() < 110, "the trunk and the head, not the legs"
    middle = picture(screen, styled, view)[changed].mean(0) / 255
    wanted = np.array(colours.style_colour("old"))
    assert np.argmax(middle) == np.argmax(wanted) and np.argmin(middle) == np.argmin(wanted)


def test_level_ground_looks_the_same_as_a_map_and_as_none(screen):
    frame, level = frame_of(), Ground(np.zeros((64, 64), np.float32), 0.1)
    view = view_of(frame, twin="beside")
    plain = picture(screen, frame, view, samples=0)
    mapped = picture(screen, frame, view_of(frame, twin="beside", ground=level), samples=0)
    assert np.abs(plain - mapped).mean() < 0.5 and (np.abs(plain - mapped).max(-1) > 24).mean() < 0.002


def test_on_a_slope_all_that_lies_on_the_ground_goes_with_it(screen):
    """Seen from above, the arrow is where it is on level ground, and shadow and discs are as large."""
    pictures = []
    for ground in (None, RAMP):
        frame = frame_of(60, ground=ground)
        view = View(Camera(pitch=1.35, distance=40.0, field_of_view=0.08), ground=ground)
        view.jump_to(frame)
        pictures.append(picture(screen, frame, view, samples=0))
    flat, sloped = (np.argwhere(one[..., 0] - one[..., 2] > 60) for one in pictures)
    assert len(flat) > 100 and len(sloped) == pytest.approx(len(flat), rel=0.2)
    np.testing.assert_allclose(sloped.mean(0), flat.mean(0), atol=8)
    flat, sloped = (np.sum(one.mean(-1) < 0.87 * np.median(one.mean(-1))) for one in pictures)
    assert flat > 100 and sloped == pytest.approx(flat, rel=0.35)


def test_ground_hides_what_is_behind_it(screen):
    frame = frame_of(1, move=(0, 0), style={})
    heights = np.where(np.abs(PLACE - 1.5) < 0.3, 3.0, 0.0)[:, None] + 0 * PLACE
    wall = Ground(heights.astype(np.float32), 0.1, tiled=False)
    view = View(Camera(yaw=np.pi, pitch=0.1))
    assert body_mask(screen, frame, view).sum() > 500
    view.ground = wall
    assert body_mask(screen, frame, view).sum() < 20


@pytest.mark.parametrize("name", ["hills", "stairs", "rough"])
def test_the_picture_is_filled_up_to_the_sky(screen, name):
    """Of the picture before nothing is left."""
    frame, renderer = frame_of(1), Renderer(SIZE, samples=0)
    from OpenGL import GL

    renderer._scene.bind()
    GL.glClearColor(1.0, 0.0, 0.0, 1.0)
    GL.glClear(GL.GL_COLOR_BUFFER_BIT)
    screen.bind()
    renderer.draw(frame, View(ground=load_ground(name), arrow=False))
    pixels = screen.read_pixels().astype(int)
    assert (pixels[..., 0] - pixels[..., 1]).max() < 60


def test_paths_lie_on_the_ground():
    paths = Paths(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[2.0, 0.0]]), np.array([[2.0, 1.0]]))
    lines = np.array([row[:3] + row[4:7] for row in ground_decals.paths(paths, 1.0, VALLEY)]).reshape(-1, 3)
    heights = lines[:, 1] - VALLEY.height_at(lines[:, [0, 2]])
    np.testing.assert_allclose(heights, ground_decals.WAY_HEIGHT, atol=1e-6)
    steps = np.linalg.norm(np.diff(lines.reshape(-1, 2, 3), axis=1)[:, 0, ::2], axis=-1)
    assert steps.max() < 0.11


def test_the_twin_stands_as_high_over_its_own_ground():
    frame = frame_of(60, ground=RAMP)
    view = view_of(frame, twin="beside", ground=RAMP)
    shift = view.twin_shift(frame)
    assert np.hypot(shift[0], shift[2]) == pytest.approx(1.15)
    assert shift[1] == pytest.approx(0.4 * shift[0], abs=1e-3) and abs(shift[1]) > 0.1


def test_the_twin_stands_beside(screen):
    frame = frame_of()
    camera = view_of(frame, twin="beside").camera
    alone, both = (picture(screen, frame, View(camera=camera, twin=twin)) for twin in ("", "beside"))
    columns = np.nonzero(np.abs(both - alone).max(-1) > 40)[1]
    assert 0 < columns.mean() < 150, "left of the middle, the character right of it"


def test_panels_cover_their_box_only(screen):
    frame, panel = frame_of(1), Panel((Table(((Cell("left arm"), Cell("old")),)),), "top left")
    changed = np.abs(picture(screen, frame, View(panels=(panel,))) - picture(screen, frame, View())).max(-1) > 3
    left, top, width, height = place((panel,), SIZE)[0].box
    rows, columns = np.nonzero(changed)
    assert (columns.min(), columns.max()) == pytest.approx((left, left + width), abs=2)
    assert (rows.min(), rows.max()) == pytest.approx((top, top + height), abs=2)


def test_panel_textures_are_kept_while_shown_and_freed_after(screen):
    frame, renderer = frame_of(1), Renderer(SIZE)
    panels = [Panel((Table(((Cell(f"line {number}"),),)),)) for number in range(3)]
    for shown in (panels[:1], panels[:1], panels[1:], []):
        renderer.draw(frame, View(panels=tuple(shown)))
        assert {key[0] for key in renderer._panels._textures} == set(shown)


def test_resizing_and_samples(screen):
    frame = frame_of()
    view = view_of(frame)
    sharp, smooth = picture(screen, frame, view, samples=0), picture(screen, frame, view, samples=4)
    assert 0 < np.abs(sharp - smooth).mean() < 3, "the same picture, its edges but for"

    renderer = Renderer(SIZE)
    renderer.resize((160, 90))
    renderer.draw(frame, view)
    small = screen.read_pixels()[-90:, :160].astype(int)  # drawn into the window's lower left corner
    halved = sharp.reshape(90, 2, 160, 2, 3).mean((1, 3))
    assert np.abs(small - halved).mean() < 6


def test_a_new_window_after_an_old_one(screen):
    screen.close()
    with open_window((64, 48), visible=False) as again:
        assert picture(again, frame_of(1), View()).std() > 5


def test_rest_pose_feet_cast_shadows(screen):
    rest = np.tile([1.0, 0, 0, 0], (JOINT_COUNT, 1))
    pose = Pose(np.zeros(3), 0.0, np.array([0, REST_HIPS_HEIGHT, 0]), rest, np.zeros(4), 0.0)
    high = replace(pose, hips=pose.hips + [0, 3.0, 0])
    view = View(camera=Camera(pitch=0.9), arrow=False)
    standing, flying = (picture(screen, Frame(Command(), p, p), view) for p in (pose, high))
    ground = slice(105, 125)
    assert standing[ground, 100:220].min() < flying[ground, 100:220].min() - 25


def test_a_crowd_is_seen_in_its_colours_and_moves_nothing_else(screen):
    """Two on either side of the character, one of them behind the camera. On the floor there is a ring about it."""
    frame = frame_of()
    pose = moved(frame.styled, np.zeros(3))
    view, plain = view_of(frame), picture(screen, frame, view_of(frame)).astype(int)
    beside = [1.2 * view.camera.right, -8.0 * view.camera.right]
    poses = Pose.stacked([moved(pose, shift) for shift in beside])
    red = np.tile([[0.9, 0.1, 0.1]], (2, 5, 1))
    view.crowd = poses, red
    image = picture(screen, frame, view).astype(int)
    changed = np.abs(image - plain).max(-1) > 40
    changed[2 * SIZE[1] // 3 :] = False
    columns = np.flatnonzero(changed.any(axis=0))
    assert changed.sum() > 200 and columns.min() > SIZE[0] // 2
    image = image[changed]
    assert (image[:, 0] > image[:, 1] + 30).mean() > 0.4, "it is red"
