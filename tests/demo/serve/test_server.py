"""The server without its workers: what it gives, whom it refuses, what a drop may hold."""

import asyncio
import json

import pytest

pytest.importorskip("aiohttp", reason="the extra 'serve' is not installed")
from aiohttp import FormData
from aiohttp.test_utils import TestClient, TestServer
from yarl import URL

from demo.serve import access
from demo.serve.options import FOLDER, Options
from demo.serve.server import Server
from demo.state.bindings import DEFAULT


class NoWorkers:
    """In place of a pool: takes whoever comes, as long as there is room, and keeps what is passed on."""

    room = 1

    def __init__(self):
        self.visitors, self.said = {}, []

    async def join(self, deliver):
        if len(self.visitors) == self.room:
            return None
        number = len(self.said) + 1
        self.visitors[number] = deliver
        return number

    def leave(self, number):
        del self.visitors[number]

    def say(self, *message):
        self.said.append(message)


def serve(check, tmp_path, monkeypatch):
    """Runs `check` with a client of a server, and the server."""
    monkeypatch.setenv("PATCHWALK_HOME", str(tmp_path))

    async def run():
        server = Server("127.0.0.1", 0, 1, Options(), DEFAULT)
        server.pool = NoWorkers()
        async with TestClient(TestServer(server.application)) as client:
            await check(client, server)

    asyncio.run(run())


async def welcome(page):
    return json.loads(await page.receive_str())["welcome"]


def test_the_page_and_all_that_it_loads_come_from_here(tmp_path, monkeypatch):
    async def check(client, _):
        text = await (await client.get("/")).text()
        assert "//cdn" not in text and "https:" not in text
        for name in ("style.css", "main.js", "scene.js", "gl.js", "panel.js", "icon.svg"):
            response = await client.get(f"/page/{name}")
            assert response.status == 200 and "default-src 'self'" in response.headers["Content-Security-Policy"]
        world = await (await client.get("/world.json")).json()
        assert all(text.startswith("#version 300 es") for text in world["shaders"].values())
        assert (await client.get("/ground/0")).status == 200 and (await client.get("/ground/99")).status == 404
        for path in ("/page/../server.py", "/page/%2e%2e%2fserver.py", "/page/nothing.js", "/take/x/y", "/ground/x"):
            assert (await client.get(path)).status == 404

    serve(check, tmp_path, monkeypatch)


def test_no_path_leads_out_of_the_page(tmp_path, monkeypatch):
    (tmp_path / "secret.html").write_text("not for others")

    async def check(client, _):
        for name in (str(tmp_path / "secret.html"), "../page/main.js", "../../serve/page/main.js"):
            path = URL(f"/page/{name.replace('/', '%2F')}", encoded=True)
            assert (await client.get(path)).status == 404

    serve(check, tmp_path, monkeypatch)


def test_a_ground_that_is_no_number_is_not_there(tmp_path, monkeypatch):
    async def check(client, _):
        for number in ("9" * 5000, "00", "\N{ARABIC-INDIC DIGIT ZERO}", "-1"):
            assert (await client.get(f"/ground/{number}")).status == 404

    serve(check, tmp_path, monkeypatch)


def test_other_hosts_and_origins_are_refused(tmp_path, monkeypatch):
    async def check(client, server):
        for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
            for path in ("/", "/world.json", "/socket"):
                assert (await client.get(path, headers=headers)).status == 403
            assert (await client.post("/drop/x", headers=headers)).status == 403
        assert server.pool.said == []

    serve(check, tmp_path, monkeypatch)


def test_a_visitor_too_many_is_told_so(tmp_path, monkeypatch):
    async def check(client, server):
        async with client.ws_connect("/socket") as first:
            await welcome(first)
            async with client.ws_connect("/socket") as second:
                assert "all 1 places are taken" in json.loads(await second.receive_str())["full"]
        while server.pool.visitors:
            await asyncio.sleep(0)
        async with client.ws_connect("/socket") as third:
            await welcome(third)

    serve(check, tmp_path, monkeypatch)


def test_what_a_page_says_is_passed_on_and_what_none_says_ends_it(tmp_path, monkeypatch):
    async def check(client, server):
        async with client.ws_connect("/socket") as page:
            await welcome(page)
            await page.send_json({"do": "jump"})
            await page.send_str("[1, 2]")
            assert (await page.receive()).data == 1008, "a policy was violated"
        assert server.pool.said == [("said", 1, {"do": "jump"})]
        async with client.ws_connect("/socket") as page:
            await welcome(page)
            await page.send_str("x" * (access.LARGEST_MESSAGE + 1))
            assert (await page.receive()).data == 1009, "too large"

    serve(check, tmp_path, monkeypatch)


def test_dropped_files_are_kept_in_the_users_folder_within_bounds(tmp_path, monkeypatch):
    monkeypatch.setattr(access, "LARGEST_DROP", 1000)

    async def check(client, server):
        async with client.ws_connect("/socket") as page:
            word = await welcome(page)
            form = FormData(quote_fields=False)  # as browsers do
            form.add_field("files", b"x" * 900, filename="../../étude (1).bvh")
            response = await client.post(f"/drop/{word}", data=form)
            assert response.status == 200 and "learning" in (await response.json())["say"]
            (_, _, (path,)) = server.pool.said.pop()
            assert path.startswith(str(tmp_path / FOLDER)) and path.endswith("étude (1).bvh")
            for size, names in ((1001, "a"), (0, "")):
                form = FormData({"x": "y"}, default_to_multipart=True)
                for name in names:
                    form.add_field("files", b"x" * size, filename=name)
                response = await client.post(f"/drop/{word}", data=form)
                assert response.status in (400, 413)
            assert (await client.post("/drop/wrong", data=form)).status == 404
        assert server.pool.said == [] and len(list((tmp_path / FOLDER).iterdir())) == 1

    serve(check, tmp_path, monkeypatch)


def test_a_file_is_given_to_the_page_that_made_it_alone(tmp_path, monkeypatch):
    (tmp_path / FOLDER).mkdir()
    for name in ("walk.bvh", "other.bvh"):
        (tmp_path / FOLDER / name).write_text(name)

    async def check(client, server):
        async with client.ws_connect("/socket") as page:
            word = await welcome(page)
            server.pool.visitors[1](json.dumps({"file": "walk.bvh"}))
            await page.receive_str()
            response = await client.get(f"/take/{word}/walk.bvh")
            assert await response.text() == "walk.bvh" and "attachment" in response.headers["Content-Disposition"]
            for path in (f"/take/{word}/other.bvh", "/take/wrong/walk.bvh", f"/take/{word}/..%2fpresets.json"):
                assert (await client.get(path)).status == 404

    serve(check, tmp_path, monkeypatch)


def test_frames_that_a_slow_page_does_not_take_are_left_out(tmp_path, monkeypatch):
    async def check(client, server):
        async with client.ws_connect("/socket") as page:
            await welcome(page)
            deliver = server.pool.visitors[1]
            for number in range(100):  # in one go: nothing is sent in between
                deliver(bytes([number]))
            deliver("{}")
            got = [await page.receive()]
            while got[-1].type.name == "BINARY":
                got.append(await page.receive())
            assert len(got) < 10 and got[-1].data == "{}"

    serve(check, tmp_path, monkeypatch)
