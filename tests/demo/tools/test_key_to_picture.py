"""Every key that is pressed finds its picture, in the window and in a browser."""

import asyncio

import pytest

from demo.render.window import NoDisplay, NoGL
from demo.tools import chromium

KEYS = 4


@pytest.fixture
def key_to_picture():
    pytest.importorskip("aiohttp", reason="the extra 'serve' is not installed")
    from demo.tools import key_to_picture

    return key_to_picture


def test_every_key_is_answered_in_the_window(key_to_picture):
    try:
        check(key_to_picture.measure_window(KEYS, drawn=True))
    except (NoGL, NoDisplay) as error:
        pytest.skip(str(error))


def test_every_key_is_answered_in_the_browser(key_to_picture):
    pytest.importorskip("playwright", reason="Playwright is not installed")
    if chromium.PATH is None:
        pytest.skip("there is no Chromium on this machine")
    check(asyncio.run(key_to_picture.measure_browser(KEYS, drawn=True)))


def check(measured):
    assert len(measured.delays) == KEYS and min(measured.delays) > 0 and measured.rate > 0
    assert set(measured.to_json()) == {"keys", "ms", "frames", "pictures_a_second"}
