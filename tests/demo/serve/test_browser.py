"""A real Chromium against a real server: steer, restyle, drop, record, export, and the very poses of a replay."""

import os
import re
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from demo import cli
from demo.tools import chromium
from sim.io import bvh, recording
from tests.support.walker import walking_clip

ROOT = Path(__file__).parents[3]
PATIENCE = 120_000  # milliseconds that a machine that does much else may take for anything


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def address(home):
    """Where a server of the command answers."""
    pytest.importorskip("aiohttp", reason="the extra 'serve' is not installed")
    command = [sys.executable, "-m", "demo", "serve", "--port", "0", "--visitors", "2", "--ground", "flat"]
    environment = os.environ | {"PATCHWALK_HOME": str(home)}
    server = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True)
    try:
        yield re.match(r"Open (http://127\.0\.0\.1:\d+) ", server.stdout.readline()).group(1)
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(60)
    assert server.returncode == 0


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    if chromium.PATH is None:
        pytest.skip("there is no Chromium on this machine")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=chromium.PATH, args=list(chromium.SOFTWARE))
        yield opened
        opened.close()


@contextmanager
def opened(browser, address, **options):
    """Our page, small because a processor draws it, once the character is there; nothing may go wrong on it, and
    nothing may come from elsewhere."""
    context = browser.new_context(**options)
    context.set_default_timeout(PATIENCE)
    page, wrong = context.new_page(), []

    def check(request):
        if not request.url.startswith((address, "data:", "blob:", address.replace("http", "ws"))):
            wrong.append(request.url)

    page.on("request", check)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    page.goto(address)
    page.locator("#figures span").nth(1).wait_for()
    yield page
    context.close()
    assert not wrong


@pytest.fixture
def page(browser, address):
    """On a desk; its policy is set aside, because waiting for a function needs `eval`."""
    with opened(browser, address, viewport={"width": 760, "height": 420}, bypass_csp=True) as page:
        yield page


def test_a_walk_is_steered_styled_recorded_and_replayed(page, tmp_path, monkeypatch):
    page.locator(".part", has_text="left arm").click()
    page.locator("[data-style=zombie]").click()
    page.locator(".part", has_text="zombie").wait_for()
    page.locator("#strength").fill("80")
    page.locator(".part b", has_text="80%").wait_for()
    page.locator("#record span", has_text="record").click()
    page.locator("#record span", has_text="stop").wait_for()
    page.locator("#scene").click(position={"x": 320, "y": 120})  # beside the figure
    page.keyboard.down("w")
    page.keyboard.down("Shift")
    page.wait_for_function("() => Math.hypot(page.frame.root[0], page.frame.root[2]) > 1")
    page.keyboard.up("Shift")
    page.keyboard.press("Space")
    page.keyboard.press("[")
    page.keyboard.up("w")
    page.wait_for_function("() => page.frame.answers === page.input.number")  # the jump is in a frame, so in the file
    with page.expect_download() as recorded:
        page.keyboard.press("r")
    with page.expect_event("download", lambda file: file.suggested_filename.endswith("npz")) as poses:
        page.keyboard.press("F9")
    recorded.value.save_as(tmp_path / "walk.jsonl")
    poses.value.save_as(tmp_path / "served.npz")

    said = recording.read(tmp_path / "walk.jsonl")
    gaits, jumps = {c.gait for c in said}, sum(c.jump for c in said)
    assert gaits == {"walk", "run"} and jumps == 1 and said.styles[0] == "zombie" and len(said.styles) == 2
    assert next(iter(said)).style["left_arm"].strength == 0.8
    monkeypatch.chdir(tmp_path)
    assert cli.main("replay walk.jsonl --headless --poses replayed.npz".split()) == 0
    with np.load("served.npz") as served, np.load("replayed.npz") as replayed:
        same = (replayed["positions"] == served["positions"][0]).all(axis=(1, 2))
        (start,) = np.flatnonzero(same)  # the last ten seconds may begin in the midst of a recording
        count = min(len(said) - start, len(served["positions"]))
        assert count > 30
        for name in ("positions", "rotations", "neutral_rotations", "root_position"):
            here, there = served[name][:count], replayed[name][start : start + count]
            assert np.array_equal(np.abs(here), np.abs(there)) if "rotations" in name else np.array_equal(here, there)


