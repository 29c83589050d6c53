"""Points of a sweep: their rows, and what they are known by."""

import ast
import asyncio
import os
import pickle
import shutil
import socket
import ssl
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from distributed import Security
from distributed.comm import connect

from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.tables import held_velocity, velocity_error
from tachometry.sim.studies.sweeping import cluster, sweep
from tachometry.sim.studies.sweeping.sweep import COLUMNS, OtherCode, Point, code_digest, run_packed, run_point
from tachometry.spec import METHODS, Encoder, MTTachometer, RairanTachometer, Speed, STachometer, Timing

ROOT = Path(sweep.__file__).resolve().parents[3]  # of the layers, in the tree or where they are installed
TIMING = Timing(1_000_000, 1000, 20)
SPEC = STachometer(encoder=Encoder(100), timing=TIMING)
TEXT = "sine:30rad/s:5Hz:400ms"
POINT = Point("s", SPEC, VirtualEncoder(100, jitter=0.1), parse_motion(TEXT), TEXT)


def test_a_row_is_what_simulate_tells_of_the_same_run() -> None:
    row = run_point(POINT)
    encoding = POINT.encoder.record(POINT.motion)
    run = golden.run(SPEC, encoding.recording.place(1_000_000))
    assert (row["clocks"], row["updates"]) == (400_000, len(run.updates.clock))
    assert row["forced_updates"] == np.count_nonzero(run.updates.forced)
    assert row["updates_per_s"] == pytest.approx(len(run.updates.clock) / 0.4)
    assert row["worst_time_s"] == pytest.approx(run.updates.interval.max() * 1e-3)
    assert row["mean_time_s"] == pytest.approx(run.updates.interval.mean() * 1e-3)
    assert row["true_rms_rad_s"] == pytest.approx(30 / np.sqrt(2), rel=0.02)
    assert row["relative_error"] == pytest.approx(row["rms_error_rad_s"] / row["true_rms_rad_s"])
    assert 0 < row["delay_s"] < 0.02
    assert (row["engine"], row["mismatches"]) == (None, None)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_fills_the_columns(method: str) -> None:
    spec = METHODS[method](encoder=Encoder(100), timing=TIMING, max_speed=Speed.parse("600rpm"), lowpass=Fraction(200))
    row = run_point(replace(POINT, method=method, spec=spec, values={"speed": 30.0}))
    encoding = POINT.encoder.record(POINT.motion)
    run = golden.run(spec, encoding.recording.place(1_000_000))
    error = velocity_error(held_velocity(spec, run), encoding.true_speed)  # what simulate reports
    assert error is not None
    assert (row["rms_error_rad_s"], row["max_error_rad_s"]) == pytest.approx((error.rms, error.max))
    late = run_point(replace(POINT, method=method, spec=spec, read_delay=2e-3))
    assert (late["read_delay_s"], late["rms_error_rad_s"] == row["rms_error_rad_s"]) == (2e-3, False)
    assert list(row) == [*COLUMNS, "speed"]
    kinds = {"text": str, "int": int, "float": float, "bool": bool}
    for name, value in row.items():
        kind = kinds[COLUMNS[name][0]] if name in COLUMNS else float
        assert value is None or (isinstance(value, kind) and isinstance(value, bool) == (kind is bool)), name
    assert row["max_speed_rad_s"] == pytest.approx(20 * np.pi)
    assert (row["lowpass_rad_s"], row["tick_s"], row["max_time_s"]) == (200, 1e-3, 20e-3)


def test_options_in_units() -> None:
    spec: Any = MTTachometer(
        encoder=Encoder(100), timing=TIMING, min_time=3000, external_tick=True, max_tick_cycles=1500
    )
    encoder = VirtualEncoder(100, vibration=Vibration(1e-3, 50), bounce=Bounce(2, 5e-6), seed=3)
    row = run_point(replace(POINT, spec=spec, encoder=encoder))
    assert (row["min_time_s"], row["max_tick_period_s"]) == (3e-3, 1.5e-3)
    assert (row["vibration_rad"], row["vibration_hz"], row["bounce_count"], row["bounce_s"]) == (1e-3, 50, 2, 5e-6)
    spec = RairanTachometer(encoder=Encoder(100), timing=TIMING, adaptive=Fraction(1, 10))
    assert run_point(replace(POINT, spec=spec))["adaptive"] == 0.1


