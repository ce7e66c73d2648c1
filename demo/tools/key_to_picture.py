"""How long a key takes to its picture: `python -m demo.tools.key_to_picture` presses keys in a real Chromium on this
machine and in a window off the screen, and prints what came of it.

Both are measured alike: keys go down and up at instants that know nothing of the frames, and the time counts from the
event's own time stamp until the picture with the pose that answers it is complete, which reading one of its pixels
waits for. What a compositor and a screen add is the same for both, and left out."""

import argparse
import asyncio
import json
import os
import random
import threading
import time
from dataclasses import dataclass
from typing import Iterator

import numpy as np
import pygame

from demo import assemble
from demo.live.live import Live
from demo.render.window import Window, open_window
from demo.tools import chromium, visitors
from sim.command import Command
from sim.ground.catalogue import FLAT

FRAME_MS = 1000 / 60
SIZE = (640, 360)  # pixels of either picture: a processor that shares its cores draws so many sixty times a second
SETTLE = 3.0  # seconds before the first key: shaders are compiled, the attract mode is over
BETWEEN = (0.15, 0.35)  # seconds between two keys, drawn by chance: no whole number of frames
KEY = "w"
# The page says by itself, once for each input, how long its answer took to be drawn.
WATCH = """(drawn) => {
    const { input, scene, scene: { gl } } = page, answered = input.answered.bind(input), pixel = new Uint8Array(4);
    page.delays = [];
    if (!drawn) scene.draw = () => page.drawn;
    input.answered = (number) => {
        if (input.sent.size) gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        const delay = answered(number);
        if (delay !== null) page.delays.push(delay);
        return delay;
    };
}"""


@dataclass(frozen=True)
class Measured:
    """Milliseconds from each key to its picture, and pictures a second meanwhile."""

    delays: list[float]
    rate: float

    def to_json(self) -> dict:
        percentiles = np.percentile(self.delays, (50, 95))
        return {
            "keys": len(self.delays),
            "ms": dict(zip(("p50", "p95"), percentiles.round(1).tolist())),
            "frames": dict(zip(("p50", "p95"), (percentiles / FRAME_MS).round(2).tolist())),
            "pictures_a_second": round(self.rate, 1),
        }


def instants(count: int) -> Iterator[tuple[bool, float]]:
    """Of each key whether it goes down, and the seconds to wait before it; the same for page and window."""
    chance = random.Random(0)
    for number in range(count):
        yield number % 2 == 0, chance.uniform(*BETWEEN)


async def measure_browser(count: int, drawn: bool) -> Measured:
    """So many keys in a page, alone on its server. drawn: whether pictures are."""
    from playwright.async_api import async_playwright

    async with visitors.serving(1) as server, async_playwright() as driver:
        browser = await driver.chromium.launch(executable_path=chromium.PATH, args=list(chromium.SOFTWARE))
        page = await browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]}, bypass_csp=True)
        await page.goto(server.address)
        await page.locator("body.drawn").wait_for()
        await page.keyboard.press(KEY)
        await asyncio.sleep(SETTLE)
        await page.evaluate(WATCH, drawn)
        start, before = time.perf_counter(), await page.evaluate("page.pictures")
        for number, (is_down, wait) in enumerate(instants(count)):
            await asyncio.sleep(wait)
            await (page.keyboard.down if is_down else page.keyboard.up)(KEY)
            await page.wait_for_function(f"page.delays.length > {number}")
        pictures = await page.evaluate("page.pictures") - before
        rate = pictures / (time.perf_counter() - start)
        measured = Measured(await page.evaluate("page.delays"), rate)
        await browser.close()
    return measured


def measure_window(count: int, drawn: bool) -> Measured:
    """So many keys in a window off the screen. drawn: whether pictures are."""
    session = assemble.build_session()
    with open_window(SIZE, visible=False) as window:
        live = Live(session, session.stylizer.styles, window, ground=FLAT)
        keys = _Keys(live, window)
        if not drawn:
            live.paint = lambda: None  # type: ignore[method-assign]
        keyboard = threading.Thread(target=keys.press, args=(count,), daemon=True)
        keyboard.start()
        live.run(None, time.sleep)
        keyboard.join()
    return Measured(keys.delays, keys.rate)


class _Keys:
    """Presses keys in a thread of its own, and sees at each picture whether it answers the last one."""

    def __init__(self, live: Live, window: Window) -> None:
        self.delays: list[float] = []
        self.rate = 0.0
        self._live = live
        self._pressed: tuple[bool, float] | None = None  # whether a key went down, and when; None where it is answered
        self._answered = threading.Event()
        window.show = self._look  # type: ignore[method-assign]

    def press(self, count: int) -> None:
        time.sleep(SETTLE)
        start, before = time.perf_counter(), self._live.pictures
        for is_down, wait in instants(count):
            time.sleep(wait)
            self._answered.clear()
            kind = pygame.KEYDOWN if is_down else pygame.KEYUP
            self._pressed = is_down, time.perf_counter()
            pygame.event.post(pygame.event.Event(kind, key=pygame.key.key_code(KEY), mod=0, unicode=KEY))
            self._answered.wait()
        self.rate = (self._live.pictures - before) / (time.perf_counter() - start)
        self._live.leaving = True

    def _look(self) -> None:
        """The window shows what was drawn."""
        from demo.render import gl

        if self._pressed is None or self._live.frame is None:
            return
        is_down, pressed_at = self._pressed
        command = self._live.frame.command
        assert isinstance(command, Command)
        if (command.move != (0.0, 0.0)) == is_down:
            gl.read_pixels(1, 1)
            self.delays.append(1000 * (time.perf_counter() - pressed_at))
            self._pressed = None
            self._answered.set()


def measure(count: int, drawn: bool = True) -> dict:
    """Window and browser, one after the other, and what the browser adds. drawn: whether pictures are."""
    before = os.getloadavg()[0]
    window, browser = measure_window(count, drawn), asyncio.run(measure_browser(count, drawn))
    added = np.percentile(browser.delays, (50, 95)) - np.percentile(window.delays, (50, 95))
    return {
        "window": window.to_json(),
        "browser": browser.to_json(),
        "frames_added": dict(zip(("p50", "p95"), (added / FRAME_MS).round(2).tolist())),
        "load_before": round(before, 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="How long a key takes to its picture, in a window and in a browser.")
    parser.add_argument("--keys", type=int, default=200)
    parser.add_argument(
        "--undrawn", action="store_true", help="without drawing, as where a graphics card does it in next to no time"
    )
    args = parser.parse_args()
    if chromium.PATH is None:
        parser.error("there is no Chromium on this machine: apt-get install chromium")
    print(json.dumps(measure(args.keys, not args.undrawn), indent=1))


if __name__ == "__main__":
    main()