def test_a_dropped_file_becomes_a_style_and_a_bad_one_a_sentence(page, tmp_path, home):
    bvh.write(tmp_path / "limp.bvh", walking_clip())
    (tmp_path / "words.bvh").write_text("no motion")
    page.locator("#file").set_input_files(tmp_path / "limp.bvh")
    page.locator("[data-style=limp].on").wait_for()
    assert (home / "styles").is_dir()
    page.locator("#own-name").fill("hobble")
    page.locator("#own-name").press("Enter")
    page.locator("[data-style=hobble].on").wait_for()
    page.locator("#own button", has_text="remove").click()
    page.locator("#toasts .alert").wait_for()
    assert "once more deletes the style" in page.locator("#toasts .alert").inner_text()
    page.locator("#own button", has_text="remove").click()
    page.locator("[data-style=hobble]").wait_for(state="detached")
    assert page.locator("#own").is_hidden(), "what comes with Patchwalk is neither renamed nor removed"
    page.locator("#toasts .alert").wait_for(state="detached")
    page.locator("#file").set_input_files(tmp_path / "words.bvh")
    page.locator("#toasts .alert").wait_for()
    assert "words.bvh is not a whole BVH file" in page.locator("#toasts .alert").inner_text()


def test_what_is_inside_is_seen_and_filmed(page):
    assert page.locator("#lost").is_hidden(), "the character is there"
    page.locator("[data-style=strutting]").click()
    for name in ("onion", "phase", "attention"):
        page.locator(f"[data-seen={name}]").click()
    page.wait_for_function(
        """() => {
            const map = document.getElementById("map"), hand = document.getElementById("hand");
            const { data } = map.getContext("2d").getImageData(0, 0, map.width, map.height);
            return data.some((value, i) => i % 4 < 3 && value > 99) && map.width > 4 &&
                hand.hasAttribute("transform") && page.past.length === 30;
        }"""
    )
    page.keyboard.press("F8")
    page.locator("#film span", has_text="stop").wait_for()
    pictures = page.evaluate("page.pictures")
    page.wait_for_function(f"() => page.pictures > {pictures} + 3")
    with page.expect_download() as film:
        page.keyboard.press("F8")
    assert film.value.suggested_filename == "patchwalk.webm"
    assert film.value.path().read_bytes()[:4] == b"\x1a\x45\xdf\xa3", "as Matroska files begin"


def test_the_figure_is_drawn_on_a_telephone_too(browser, address):
    with opened(browser, address, viewport={"width": 360, "height": 640}, has_touch=True) as page:
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= 360, "nothing sticks out"
        box = page.locator("#stick").bounding_box()
        page.touchscreen.tap(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        assert page.locator("body.touch").count() == 1
        page.locator("#bar [data-do=dress]").tap()
        page.locator("#diagram .limb[data-part=spine]").tap()
        page.locator("[data-style=hunched]").tap()
        page.locator("[data-style=hunched].on").wait_for()
        picture = page.evaluate(
            """() => {
                const { scene, frame, camera, state } = page, gl = scene.gl;
                const { poses, worldToClip } = scene.draw(frame, camera, { twin: "" });
                const [x, y, z] = poses[0].positions[10], row = (i) => worldToClip.slice(4 * i, 4 * i + 4);
                const [u, v, , w] = [0, 1, 2, 3].map((i) => row(i)[0] * x + row(i)[1] * y + row(i)[2] * z + row(i)[3]);
                const { width, height } = scene.canvas, pixel = new Uint8Array(4), corner = new Uint8Array(4);
                const read = (x, y, into) => gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, into);
                read((u / w + 1) / 2 * width, (v / w + 1) / 2 * height, pixel);
                read(2, height - 2, corner);
                return [[...pixel], [...corner]];
            }"""
        )
    (red, green, blue, _), sky = picture
    assert sky[2] > sky[0], "the sky is blue"
    assert max(abs(a - b) for a, b in zip((red, green, blue), sky)) > 20, "the chest is before it"
