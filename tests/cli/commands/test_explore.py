"""`tachometry explore` as a process: it is there, serves, and goes."""

import importlib.util
import json
import os
import re
import signal
import socket
from importlib.machinery import ModuleSpec
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from support.command import run
from support.explored import explored
from support.nightly import only

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
