"""A worker: visitors alone and side by side, of whom none is harmed by another."""

import json

import numpy as np
import pytest

from demo import assemble
from demo.serve import packet
from demo.serve.options import Options
from demo.serve.worker import Worker
from tests.demo.serve.test_visitor import Bender
from tests.support import fakes


class Wire:
    """In place of a connection: keeps what is sent."""

    def __init__(self):
        self.sent = []

    def send(self, message):
        self.sent.append(message)

    def packets(self):
        """The newest packet of each visitor, as a record."""
        blocks = {number: block for kind, *content in self.sent if kind == "frames" for number, block in content[0]}
        return {number: np.frombuffer(block, packet.FRAME, 1)[0] for number, block in blocks.items()}


def fake_session(*_, **__):
    session = fakes.fake_session()
    session.stylizer = Bender()
    session.crowd = lambda count: Side([fake_session() for _ in range(count)])
    return session


class Side:
    """A crowd of stand-ins, each a session of its own."""

    def __init__(self, each):
        self.each, self.latency, self.controller = each, each[0].latency, each[0].controller

    def stand_on(self, ground):
        pass

    def step(self, commands):
        frames = [one.step(command) for one, command in zip(self.each, commands.each, strict=True)]
        fields = type(frames[0].styled)
        return type(frames[0])(
            commands, *(fields.stacked([getattr(f, name) for f in frames]) for name in ("neutral", "styled"))
        )


@pytest.fixture
def worker(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path))
    monkeypatch.setattr(assemble, "build_session", fake_session)
    monkeypatch.setattr(assemble, "another_session", fake_session)
    return Worker(Wire(), Options(None, "flat"))


def walk(worker, number, yaw):
    worker._take("said", number, {"n": 1, "held": ["forward"], "yaw": yaw})


def test_each_visitor_walks_where_its_own_page_says(worker):
    for number in (1, 2, 3):
        worker._take("join", number)
        walk(worker, number, number * 1.0)
    for _ in range(60):
        worker.turn()
    assert [visitor.place and visitor.place[1] for visitor in worker._visitors.values()] == [None, 0, 1]
    for number, record in worker._connection.packets().items():
        x, _, z = record["root"]
        assert np.arctan2(x, z) == pytest.approx(number * 1.0, abs=0.05) and np.hypot(x, z) > 0.5


def test_who_records_moves_alone_from_the_start_point(worker):
    for number in (1, 2):
        worker._take("join", number)
        walk(worker, number, 0.0)
    for _ in range(30):
        worker.turn()
    worker._take("said", 2, {"do": "record"})
    worker.turn()
    assert worker._visitors[2].place is None
    assert np.linalg.norm(worker._connection.packets()[2]["root"]) < 0.1
    worker._take("join", 3)
    worker.turn()
    assert worker._visitors[3].place[1] == 0, "the place that was left is taken, where the one before stood"
    assert worker._connection.packets()[3]["root"][2] > 0.1


def test_a_mistake_of_ours_ends_one_visitor_alone(worker, monkeypatch, capsys):
    for number in (1, 2):
        worker._take("join", number)
    monkeypatch.setattr(worker._visitors[1], "step", lambda: 1 / 0)
    worker.turn()
    assert ("end", 1) in worker._connection.sent and list(worker._visitors) == [2]
    assert list(worker._connection.packets()) == [2] and "ZeroDivisionError" in capsys.readouterr().err


def test_a_refused_style_of_one_leaves_the_others_walking(worker, monkeypatch):
    for number in (1, 2, 3):
        worker._take("join", number)
    worker._take("said", 2, {"do": "choose:bent"})
    walk(worker, 3, 0.0)
    monkeypatch.delitem(fakes.BENDS, "bent")
    monkeypatch.setattr(
        worker._base.stylizer, "movements", lambda name: fakes.BENDS[name] if name in fakes.BENDS else missing()
    )
    for _ in range(8):
        worker.turn()
    texts = [
        json.loads(text) for kind, *content in worker._connection.sent if kind == "frames" for _, text in content[1]
    ]
    assert any("unknown style" in text.get("say", "") for text in texts)
    assert not worker._visitors[2].choice.style and worker._connection.packets()[3]["root"][2] > 0


def missing():
    raise ValueError("unknown style")


def test_a_page_that_nobody_looks_at_costs_nothing(worker):
    worker._take("join", 1)
    worker._take("said", 1, {"hidden": True})
    assert not worker._awake()
    worker._take("said", 1, {"hidden": False})
    assert list(worker._awake()) == [1]


def test_a_change_for_all_is_passed_on_and_read(worker):
    worker._take("join", 1)
    worker._take("said", 1, {"do": "choose:bent"})
    worker._take("said", 1, {"do": "save_8"})
    assert worker._connection.sent[-1] == ("changed",)


def test_the_end_of_the_server_ends_recordings(worker):
    worker._take("join", 1)
    worker._take("said", 1, {"do": "record"})
    worker.turn()
    path = worker._visitors[1].recorder.path
    with pytest.raises(EOFError):
        worker._take("stop", 0)
    assert path.read_text().endswith('"end": true}\n')
