"""`tachometry monitor`: on simulated boards, and on ports with something wrong at them."""

import csv
import io
import json
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from support import docs
from support.command import run, without
from support.demo import BOARD, CLOCK_HZ, WORDS, ToldBoard, ToldPort, demo_map, manifest_of
from support.nightly import nightly, only

from tachometry.boards.host.registers import HostRegisters
from tachometry.boards.monitor.columns import columns
from tachometry.boards.monitor.serial_port import SerialPort
from tachometry.boards.monitor.session import Frame
from tachometry.boards.monitor.watch import State
from tachometry.boards.simulated.board import SimulatedBoard
from tachometry.cli.reports.monitor import LiveView, view
from tachometry.spec import METHODS, of_texts

SIM = f"sim:{BOARD}"
PAGE = docs.DOCS / "guides" / "monitor.md"

LINE = re.compile(r"\d+\.\d{3} s, speed -?[\d.e+-]+ rad/s, position -?\d+ counts, ")


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    """Return that of the board that tests tell what to do."""
    path = tmp_path / "demo.json"
    path.write_text(json.dumps(manifest_of(demo_map())), encoding="utf-8")
    return path


def error(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Return what a wrong command line says in its last line."""
    assert run("monitor", *words) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert told.startswith("tachometry: error: ")
    return told.removeprefix("tachometry: error: ")


@nightly  # tests/boards/monitor/test_selftest.py has its steps, and a failed one is told below
@pytest.mark.parametrize("method", METHODS)
def test_the_selftest_passes(method: str, capsys: pytest.CaptureFixture[str]) -> None:
    long = ("--tick", "100us") if method == "track" else ()  # whose program takes most of a tick
    assert run("monitor", SIM, *WORDS, *long, "--method", method, "--selftest") == 0
    head, *steps, last = capsys.readouterr().out.splitlines()
    assert head.split() == ["step", "frames", "values"]
    assert all(line.endswith("  pass") for line in steps)
    assert last == f"PASS: {len(steps)} of {len(steps)} steps passed"
    assert len(steps) >= 10


@nightly  # tests/hdl/core/test_demo.py has each frame of them
@pytest.mark.parametrize("encoder", ["spi --chip as5047p --bits 14", "spi --chip amt22 --bits 12", "tformat --bits 17"])
def test_an_emulated_encoder_is_read_without_an_error(encoder: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = f"--sensor {encoder} --tick 200us --method m --set speed=100rad/s --duration 300ms".split()
    assert run("monitor", "sim:ulx3s-12f", *words) == 0  # T-format needs a multiple of its bits for a clock
    shown = re.search(r"speed (\S+) rad/s,.* wrong reads 0, ", capsys.readouterr().out.splitlines()[-1])
    assert shown is not None
    assert float(shown[1]) == pytest.approx(100, rel=0.1)


def test_a_failed_selftest(capsys: pytest.CaptureFixture[str], manifest: Path) -> None:
    """The board always shows 0."""
    with SimulatedBoard(ToldBoard(demo_map()), CLOCK_HZ) as board:
        assert run("monitor", board.path, "--manifest", manifest, "--selftest") == 1
    captured = capsys.readouterr()
    assert "  FAIL: " in captured.out
    assert captured.out.splitlines()[-1].startswith("FAIL: ")
    assert captured.err == ""


# tests/boards/monitor/test_recorder.py writes both.
@pytest.mark.parametrize("suffix", only(["csv"], ["csv", "parquet"]))
def test_a_recording(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The emulator turns at the speed that was set; every frame is there once."""
    path = tmp_path / f"run.{suffix}"
    words = ["--set", "speed=100rad/s", "--every", "1ms", "--duration", "300ms", "--record", path]
    assert run("monitor", SIM, *WORDS, "--method", "m", *words) == 0
    if suffix == "csv":
        with path.open(newline="") as file:
            rows: list[dict[str, Any]] = list(csv.DictReader(file))
    else:
        import pyarrow.parquet

        rows = pyarrow.parquet.read_table(path).to_pylist()
    times = [float(row["time [s]"]) for row in rows]
    assert times[0] == 0
    assert max(times) <= 0.3
    assert len(rows) > 100
    positions = [int(row["position [counts]"]) for row in rows]
    counts = 100 * times[-1] / (2 * 3.141592653589793) * 2000
    assert positions[-1] - positions[0] == pytest.approx(counts, abs=2 + 0.001 * counts)
    lines = capsys.readouterr().out.splitlines()
    assert LINE.match(lines[0])
    assert ", lost 0, bytes dropped 0" in lines[-1]
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_busy_computer_has_time_to_simulate(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def session(*given: object) -> None:
        raise ValueError(f"{given[-1]:g} s for an answer")

    monkeypatch.setattr("tachometry.cli.commands.monitor.Session", session)
    assert error(capsys, SIM, *WORDS, "--method", "m") == "30 s for an answer"


@contextmanager
def started(*words: object) -> "Iterator[subprocess.Popen[str]]":
    """Yield the command in a process of its own, which does not outlive the test."""
    command = [sys.executable, "-m", "tachometry", "monitor", *map(str, words)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("stops", [signal.SIGINT, signal.SIGHUP])
def test_interrupted_recordings_are_complete(stops: signal.Signals, tmp_path: Path, manifest: Path) -> None:
    path = tmp_path / "run.csv"
    with (
        SimulatedBoard(ToldBoard(demo_map()), CLOCK_HZ) as board,
        started(board.path, "--manifest", manifest, "--record", path) as process,
    ):
        assert process.stdout is not None
        assert LINE.match(process.stdout.readline())
        assert not path.exists()
        # Some press it twice; a terminal that is closed says so, too.
        process.send_signal(stops)
        process.send_signal(stops)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, f"tachometry: connected to {board.path}\n")
    rows = path.read_text().splitlines()
    assert len(rows) > 1
    assert len({row.count(",") for row in rows}) == 1
    assert sorted(file.name for file in tmp_path.iterdir()) == ["demo.json", "run.csv"]


FULL = """
import resource, sys
from tachometry.cli.main import main
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
main(sys.argv[1:])
"""


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_full_disk_leaves_the_old_recording_and_keeps_the_rows(suffix: str, tmp_path: Path, manifest: Path) -> None:
    path = tmp_path / f"run{suffix}"
    path.write_text("the old one")
    (tmp_path / "run.part.csv").write_text("of the last full disk")
    with SimulatedBoard(ToldBoard(demo_map()), CLOCK_HZ) as board:
        words = ["monitor", board.path, "--manifest", str(manifest), "--every", "1ms", "--record", str(path)]
        done = subprocess.run([sys.executable, "-c", FULL, *words], capture_output=True, text=True)
    kept = tmp_path / "run.part1.csv"
    head, *rows = kept.read_text().splitlines()
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        f"tachometry: error: cannot write {path}: File too large; {len(rows)} rows kept in {kept}"
    )
    assert len(rows) > 100
    assert {row.count(",") for row in rows} == {head.count(",")}
    assert kept.read_bytes().endswith(b"\n")
    assert path.read_text() == "the old one"
    names = {path.name, kept.name, "run.part.csv", manifest.name}
    assert {file.name for file in tmp_path.iterdir()} == names


def test_a_board_that_is_served(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Another process runs it; the manifest that it wrote is what the monitor needs."""
    path = tmp_path / "sim.json"
    with started(SIM, *WORDS, "--method", "m", "--serve", path) as process:
        assert process.stdout is not None
        port = process.stdout.readline().strip()
        assert run("monitor", port, "--manifest", path, "--plain", "--duration", "50ms") == 0
        assert LINE.match(capsys.readouterr().out)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")


def test_an_unplugged_board_is_waited_for(tmp_path: Path, manifest: Path) -> None:
    """The name of its port is a link, as udev makes them."""
    name = tmp_path / "port"
    waiting, connected = (f"tachometry: {what} {name}" for what in ("waiting for", "connected to"))
    with started(name, "--manifest", manifest, "--record", tmp_path / "run.csv") as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stderr.readline() == f"{waiting}: No such file or directory\n"
        for _ in range(2):
            with SimulatedBoard(ToldBoard(demo_map()), CLOCK_HZ) as board:
                name.symlink_to(board.path)
                while (said := process.stderr.readline()) != f"{connected}\n":
                    assert said.startswith(f"{waiting}: ")
                assert LINE.match(process.stdout.readline())
                name.unlink()
            assert process.stderr.readline().startswith(f"{waiting}: ")
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 0
    assert "Traceback" not in err
    times = [float(row.split(",")[0]) for row in (tmp_path / "run.csv").read_text().splitlines()[1:]]
    assert times == sorted(times)


def plug_in(told: ToldBoard, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every port be that of this board, which waits for no real time."""
    port = ToldPort(told)
    monkeypatch.setattr("tachometry.boards.monitor.serial_port.SerialPort", lambda name, baud: port)
    monkeypatch.setattr("tachometry.boards.host.link.time", port)


@pytest.mark.parametrize("mode", [(), ("--selftest",)], ids=["view", "selftest"])
@pytest.mark.parametrize(
    ("noise", "message"),
    [
        (b"Grbl 1.1h ['$' for help]\r\n", "sends bytes that no tachometer sends: it must be another port, or another"),
        (bytes(range(256)), "sends bytes that no tachometer sends: it must be another port, or another baud rate"),
    ],
)
def test_a_foreign_device(
    noise: bytes,
    message: str,
    mode: tuple[str, ...],
    manifest: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told = ToldBoard(demo_map())
    told.noise = noise
    plug_in(told, monkeypatch)
    assert message in error(capsys, "cable", "--manifest", manifest, *mode)


def test_another_configuration(manifest: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with SimulatedBoard(ToldBoard(demo_map("m", age="yes")), CLOCK_HZ) as board:
        told = error(capsys, board.path, "--manifest", manifest)
    assert told.startswith("the board has configuration 0x")


def test_a_port_that_is_used(manifest: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with SimulatedBoard(ToldBoard(demo_map()), CLOCK_HZ) as board, SerialPort(board.path, 1_000_000):
        assert error(capsys, board.path, "--manifest", manifest) == f"{board.path} is used by another program"


def test_a_silent_port(manifest: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    told = ToldBoard(demo_map())
    told.silent = True
    plug_in(told, monkeypatch)
    assert error(capsys, "cable", "--manifest", manifest, "--selftest") == "nothing answers at cable"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bus": "spi"}, "--manifest must be that of a board with --bus uart, not spi"),
        ({"options": {"method": "x"}}, ": method must be one of auto, s, m, t, mt, rairan, track, not 'x'"),
        ({"options": {"method": "s", "loop": "yes"}}, "--manifest must be that of a board without --loop, whose"),
        ({"registers": {"configuration": 5}}, "must be that of a demo which this version of tachometry makes: its "),
        ({"baud": 0}, ": baud must be at least 1, not 0"),
        ({"baud": "fast"}, "--manifest "),
        ({"module": "a b"}, ": name must be a letter or _ and up to 63"),
    ],
)
def test_manifests_of_something_else(
    change: dict[str, Any], message: str, manifest: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | change))
    assert message in error(capsys, "/dev/null", "--manifest", manifest)


def test_options_of_a_core_at_a_serial_port(manifest: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--ppr", "500"], ["--method", "s"], ["--index"]):
        told = error(capsys, "/dev/null", "--manifest", manifest, *words)
        assert told == "options of the core must not be given with a serial port: --manifest has them"
    told = error(capsys, "/dev/null", "--manifest", manifest, "--serve", "x.json")
    assert told == "--serve must be given with a simulated board"


def test_without_pyserial(manifest: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    monkeypatch.setattr("tachometry.cli.options.target.Target.presence", None)  # it would compile a board
    for words in (["/dev/null", "--manifest", manifest], [f"sim:{BOARD}", "--ppr", "500"]):
        assert error(capsys, *words) == "serial ports need pyserial: pip install 'tachometry[host]'"


def test_without_plotext(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "plotext", None)
    with pytest.raises(
        OSError, match=r"^the live view needs plotext: pip install 'tachometry\[host\]', or take --plain$"
    ):
        LiveView()


def shown(state: State, width: int, height: int) -> str:
    console = Console(file=io.StringIO(), width=width, height=height, color_system=None)
    with console.capture() as capture:
        console.print(view(state, width, height))
    return capture.get()


@pytest.mark.parametrize("width", [20, 60, 100, 200])
def test_the_view_fits(width: int) -> None:
    registers = demo_map("s", bounds="yes", age="yes", electrical="7", sincos="yes")
    state = State("a\x1b[31m title", registers.spec, {column.name: column for column in columns(registers)})
    assert "\x1b" not in shown(state, width, 24)
    host = HostRegisters(manifest_of(registers))
    words = [number + 1 for number, _ in enumerate(host.captured)]
    (place,) = (number for number, one in enumerate(host.captured) if one["name"] == "ANGLE")
    words[place] = 2**14
    state.take(Frame(number / 10, host.snapshot([number * word % 2**16 for word in words])) for number in range(302))
    assert state.history[-1][0] - state.history[0][0] <= 10
    state.counters = {"decode_errors": 255, "overflows": 0, "lost_updates": 3}
    text = shown(state, width, 24)
    assert max(map(len, text.splitlines())) <= width
    if width > 50:
        assert all(words in text for words in ("255 or more", "speed ", "bounds"))
        assert re.search(r"angle +90\.0° ↑ ", text)
    state.spec = of_texts("m", {"sensor": "biss", "bits": "9"})
    assert "wrong reads" in shown(state, 100, 24)
    state.waits_for = "it is out"
    assert "waiting" in shown(state, width, 24)


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("selftest", only([False], [False, True]))
def test_the_commands_of_the_page(
    selftest: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """They are short here, with the method of the core that tests share, and the package is installed already.

    Those that need hardware are marked as text.
    """
    monkeypatch.chdir(tmp_path)
    commands = [shlex.split(line) for block in blocks("sh") for line in block.replace("\\\n", "").splitlines()]
    assert len(commands) >= 4
    for program, *words in commands:
        if program == "pip":
            assert words == ["install", "tachometry[host]"]
            continue
        if "--selftest" in words and not selftest:
            continue
        short = [] if "--selftest" in words else ["--duration", "20ms", "--method", "m"]
        assert (program, run(*without(words, short), *short)) == ("tachometry", 0), words
    assert "speed " in capsys.readouterr().out
    assert (tmp_path / "run.csv").exists()


def test_the_program_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (program,) = blocks("python")
    (tmp_path / "sim.json").write_text(json.dumps(manifest_of(demo_map())))
    told = ToldBoard(demo_map())
    with SimulatedBoard(told, CLOCK_HZ) as board:
        shorter = program.replace("/dev/pts/5", board.path).replace("while True:", "for _ in range(100):")
        assert shorter.count("range(100)") == shorter.count(board.path) == 1
        exec(compile(shorter, "<docs/guides/monitor.md>", "exec"), {})
    assert told.word("SPEED") == 14_240_943
    assert capsys.readouterr().out