def test_what_cannot_be_told_is_empty() -> None:
    rest = run_point(replace(POINT, motion=parse_motion("stop:100ms")))
    assert (rest["rms_error_rad_s"], rest["relative_error"], rest["delay_s"]) == (0, None, None)
    timed = MTTachometer(encoder=Encoder(100), timing=TIMING, bound_decay=False)
    none = run_point(replace(POINT, spec=timed, motion=parse_motion("stop:5ms")))
    assert (none["updates"], none["mean_time_s"], none["max_error_rad_s"]) == (0, None, None)


def test_the_hardware_runs_beside_it() -> None:
    row = run_point(replace(POINT, motion=parse_motion("constant:30rad/s:10ms"), engine="pysim"))
    assert (row["engine"], row["mismatches"], row["clocks"]) == ("pysim", 0, 10_000)


DIFFERENT: list[dict[str, Any]] = [
    {"method": "x"},
    {"spec": replace(SPEC, cancel=False)},
    {"spec": replace(SPEC, frac_bits=15)},
    {"encoder": replace(POINT.encoder, seed=1)},
    {"encoder": replace(POINT.encoder, vibration=Vibration(1e-3, 50))},
    {"motion": parse_motion("sine:30rad/s:5Hz:401ms")},
    {"values": {"speed": 30.0}},
    {"earliest": 0.1},
    {"engine": "pysim"},
]


def test_what_a_point_is_known_by(monkeypatch: pytest.MonkeyPatch) -> None:
    """All that decides its row, and not how it is written."""
    assert pickle.loads(pickle.dumps(POINT)).digest == POINT.digest
    assert replace(POINT, motion=parse_motion("sine:30rad/s:0.005kHz:0.4s")).digest == POINT.digest
    every = {replace(POINT, **change).digest for change in DIFFERENT} | {POINT.digest}
    assert len(every) == len(DIFFERENT) + 1
    monkeypatch.setattr(sweep, "code_digest", lambda **_: "another")
    assert replace(POINT).digest != POINT.digest


def test_a_motion_shorter_than_a_tick() -> None:
    with pytest.raises(ValueError, match=r"^motion must last at least 1002 clocks of --clock \(1\.002ms\), a tick "):
        replace(POINT, motion=parse_motion("stop:1ms"))


def test_a_motion_that_ends_before_it_is_compared() -> None:
    duration = POINT.motion.duration
    replace(POINT, earliest=duration - 2.5e-3)
    with pytest.raises(ValueError, match=r"^motion must last two ticks or more beyond --from, longer than 400ms$"):
        replace(POINT, earliest=duration - 1.5e-3)


def test_only_the_same_code_runs_a_point() -> None:
    assert [*run_packed(code_digest(), pickle.dumps([POINT]))] == [run_point(POINT)]
    with pytest.raises(OtherCode):
        next(run_packed("another", b"never read"))


def of_tachometry(module: str) -> Path | None:
    """Return the file of a module of ours."""
    found = ROOT.joinpath(*module.split(".")[1:])
    if not module.startswith("tachometry."):
        return None
    return next((file for file in (found.with_suffix(".py"), found / "__init__.py") if file.is_file()), None)


def needed(start: Path, *without: Path) -> set[Path]:
    """Return files that a file imports, and what they import, but for those of some folders."""
    found, new = set[Path](), {start}
    while new:
        found |= new
        names = set[str]()
        for node in (node for file in new for node in ast.walk(ast.parse(file.read_text("utf-8")))):
            if isinstance(node, ast.ImportFrom) and node.module:
                names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
        files = {file for name in names if (file := of_tachometry(name)) is not None}
        new = {file for file in files - found if not any(folder in file.parents for folder in without)}
    return found


def covered(monkeypatch: pytest.MonkeyPatch, *, hardware: bool) -> set[Path]:
    """Return what the digest of the code reads."""
    read, read_bytes = set[Path](), Path.read_bytes

    def seen(path: Path) -> bytes:
        read.add(path.resolve())
        return read_bytes(path)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", seen)
        code_digest.__wrapped__(hardware=hardware)
    return read


