"""Who gets a place, and that all others are told at once."""

import asyncio

from demo.serve.options import Options
from demo.serve.pool import Pool, _Hand


class Idle:
    """A process that lives, and a line to it that takes everything."""

    def is_alive(self):
        return True

    def send(self, message):
        pass


def test_of_three_hundred_at_once_as_many_as_there_are_places_come_in():
    async def run():
        pool = Pool(2, Options())
        hand = _Hand(Idle(), Idle())
        pool._hands = [hand]
        joining = [asyncio.create_task(pool.join(lambda message: None)) for _ in range(300)]
        await asyncio.sleep(0)  # each begins, and goes as far as it can
        refused, waiting = (list(filter(test, joining)) for test in (asyncio.Task.done, lambda task: not task.done()))
        assert len(waiting) == 2 and all(task.result() is None for task in refused), "nobody waits for a worker in vain"
        hand.ready.set()
        numbers = [await task for task in waiting]
        assert len(set(numbers)) == 2 and pool.count == 2
        pool.leave(numbers[0])
        assert await pool.join(lambda message: None) is not None

    asyncio.run(run())
