"""The page of `explore`: what it answers is what the commands do, and nobody else is answered."""

import base64
import io
import json
import os
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
from starlette.testclient import TestClient
from support.command import run

from tachometry.cli.commands import load
from tachometry.cli.explore.answers import answer
from tachometry.cli.explore.server import MOST_BYTES, page

TOKEN, HOST = "token-of-the-test", "127.0.0.1:4711"
CORE = {"method": "s", "ppr": "24", "clock": "1MHz", "tick": "100us", "max-time": "1ms"}
ORIGIN = {"origin": f"http://{HOST}"}


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """Return a browser at the page; when it goes, nothing is left in the folder of temporary files."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    yield TestClient(page(TOKEN, (HOST,), answer), f"http://{HOST}")
    assert os.listdir(tmp_path) == []


def asked(client: TestClient, name: str, **args: Any) -> dict[str, Any]:
    reply = client.post(f"/{TOKEN}/ask/{name}", json=args, headers=ORIGIN)
    assert reply.status_code == 200
    return dict(reply.json())


def test_everything_that_the_page_loads_is_there(client: TestClient) -> None:
    reply = client.get(f"/{TOKEN}/")
    assert reply.status_code == 200
    assert "default-src 'none'" in reply.headers["content-security-policy"]
    for name in ("page.js", "page.css", "uPlot.iife.min.js", "uPlot.min.css"):
        assert f'"{name}"' in reply.text
        assert len(client.get(f"/{TOKEN}/{name}").content) > 1000


def test_the_form_has_every_option_of_the_command(client: TestClient) -> None:
    groups = asked(client, "options")["groups"]
    shown = {option["name"] for group in groups for option in group["options"]}
    command = load("generate")
    with command.make_context("generate", [], resilient_parsing=True) as context:
        of_command = {one.opts[0].removeprefix("--") for one in command.get_params(context)}
    assert of_command - shown == {"output", "-h", "help"} & of_command | {"output"}
    assert shown <= of_command
    (reciprocal,) = (one for group in groups for one in group["options"] if one["name"] == "reciprocal")
    assert (reciprocal["choices"], reciprocal["default"]) == (["serial", "table"], "serial")
    assert reciprocal["methods"] == ["s"]


@pytest.mark.parametrize(
    "options",
    [
        CORE,
        {**CORE, "name": "spindle", "bus": "axi-lite", "cancel": "no", "ci": "github", "testbench": ""},
        {**CORE, "tick": "200us", "loop": "yes", "gains": "inputs"},
    ],
)
def test_the_archive_has_what_the_command_writes(client: TestClient, options: dict[str, str], tmp_path: Path) -> None:
    """In every byte, by the command that the page shows."""
    words = shlex.split(asked(client, "check", options=options)["command"])
    with tempfile.TemporaryDirectory(dir=tmp_path.parent) as folder:
        assert words[0] == "tachometry"
        assert words[-2:] == ["-o", "build"]
        assert run(*words[1:-1], folder) == 0
        written = {path.relative_to(folder).as_posix(): path.read_bytes() for path in Path(folder).rglob("*.*")}
    found = asked(client, "files", options=options)
    with ZipFile(io.BytesIO(base64.b64decode(found["zip"]))) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == written
    assert found["name"] == f"{options.get('name', 'tachometer')}.zip"
    assert asked(client, "files", options=options) == found


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"ppr": ""}, "ppr"),
        ({"ppr": "none"}, "ppr"),
        ({"max-time": "5"}, "max-time"),
        ({"clock": "-1"}, "clock"),
        ({"cancel": "perhaps"}, "cancel"),
        ({"name": "../spindle"}, "name"),
        ({"name": "wire"}, "name"),
        ({"bus": "usb"}, "bus"),
        ({"bus": "uart", "baud": "300000"}, "baud"),
        ({"for": "rio", "bus": "apb"}, "bus"),
        ({"average": "4"}, "average"),
        ({"kp": "5"}, "kp"),
        ({"axes": "many"}, "axes"),
        ({"ppr": "9" * 3000}, "ppr"),
    ],
)
def test_what_is_wrong_is_said_as_by_the_command(
    client: TestClient, wrong: dict[str, str], field: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    options = {**CORE, **wrong}
    found = asked(client, "check", options=options)
    assert found["field"] == field
    words = [f"--{name}={text}" for name, text in options.items() if text and name != "cancel"]
    assert run("generate", *words, *["--cancel=perhaps"] * ("cancel" in wrong), "-o", tmp_path / "none") == 2
    said = capsys.readouterr().err.removeprefix("tachometry: error: ").partition(" (see tachometry ")[0].strip()
    if "cancel" not in wrong:  # which is a flag there
        assert said.startswith(found["error"][:900])
    assert asked(client, "files", options=options) == found


@pytest.mark.parametrize(
    "args", [{}, {"options": []}, {"options": {"ppr": 500}}, {"options": {}, "more": {}}, {"options": {"output": "x"}}]
)
def test_what_the_page_never_asks(client: TestClient, args: dict[str, Any]) -> None:
    for name in ("check", "files", "answer", "__init__"):
        assert asked(client, name, **args)["error"]


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/", {}, 404),
        ("/another-token/", {}, 404),
        (f"/{TOKEN}", {}, 404),
        (f"/{TOKEN}x/", {}, 404),
        (f"/{TOKEN}/../answers.py", {}, 404),
        (f"/{TOKEN}/%2e%2e/answers.py", {}, 404),
        (f"/{TOKEN}/..%2f..%2fanswers.py", {}, 404),
        (f"/{TOKEN}//etc/passwd", {}, 404),
        (f"/{TOKEN}/page.html%00", {}, 404),
        (f"/{TOKEN}/ask/options", {}, 403),
        (f"/{TOKEN}/", {"host": "evil.example"}, 421),
        (f"/{TOKEN}/", {"host": "127.0.0.1:4712"}, 421),
        (f"/{TOKEN}/", {"host": ""}, 421),
    ],
)
def test_what_is_not_served(client: TestClient, path: str, headers: dict[str, str], status: int) -> None:
    reply = client.get(path, headers=headers)
    assert reply.status_code == status
    assert "root:" not in reply.text


@pytest.mark.parametrize("origin", [None, "null", "https://evil.example", "http://127.0.0.1:4712", f"https://{HOST}"])
def test_no_other_origin_may_ask(client: TestClient, origin: str | None) -> None:
    headers = {} if origin is None else {"origin": origin}
    assert client.post(f"/{TOKEN}/ask/options", json={}, headers=headers).status_code == 403
    reply = client.options(f"/{TOKEN}/ask/options", headers=headers | {"access-control-request-method": "POST"})
    assert reply.status_code == 403
    assert not any(name.startswith("access-control") for name in reply.headers)


@pytest.mark.parametrize(
    ("body", "kind", "status"),
    [
        (b"{}", "text/plain", 405),
        (b"{}", "application/x-www-form-urlencoded", 405),
        (b"", "application/json", 400),
        (b"\xff", "application/json", 400),
        (b"[]", "application/json", 400),
        (b"[" * 200_000, "application/json", 400),
        (b'{"a": ' + b"9" * 10_000 + b"}", "application/json", 400),
        (json.dumps({"options": {"ppr": "5" * 10_000_000}}).encode(), "application/json", 200),
        (b" " * (MOST_BYTES + 1), "application/json", 413),
    ],
)
def test_what_is_no_question(client: TestClient, body: bytes, kind: str, status: int) -> None:
    reply = client.post(f"/{TOKEN}/ask/check", content=body, headers=ORIGIN | {"content-type": kind})
    assert reply.status_code == status
    assert len(reply.content) < 400