def test_code_that_decides_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """All that a row is made with is in the digest, and no other part of tachometry."""
    start, engines = ROOT / "sim" / "studies" / "sweeping" / "sweep.py", ROOT / "sim" / "engines"
    golden = covered(monkeypatch, hardware=False)
    assert {path for path in needed(start, engines) if path.stat().st_size} <= golden
    hardware = covered(monkeypatch, hardware=True)
    assert {path for path in needed(start) if path.stat().st_size} | {engines / "driver.h"} <= hardware

    def folders(files: set[Path]) -> set[str]:
        return {file.relative_to(ROOT).parts[0 if file.parts[len(ROOT.parts)] != "sim" else 1] for file in files}

    assert folders(golden) == {"spec", "build.py", "captures", "golden", "encoder", "signals", "studies"}
    assert folders(hardware) == folders(golden) | {"hdl", "engines"}
    studies = {file.stem for file in golden if file.is_relative_to(ROOT / "sim" / "studies")}
    assert studies == {"__init__", "sweep", "compare", "baselines", "lockstep"}


def test_code_that_decides_no_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of the hardware invalidates the rows with an engine, one of a plot or a command none."""
    for layer in ("spec", "hdl", "sim", "cli"):
        shutil.copytree(ROOT / layer, tmp_path / layer, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(sweep, "_layer", lambda name: tmp_path / name)

    def digests(change: str | None = None) -> tuple[str, str]:
        if change is not None:
            with (tmp_path / change).open("a", encoding="utf-8") as file:
                file.write("# changed\n")
        return code_digest.__wrapped__(), code_digest.__wrapped__(hardware=True)

    before = digests()
    assert before == (code_digest(), code_digest(hardware=True))
    for file in ("sim/plots/run.py", "sim/studies/plan.py", "cli/main.py"):
        assert digests(file) == before, file
    for file in ("hdl/core/tachometer.py", "sim/engines/driver.h"):
        golden, hardware = digests(file)
        assert golden == before[0]
        assert hardware != before[1]
        before = golden, hardware
    compare = "sim/studies/comparing/compare.py"
    for file in ("spec/core/timing.py", "sim/golden/front_end.py", "sim/encoder/motion.py", compare):
        golden, hardware = digests(file)
        assert golden != before[0], file
        assert hardware != before[1], file
        before = golden, hardware
    assert replace(POINT, engine="pysim").digest != POINT.digest


def listening() -> list[tuple[str, int]]:
    """Return addresses at which this process and those that it has started accept connections."""
    here = psutil.Process(os.getpid())
    processes = [here, *here.children(recursive=True)]
    found = [connection for process in processes for connection in process.net_connections("inet")]
    return [(one.laddr.ip, one.laddr.port) for one in found if one.status == psutil.CONN_LISTEN]


def answer(address: tuple[str, int], *, tls: bool) -> bytes:
    """Return what a stranger is told who asks for a page."""
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    with socket.create_connection(address) as plain:
        plain.settimeout(60)
        try:
            with context.wrap_socket(plain) if tls else plain as stream:
                stream.sendall(b"GET /info/main/workers.html HTTP/1.0\r\n\r\n")
                return stream.recv(1000)
        except (ssl.SSLError, OSError):
            return b""


def test_the_processes_of_a_sweep_answer_no_stranger() -> None:
    before = set(listening())
    with cluster.cluster(None, 1) as client:
        assert client.submit(sum, [1, 2]).result() == 3
        opened = [address for address in listening() if address not in before]
        assert {ip for ip, _ in opened} == {"127.0.0.1"}
        for address in opened:
            if page := answer(address, tls=False):  # an HTTP server without a page
                assert page.startswith(b"HTTP/1.1 404")
            else:  # TLS, which wants a certificate
                assert answer(address, tls=True) == b""
        addresses = [client.scheduler.address, *client.scheduler_info()["workers"]]
        assert {address.split(":")[0] for address in addresses} == {"tls"}
        for address in addresses:
            for security in (Security(), Security.temporary()):
                place = address if security.tls_ca_file else address.replace("tls:", "tcp:")
                arguments = security.get_connection_args("client")
                with pytest.raises((OSError, TypeError)):
                    asyncio.run(connect(place, timeout=1, **arguments))
