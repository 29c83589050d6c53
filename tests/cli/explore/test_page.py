"""The page of `explore`: what it answers is what the commands do, and nobody else is answered."""

import base64
import io
import json
import os
import re
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from starlette.testclient import TestClient
from support.command import run
from support.nightly import only

from tachometry.cli.commands import load
from tachometry.cli.explore.answers import FUNCTIONS, answer
from tachometry.cli.explore.server import MOST_BYTES, page
from tachometry.sim.captures.read import read_capture, with_last_tick
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies import size
from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES
from tachometry.sim.studies.comparing.compare import core_curve
from tachometry.sim.studies.plan import plan_at
from tachometry.spec import METHODS, of_texts
from tachometry.spec.language.units import short_time

TOKEN, HOST = "token-of-the-test", "127.0.0.1:4711"
CORE = {"method": "s", "ppr": "24", "clock": "1MHz", "tick": "100us", "max-time": "1ms"}
WITH_BUS = {**CORE, "name": "spindle", "bus": "axi-lite", "cancel": "no", "ci": "github", "testbench": ""}
ORIGIN = {"origin": f"http://{HOST}"}


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """Return a browser at the page; when it goes, nothing is left in the folder of temporary files."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    yield TestClient(page(TOKEN, (HOST,), lambda name, args: answer(name, args, FUNCTIONS)), f"http://{HOST}")
    assert os.listdir(tmp_path) == []


def asked(client: TestClient, name: str, /, **args: Any) -> dict[str, Any]:
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
    shown = {option["name"] for group in groups for option in group["options"] if group["part"] != "capture"}
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
    only(
        [WITH_BUS], [CORE, WITH_BUS, {**CORE, "tick": "200us", "loop": "yes", "gains": "inputs", "testbench": "cocotb"}]
    ),
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
    "args",
    [
        {},
        {"options": []},
        {"options": "ppr"},
        {"options": {"ppr": None}},
        {"options": {"ppr": 500}},
        {"options": {}, "more": {}},
        {"options": {"output": "x"}},
    ],
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


def test_curves_are_those_of_plan(client: TestClient) -> None:
    """The core is in front; a bus, a name, a loop and a tick of a PWM do not change them."""
    others = {"max-speed": "500rad/s", "bus": "uart", "baud": "100000", "tick": "", "pwm": "10kHz"}
    found = asked(client, "curves", options={**CORE, **others})
    spec = of_texts("s", {**{name: text for name, text in CORE.items() if name != "method"}, "max-speed": "500rad/s"})
    assert found["curves"][0]["own"]
    assert {one["name"] for one in found["curves"]} | found["left_out"].keys() == METHODS.keys()
    plan = plan_at(spec, np.array(found["x"]) * (1 + 1e-5))
    floor = plan.resolution + plan.disc
    error = np.array(found["curves"][0]["error"], dtype=float)
    assert found["unit"] == "rad/s"
    assert (error >= 0.99 * floor).all()
    assert error.max() <= 1.01 * floor.max() + spec.velocity.rad_per_s_per_lsb
    rest = spec.times.standstill_ticks * spec.timing.tick_seconds
    assert found["curves"][0]["cells"] == [f"{error.max():.4g}", "503us", short_time(rest), "see the core"]


def test_the_worst_error_of_the_table_is_that_of_the_core(client: TestClient) -> None:
    """That of speeds below the range, at which a count may take longer than the maximum time, is greater."""
    drive = {"lines": "1024", "clock": "125MHz", "pwm": "20kHz", "max-speed": "6000rpm"}
    own, *_ = asked(client, "curves", options=drive)["curves"]
    (row,) = (text for name, text in asked(client, "check", options=drive)["rows"] if name == "worst error")
    assert float(own["cells"][0]) == pytest.approx(float(row.split()[0]), rel=0.005)
    assert max(filter(None, own["error"])) > 1.1 * float(own["cells"][0])


def test_a_motion_is_answered_by_golden_models(client: TestClient) -> None:
    found = asked(client, "respond", options=CORE, motion={"motion": "constant:100rad/s:100ms", "jitter": "5%"})
    own = found["curves"][0]
    assert (own["name"], own["own"], found["true"][-1]) == ("s", True, 100)
    assert {one["name"] for one in found["curves"] if one["rival"]} == BASELINES.keys()
    spec = of_texts("s", {name: text for name, text in CORE.items() if name != "method"})
    recording = VirtualEncoder(24, jitter=0.05).record(parse_motion("constant:100rad/s:100ms")).recording
    curve = core_curve("s", spec, PinTrace.of(recording, spec))
    assert own["velocity"] == pytest.approx(curve.estimate.at(np.array(found["x"]) + 1e-7), rel=1e-5)


@pytest.mark.parametrize(
    ("motion", "field"),
    [
        ({"motion": ""}, "motion"),
        ({"motion": "csv:/etc/passwd"}, "motion"),
        ({"motion": "counts:/etc/passwd:a:b"}, "motion"),
        ({"motion": "constant:1e9rad/s:1s"}, "motion"),
        ({"motion": "stop:1e6s"}, "motion"),
        ({"motion": "stop:10ms", "jitter": "2"}, "jitter"),
        ({"motion": "stop:10ms", "output": "x"}, "output"),
    ],
)
def test_motions_that_are_wrong(client: TestClient, motion: dict[str, str], field: str) -> None:
    found = asked(client, "respond", options=CORE, motion=motion)
    assert found["field"] == field
    assert "root" not in found["error"]


def test_a_capture_is_replayed(client: TestClient, tmp_path_factory: pytest.TempPathFactory) -> None:
    """By the channels that are named, with a file of any name."""
    rows = [f"{n * 1e-4:.4f},{n // 2 % 2},{(n + 1) // 2 % 2}" for n in range(300)]
    text = "\n".join(["time,left,right", *rows]) + "\n"
    path = tmp_path_factory.mktemp("capture") / "run.csv"
    path.write_text(text)
    found = replayed(client, "../../etc/RUN.csv", text.encode(), a="left", b="right")
    spec = of_texts("s", {name: text for name, text in CORE.items() if name != "method"})
    recording = with_last_tick(read_capture(path, "left", "right"), spec)
    curve = core_curve("s", spec, PinTrace.of(recording, spec))
    assert found["true"] is None
    assert found["curves"][0]["velocity"] == pytest.approx(curve.estimate.at(np.array(found["x"]) + 1e-9), rel=1e-5)
    assert abs(found["curves"][0]["velocity"][-1]) > 1


@pytest.mark.parametrize(("motion", "certain"), [("ramp:150rad/s:60rad/s:3s", True), ("constant:100rad/s:2s", False)])
def test_a_disc_is_measured(client: TestClient, motion: str, certain: bool, tmp_path_factory: Any) -> None:
    """By the map of the command, with report and picture; a map that is not certain is not given."""
    path = tmp_path_factory.mktemp("capture") / "coast.sr"
    encoder = VirtualEncoder(24, index=True, eccentricity=0.25, jitter=0.05)
    write_sr(path, encoder.record(parse_motion(motion)).recording.place(2_000_000), 2_000_000)
    data, core = base64.b64encode(path.read_bytes()).decode(), {**CORE, "index": "yes"}
    found = asked(client, "calibrate", options=core, capture={}, name="coast.sr", data=data)
    assert base64.b64decode(found["picture"]).startswith(b"\x89PNG")
    assert dict(found["rows"])["counts per turn"].startswith("96")
    assert ("there is one speed" in str(found["reasons"]), bool(found["reasons"])) == (not certain, not certain)
    out = path.with_name("disc.json")
    assert run("calibrate", path, "--ppr", "24", "--index", "-o", out) == (0 if certain else 2)
    assert found["map"] == (out.read_text() if certain else "")


def replayed(client: TestClient, name: str, data: bytes, **capture: str) -> dict[str, Any]:
    coded = base64.b64encode(data).decode()
    return asked(client, "replay", options=CORE, capture=capture, name=name, data=coded)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("run.csv", b"", "run.csv"),
        ("run.csv", b"time,a\n0,0\n", "run.csv"),
        ("run.sr", b"PK\3\4 no archive", "run.sr"),
        ("run.sal", b"x", "Saleae"),
        ("/etc/passwd", b"x", "/etc/passwd"),
        ("", b"x", "must be a .sr"),
    ],
)
def test_captures_that_are_wrong(client: TestClient, name: str, data: bytes, said: str) -> None:
    error = replayed(client, name, data)["error"]
    assert said in error
    assert tempfile.gettempdir() not in error
    assert asked(client, "replay", options=CORE, capture={}, name=name, data="?")["error"].startswith(
        "the capture must"
    )


def test_motions_that_suit_a_core_are_answered(client: TestClient) -> None:
    for motion in asked(client, "check", options=CORE)["motions"].values():
        assert "error" not in asked(client, "respond", options=CORE, motion={"motion": motion})


def test_cells_and_clock_are_estimated_as_generate_prints_them(client: TestClient) -> None:
    found = asked(client, "estimate", options=CORE | {"family": "ecp5"})
    assert re.fullmatch(r"cells about [\d,]+, with .*; greatest clock about \d+ MHz \(ECP5\).*", found["size"])


def test_size_says_what_it_needs(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(size, "PACKAGES", ("no-such-package",))
    found = asked(client, "size", options=CORE)
    assert found["error"].startswith("the size cannot be measured: no-such-package is not installed: pip install")


def test_the_form_shows_each_choice_once_and_no_half_bracket(client: TestClient) -> None:
    groups = {group["title"]: group["options"] for group in asked(client, "options")["groups"]}
    options = {one["name"]: one for of in groups.values() for one in of}
    assert (options["bus"]["default"], options["bus"]["choices"].count("none")) == ("none", 1)
    assert options["position-compare"]["metavar"] == "[START:STEP:COUNT or list:DEPTH]:WIDTH"
    assert all(one["metavar"].count("[") == one["metavar"].count("]") for one in options.values())
    research = {"paper-exact", "cancel", "reciprocal", "adaptive", "whole-cycles", "bound-decay"}
    assert [*groups][-1] == "Research"
    assert {one["name"] for one in groups["Research"]} == research
    assert [title for title in groups if "Method" in title] == ["Method"]
