"""Connections that ask nothing shut nobody out."""

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
import uvicorn

from tachometry.cli.explore import server as module
from tachometry.cli.explore.server import HOST, Answer, configured, page

TOKEN = "token-of-the-test"


@contextmanager
def served(answer: Answer = lambda name, args: {}) -> Iterator[int]:
    """Return the port of a server in a thread."""
    with socket.create_server((HOST, 0), backlog=300) as listening:
        port: int = listening.getsockname()[1]
        server = uvicorn.Server(configured(page(TOKEN, (f"{HOST}:{port}",), answer)))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            yield port
        finally:
            server.should_exit = True
            thread.join()


def test_half_requests_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the oldest of too many are closed, however long a head may take."""
    monkeypatch.setattr(module, "_HEAD", 1e6)
    with served() as port, ExitStack() as stack:
        clients = []
        for _ in range(module._MOST_CLIENTS + 30):
            client = stack.enter_context(socket.create_connection((HOST, port), timeout=60))
            client.sendall(b"GET / HTTP/1.1\r\nHost:")
            clients.append(client)
        with urlopen(f"http://{HOST}:{port}/{TOKEN}/") as reply:
            assert reply.status == 200
        with suppress(ConnectionResetError):
            assert clients[0].recv(1) == b""


def test_a_head_must_come_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also that of a second request."""
    monkeypatch.setattr(module, "_HEAD", 0.0)
    for begun in (b"GET", f"GET / HTTP/1.1\r\nHost: {HOST}\r\n\r\nGET".encode()):
        with served() as port, socket.create_connection((HOST, port), timeout=60) as client:
            client.sendall(begun)
            with suppress(ConnectionResetError):
                while client.recv(1000):
                    pass


def test_more_requests_than_are_answered_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MOST_CLIENTS", 1)

    def answer(name: str, args: object) -> dict[str, object]:
        with pytest.raises(HTTPError) as error:
            urlopen(f"{name.replace('|', '/')}/{TOKEN}/")
        with error.value:
            return {"status": error.value.code}

    with served(answer) as port:
        origin = f"http://{HOST}:{port}"
        headers = {"origin": origin, "content-type": "application/json"}
        asked = Request(f"{origin}/{TOKEN}/ask/{origin.replace('/', '|')}", b"{}", headers)
        with urlopen(asked) as reply:
            assert json.loads(reply.read()) == {"status": 503}
