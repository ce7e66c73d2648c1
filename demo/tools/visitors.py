"""How a server bears visitors: `python -m demo.tools.visitors --count 10` serves so many pages without a browser, each
of which steers and restyles its character all the time, and prints what came of it.

A frame is that of all visitors of a worker: where it takes less than 16.7 ms, each of them has 60 poses a second. Its
time of processor is about what it takes on a machine that does nothing else."""

import argparse
import asyncio
import json
import random
import time
from contextlib import asynccontextmanager
from typing import AsyncIterator

import numpy as np
from aiohttp import ClientSession, WSMsgType

from demo.serve import packet
from demo.serve.options import A_WORKER, Options
from demo.serve.server import Server
from demo.state.bindings import DEFAULT
from sim.ground.catalogue import FLAT
from sim.io.provenance import SHIPPED
from stylizer.styles.style_names import style_files

SETTLE = 3.0  # seconds before what is counted
BUDGET = 1 / 60


async def visit(
    session: ClientSession,
    address: str,
    number: int,
    counts: dict[int, list[int]],
    names: list[str],
    answered: list[int],
) -> None:
    """One page: a stick that goes round, a run now and then, and another style for some part every second."""
    chance = random.Random(number)
    async with session.ws_connect(f"{address}/socket") as page:
        counts[number], said, asked_at = [0, 0], 0, 0
        async for message in page:
            if message.type != WSMsgType.BINARY:
                continue
            counts[number][0] += 1
            counts[number][1] += len(message.data)
            frame, record = counts[number][0], np.frombuffer(message.data, packet.FRAME, 1)[0]
            if asked_at and record["answers"] == said:
                answered.append(int(record["number"]) - asked_at)
                asked_at = 0
            if frame % 3 == 0:  # as a stick that is moved says
                angle, said, asked_at = frame / 40 + number, said + 1, int(record["number"])
                held = ["run"] if frame // 180 % 2 else []
                stick = [float(np.sin(angle)), float(np.cos(angle))]
                await page.send_json({"n": said, "held": held, "stick": stick, "look": [0, 0], "yaw": 0.0})
            if frame % 60 == 30:
                part = chance.choice(["legs", "arms", "spine"])
                for action in (f"pick_{part}", f"choose:{chance.choice(names)}"):
                    await page.send_json({"do": action})


@asynccontextmanager
async def serving(count: int) -> AsyncIterator[Server]:
    """A server with room for so many visitors, on any free port of this machine."""
    server = Server("127.0.0.1", 0, count, Options(None, FLAT), DEFAULT)
    await server.start()
    try:
        yield server
    finally:
        await server.stop()


async def measure(count: int, seconds: float) -> dict:
    """What comes of so many visitors in so many seconds."""
    names = sorted(style_files(SHIPPED))
    counts: dict[int, list[int]] = {}
    answered: list[int] = []  # frames from an input to the first that knows of it
    async with serving(count) as server, ClientSession() as session:
        visits = [
            asyncio.create_task(visit(session, server.address, number, counts, names, answered))
            for number in range(count)
        ]
        await asyncio.sleep(SETTLE)
        while len(counts) < count:
            await asyncio.sleep(0.1)
        await server.pool.report()
        before, start, own = {n: list(c) for n, c in counts.items()}, time.perf_counter(), time.process_time()
        await asyncio.sleep(seconds)
        passed, worked = time.perf_counter() - start, time.process_time() - own
        reports = await server.pool.report()
        rates = [(np.array(counts[n]) - before[n]) / passed for n in counts]
        for each in visits:
            each.cancel()
        await asyncio.gather(*visits, return_exceptions=True)
    turns = np.concatenate([np.array(turns) for turns, _ in reports])
    percentiles = 1e3 * np.percentile(turns, (50, 95, 99), axis=0)
    return {
        "visitors": count,
        "workers": len(reports),
        "frames_to_an_answer": {str(frames): answered.count(frames) for frames in sorted(set(answered))},
        "poses_a_second": [round(min(rate[0] for rate in rates), 1), round(max(rate[0] for rate in rates), 1)],
        "kB_a_second": round(max(rate[1] for rate in rates) / 1000, 1),
        "frame_ms": dict(zip(("p50", "p95", "p99"), percentiles[:, 0].round(2).tolist())),
        "frame_processor_ms": dict(zip(("p50", "p95", "p99"), percentiles[:, 1].round(2).tolist())),
        "frames_over_16.7_ms_of_processor": round(float(np.mean(turns[:, 1] > BUDGET)), 4),
        "server_and_pages_share_of_a_core": round(worked / passed, 3),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="How a server bears visitors.")
    parser.add_argument("--count", type=int, default=2 * A_WORKER)
    parser.add_argument("--seconds", type=float, default=20.0)
    args = parser.parse_args()
    print(json.dumps(asyncio.run(measure(args.count, args.seconds)), indent=1))


if __name__ == "__main__":
    main()
