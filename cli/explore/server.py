"""The server of the page: on this machine alone, for those who know its address, and for no page of another origin."""

import asyncio
import json
import os
import secrets
import signal
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.resources import files
from types import FrameType
from typing import Any, ClassVar, Protocol

import anyio
import uvicorn
from anyio import CapacityLimiter, to_thread
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import HANDLED_SIGNALS

from tachometry.cli.explore import POLICY
from tachometry.sim.signals.temporary import STOPS, end_tools

HOST = "127.0.0.1"
MOST_BYTES = 16 << 20  # that are asked with: a capture, in base64
_SECONDS = 20.0  # in which what is asked must have come
_HEAD = 5.0  # seconds in which the head of a request must have come
_MOST_CLIENTS = 200  # that are answered at once, and as many connections without a request
_LIGHT = ("options", "check", "boards", "frames", "set", "stop")  # what is answered at once, beside what takes seconds
_TYPES = {"html": "text/html", "css": "text/css", "js": "text/javascript", "LICENSE": "text/plain"}
# The page stands in no other one, and no address leaks.
_HEADERS = {
    "content-security-policy": f"{POLICY}; frame-ancestors 'none'",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "cache-control": "no-store",
}

Answer = Callable[[str, Mapping[str, Any]], Mapping[str, Any]]


def page(token: str, hosts: tuple[str, ...], answer: Answer) -> ASGIApp:
    """Return the application that serves the page, and answers what it asks.

    - `token`: Without which nothing is served.
    - `hosts`: Names with ports by which a browser may call it; another name may be that of a foreign page.
    - `answer`: Takes the name of a function and its arguments, see `cli.explore.answers`.
    """
    served = {file.name: file.read_bytes() for file in (files(__package__) / "static").iterdir()}
    served[""] = served["page.html"]
    limits = dict.fromkeys(_LIGHT, CapacityLimiter(4))
    heavy, clients = CapacityLimiter(1), CapacityLimiter(_MOST_CLIENTS)

    async def respond(request: Request) -> Response:
        host, path = request.headers.get("host", ""), request.scope["path"].split("/")
        if host not in hosts:
            return _plain(421, "this page is served by another name")
        if not secrets.compare_digest(path[1].encode(), token.encode()):
            return _plain(404, "there is no such page: the address that tachometry explore printed has a token")
        if path[2:3] == ["ask"] and len(path) == 4:
            return await ask(request, path[3])
        name = "/".join(path[2:])
        if request.method not in ("GET", "HEAD") or len(path) < 3 or name not in served:
            return _plain(404, "there is no such file")
        return Response(served[name], media_type=_TYPES[(name or "page.html").rpartition(".")[2]])

    async def ask(request: Request, name: str) -> Response:
        headers: Headers = request.headers
        if headers.get("origin") != f"http://{headers['host']}":
            return _plain(403, "only the page itself may ask")
        if request.method != "POST" or headers.get("content-type") != "application/json":
            return _plain(405, "what is asked must be posted as application/json")
        body = bytearray()
        try:
            with anyio.fail_after(_SECONDS):
                async for part in request.stream():
                    body += part
                    if len(body) > MOST_BYTES:
                        return _plain(413, f"what is asked must have at most {MOST_BYTES} bytes")
            args = json.loads(body)
            if not isinstance(args, dict):
                raise ValueError("it must be an object")
        except TimeoutError:
            return _plain(408, "what is asked must come at once")
        except (ValueError, RecursionError) as error:
            return _plain(400, f"what is asked must be JSON: {error}")
        try:
            found = await to_thread.run_sync(answer, name, args, limiter=limits.get(name, heavy))
        except Exception as error:
            line = f"internal error: {type(error).__name__}: {error}; this is a fault of tachometry: please report it"
            return JSONResponse({"error": line, "field": ""}, 500)
        return JSONResponse(found)

    async def application(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            if clients.available_tokens:
                async with clients:
                    response = await respond(Request(scope, receive))
            else:
                response = _plain(503, f"at most {_MOST_CLIENTS} requests are answered at once: try again")
            response.headers.update(_HEADERS)
            await response(scope, receive, send)

    return application


def _plain(status: int, text: str) -> Response:
    return PlainTextResponse(f"{text}\n", status)


class Boards(Protocol):
    """Describes an object that holds boards until the end."""

    def close(self) -> None:
        """Begin to give it back."""

    def join(self) -> None:
        """Wait until it is given back."""


def serve(port: int, load: Callable[[], tuple[Answer, Boards]], told: Callable[[str], None]) -> None:
    """Serve the page until Ctrl-C; OSError if the port is taken.

    - `port`: Of this machine; 0: one that is free.
    - `load`: Gives what answers, and what is given back; who opens the page meanwhile waits.
    - `told`: Is given the address, when it can be opened.
    """
    token = secrets.token_urlsafe(24)
    try:
        listening = socket.create_server((HOST, port), backlog=128)
    except OSError as error:
        raise OSError(f"--port {port} cannot be had: {os.strerror(error.errno or 0)}") from error
    with listening, suppress(KeyboardInterrupt):  # which is how it ends
        port = listening.getsockname()[1]
        told(f"http://{HOST}:{port}/{token}/\nOpen this address in a browser; Ctrl-C ends it.")
        answer, boards = load()
        server = _Server(configured(page(token, (f"{HOST}:{port}", f"localhost:{port}"), answer)), boards)
        for number in STOPS:
            if number not in HANDLED_SIGNALS:
                signal.signal(number, server.handle_exit)
        try:
            server.run(sockets=[listening])
        finally:
            boards.join()


def configured(application: ASGIApp) -> uvicorn.Config:
    """Return how the page is served."""
    return uvicorn.Config(
        application,
        http=_Connection,
        ws="none",
        lifespan="off",
        interface="asgi3",
        log_config=None,
        log_level="critical",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=2,
    )


class _Connection(H11Protocol):
    """Is closed if the head of a request takes too long, or as the oldest of too many without a request."""

    _idle: ClassVar[dict["_Connection", asyncio.TimerHandle]] = {}

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._await_head()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._await_head()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        self._busy()

    def _await_head(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._busy()
        elif self not in self._idle and not self.transport.is_closing():
            self._idle[self] = self.loop.call_later(_HEAD, self.transport.abort)
            if len(self._idle) > _MOST_CLIENTS:
                next(iter(self._idle)).transport.abort()

    def _busy(self) -> None:
        if (timer := self._idle.pop(self, None)) is not None:
            timer.cancel()


class _Server(uvicorn.Server):
    """Ends with all that it has started."""

    def __init__(self, config: uvicorn.Config, boards: Boards) -> None:
        super().__init__(config)
        self._boards = boards

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        self._boards.close()
        end_tools()
        super().handle_exit(sig, frame)
