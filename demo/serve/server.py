"""The server: page, skin and grounds over HTTP, a socket for each visitor, files that are dropped and taken."""

import asyncio
import json
import re
import secrets
import shutil
import socket
import tempfile
import time
from pathlib import Path
from typing import Any, Awaitable, Callable

from aiohttp import BodyPartReader, WSCloseCode, WSMsgType, web

from demo.serve import access, page_data
from demo.serve.model_file import own_figure
from demo.serve.options import DROP, Options, own_folder
from demo.serve.pool import Message, Model, Pool
from demo.state.bindings import Bindings

PAGE = Path(__file__).parent / "page"
KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
FULL_BUFFER = 4096  # bytes that wait to be sent to a page, past which frames are left out: the newest comes next
BATCH = 64 * 2**10  # bytes of a dropped file that are read at once
SHOWN = ("frame-ancestors 'none'", "default-src 'self'", "style-src 'self' 'unsafe-inline'", "img-src 'self' data:")
HEADERS = {
    "Content-Security-Policy": "; ".join(SHOWN),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Server:
    """Serves visitors on one port until it is told to stop."""

    def __init__(self, host: str, port: int, visitors: int, options: Options, bindings: Bindings) -> None:
        self.host, self.port = host, port
        self.pool = Pool(visitors, options)
        self._bindings = bindings
        self._grounds = page_data.ground_names(options.ground)
        self._visitors: dict[str, int] = {}  # by the secret word that its page was told
        self._models: dict[str, bytes] = {}
        self._takes: dict[str, set[str]] = {}  # names of the files that a page may fetch
        self.application = web.Application(middlewares=[self._guard], client_max_size=access.LARGEST_DROP)
        self.application.add_routes(
            [
                web.get("/", self._page),
                web.get("/page/{name}", self._page),
                web.get("/world.json", self._world),
                web.get("/figure", self._figure),
                web.get("/model/{word}", self._model),
                web.get("/ground/{number}", self._ground),
                web.get("/socket", self._socket),
                web.post("/drop/{word}", self._drop),
                web.get("/take/{word}/{name}", self._take),
            ]
        )

    async def start(self) -> None:
        """Opens the port, then starts the workers. Raises OSError where the port cannot be had."""
        self._runner = web.AppRunner(self.application, access_log=None, shutdown_timeout=1.0)
        await self._runner.setup()
        site = web.TCPSite(self._runner, self.host, self.port)
        await site.start()
        self.port = self._runner.addresses[0][1]
        await self.pool.start()

    @property
    def address(self) -> str:
        """Where a browser opens it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}"

    async def stop(self) -> None:
        """Closes the port and ends the workers."""
        await self._runner.cleanup()
        self.pool.stop()

    # ---- who may ask -----------------------------------------------------------

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        if not access.is_own_host(request.headers.get("Host"), self.host):
            raise web.HTTPForbidden(text="this server answers to its own name only: see `patchwalk serve --help`\n")
        if not access.is_own_origin(request.headers.get("Origin"), request.headers.get("Host")):
            raise web.HTTPForbidden(text="this server talks to its own page only\n")
        response = await handler(request)
        if not response.prepared:
            response.headers.update(HEADERS)
        return response

    # ---- the page -----------------------------------------------------------------

    async def _page(self, request: web.Request) -> web.Response:
        name = request.match_info.get("name", "index.html")  # may hold slashes, written %2F
        path = PAGE / name
        if not re.fullmatch(r"[a-z_]+\.[a-z]+", name) or path.suffix not in KINDS or not path.is_file():
            raise web.HTTPNotFound()
        return _compressed(web.Response(body=path.read_bytes(), content_type=KINDS[path.suffix], charset="utf-8"))

    async def _world(self, _: web.Request) -> web.Response:
        body = page_data.world(self._bindings, self._grounds)
        return _compressed(web.Response(body=body, content_type="application/json"))

    async def _figure(self, _: web.Request) -> web.Response:
        body = await asyncio.to_thread(own_figure)
        return _compressed(web.Response(body=body, content_type="application/octet-stream"))

    async def _model(self, request: web.Request) -> web.Response:
        """The model of the character that the page shows."""
        body = self._models.get(request.match_info["word"])
        if body is None:
            raise web.HTTPNotFound()
        return web.Response(body=body, content_type="application/octet-stream")

    async def _ground(self, request: web.Request) -> web.Response:
        number = request.match_info["number"]
        if number not in map(str, range(len(self._grounds))):
            raise web.HTTPNotFound()
        body = await asyncio.to_thread(page_data.heights, self._grounds[int(number)])
        return _compressed(web.Response(body=body, content_type="application/octet-stream"))

    # ---- a visitor -------------------------------------------------------------------

    async def _socket(self, request: web.Request) -> web.WebSocketResponse:
        page = web.WebSocketResponse(max_msg_size=access.LARGEST_MESSAGE, compress=False, heartbeat=20.0)
        await page.prepare(request)
        if transport := request.transport:
            wire = transport.get_extra_info("socket")
            if wire is not None and wire.family in (socket.AF_INET, socket.AF_INET6):
                wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        outbox: asyncio.Queue[bytes | str | None] = asyncio.Queue()
        word = secrets.token_urlsafe(16)

        def deliver(message: Message) -> None:
            """Frames that a slow line would only keep waiting are left out; texts are not."""
            waits = outbox.qsize() > 4 or (transport is not None and transport.get_write_buffer_size() > FULL_BUFFER)
            if isinstance(message, bytes) and waits:
                return
            if isinstance(message, Model):
                self._models[word], message = message.content, json.dumps({"model": len(message.content)})
            if isinstance(message, str) and '"file"' in message:
                self._takes[word].add(json.loads(message).get("file", ""))
            outbox.put_nowait(message)

        self._takes[word] = set()
        number = await self.pool.join(deliver)
        if number is None:
            del self._takes[word]
            room = self.pool.room
            reason = f"all {room} places are taken: close another page, or start with --visitors {room + 1}"
            await page.send_str(json.dumps({"full": reason}))
            await page.close()
            return page
        self._visitors[word] = number
        await page.send_str(json.dumps({"welcome": word}))
        sending = asyncio.create_task(_send(page, outbox))
        try:
            await self._listen(page, number)
        finally:
            sending.cancel()
            self.pool.leave(number)
            self._models.pop(word, None)
            del self._visitors[word], self._takes[word]
        return page

    async def _listen(self, page: web.WebSocketResponse, number: int) -> None:
        """Passes on what a page says, until it is gone or says more than a person can."""
        second, count = 0, 0
        async for message in page:
            now = int(time.monotonic())
            second, count = now, count + 1 if now == second else 1
            said = _parsed(message.data) if message.type == WSMsgType.TEXT else None
            if said is None or count > access.MOST_MESSAGES:
                await page.close(code=WSCloseCode.POLICY_VIOLATION, message=b"no page of ours says so")
                return
            self.pool.say("said", number, said)

    async def _drop(self, request: web.Request) -> web.Response:
        """Files of one drop: kept until they are learned, in a folder of their own in the user's."""
        number = self._visitors.get(request.match_info["word"])
        if number is None or not request.content_type.startswith("multipart/"):
            raise web.HTTPNotFound()
        folder = Path(tempfile.mkdtemp(prefix=DROP, dir=own_folder()))
        try:
            paths = await asyncio.wait_for(_keep_files(request, folder), 120)
        except (ValueError, TimeoutError, web.HTTPException) as error:
            shutil.rmtree(folder, ignore_errors=True)
            reason = str(error) if isinstance(error, ValueError) else "the files did not come through; drop them again"
            return web.json_response({"say": reason}, status=400)
        self.pool.say("drop", number, [str(path) for path in paths])
        return web.json_response({"say": f"learning {' and '.join(path.name for path in paths[:2])}"})

    async def _take(self, request: web.Request) -> web.StreamResponse:
        """A recording or an export, for the page that made it."""
        word, name = request.match_info["word"], request.match_info["name"]
        if name not in self._takes.get(word, ()):
            raise web.HTTPNotFound()
        return web.FileResponse(own_folder() / name, headers={"Content-Disposition": f'attachment; filename="{name}"'})


async def _send(page: web.WebSocketResponse, outbox: "asyncio.Queue[bytes | str | None]") -> None:
    """Sends what is in the box, as long as the page is there."""
    while not page.closed:
        message = await outbox.get()
        if isinstance(message, bytes):
            await page.send_bytes(message)
        elif isinstance(message, str):
            await page.send_str(message)
        else:
            await page.send_str(json.dumps({"full": "the character's process ended: load the page anew"}))
            await page.close()


async def _keep_files(request: web.Request, folder: Path) -> list[Path]:
    """The files of a form, kept in a folder. Raises ValueError for what is too much, or none."""
    paths: list[Path] = []
    size = 0
    async for part in await request.multipart():
        if not isinstance(part, BodyPartReader) or not part.filename:
            continue
        name = re.sub(r"[^\w.() -]", "_", Path(part.filename).name)[-80:].lstrip(".") or "clip"
        path = folder / name
        if path in paths or len(paths) == access.MOST_FILES:
            raise ValueError(f"a drop holds {access.MOST_FILES} files of different names at most")
        with open(path, "xb") as file:
            while block := await part.read_chunk(BATCH):
                size += len(block)
                if size > access.LARGEST_DROP:
                    raise ValueError(
                        f"a drop holds {access.LARGEST_DROP // 2**20} MB at most; `patchwalk styles add` takes more"
                    )
                file.write(block)
        paths.append(path)
    if not paths:
        raise ValueError("there was no file in what was dropped")
    return paths


def _parsed(text: str) -> dict[str, Any] | None:
    try:
        said = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return said if isinstance(said, dict) else None


def _compressed(response: web.Response) -> web.Response:
    response.enable_compression()
    return response
