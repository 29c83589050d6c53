"""Connections that ask nothing shut nobody out."""

import importlib.util
import json
import os
import re
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib.machinery import ModuleSpec
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
import uvicorn
from support.command import run
from support.explored import explored
from support.nightly import only

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


# `tachometry explore` as a process: it is there, serves, and goes.
ADDRESS = r"http://127\.0\.0\.1:\d+/[\w-]{32}/"


def posted(address: str, name: str, **args: object) -> dict[str, object]:
    origin = address.rsplit("/", 2)[0]
    headers = {"origin": origin, "content-type": "application/json"}
    with urlopen(Request(f"{address}ask/{name}", json.dumps(args).encode(), headers)) as reply:
        return dict(json.loads(reply.read()))


@pytest.mark.parametrize("number", only([signal.SIGINT], [signal.SIGINT, signal.SIGTERM]))
def test_it_serves_until_it_is_stopped(number: signal.Signals, tmp_path: Path) -> None:
    """While a client is there that sends nothing, and one that reads nothing."""
    with explored(tmp_path) as (process, address):
        assert re.fullmatch(ADDRESS, address)
        _, _, host, token, _ = address.split("/")
        place = (host.split(":")[0], int(host.split(":")[1]))
        with socket.create_connection(place), socket.create_connection(place) as deaf:
            request = f"GET /{token}/uPlot.iife.min.js HTTP/1.1\r\nHost: {host}\r\n\r\n"
            deaf.sendall(request.encode() * 20)
            assert posted(address, "check", options={"ppr": "500", "method": "s"})["method"] == "s"
            with pytest.raises(HTTPError, match="404"):
                urlopen(address.replace(token, token[::-1]))
            process.send_signal(number)
            _, err = process.communicate(timeout=20)
    assert (process.returncode, err) == (0, "")
    assert os.listdir(tmp_path) == []


def test_a_port_that_is_taken(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert run("explore", "--port", port) == 2
    assert capsys.readouterr().err == f"tachometry: error: --port {port} cannot be had: Address already in use\n"


def test_without_the_extra(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec

    def without(name: str, package: str | None = None) -> ModuleSpec | None:
        return None if name == "uvicorn" else found(name, package)

    monkeypatch.setattr(importlib.util, "find_spec", without)
    assert run("explore") == 2
    assert capsys.readouterr().err == "tachometry: error: explore needs uvicorn: pip install 'tachometry[explore]'\n"
