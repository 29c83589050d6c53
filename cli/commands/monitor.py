"""`tachometry monitor`: what a board measures, live."""

from __future__ import annotations

import json
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from fractions import Fraction
from pathlib import Path
from types import FrameType

import click

from tachometry.boards.fpga.boards import BOARDS
from tachometry.boards.monitor.columns import columns
from tachometry.boards.monitor.emulator_settings import emulator_settings
from tachometry.boards.monitor.publisher import publisher_of
from tachometry.boards.monitor.recorder import Recorder
from tachometry.boards.monitor.selftest import selftest as run_selftest
from tachometry.boards.monitor.selftest import steps
from tachometry.boards.monitor.serial_port import pyserial
from tachometry.boards.monitor.session import Session, connected
from tachometry.boards.monitor.watch import State, watch
from tachometry.cli.files import Outputs
from tachometry.cli.options.core import OPTIONAL_CORE_OPTIONS, CoreTexts
from tachometry.cli.options.option import FilePath, command, option, output
from tachometry.cli.options.target import SIMULATED, Target, target_of
from tachometry.cli.reports.monitor import SelftestReport, display
from tachometry.sim.signals.temporary import STOPS
from tachometry.spec.language.units import parse_time, plural
from tachometry.spec.registers.demo import PERIOD_WIDTH, DemoMap

_GROUP = "Monitor"
_ORDERLY = 3.0  # seconds that an end may take before it can be interrupted

_MANIFEST = "Manifest that `tachometry build` wrote for the board. It has the options of the core at a serial port."
_SET = """Set the emulated encoder; it may be given several times. The board measures it from the time on when its \
speed is set. All names are listed below."""
_EVERY = "Time between frames of telemetry, in whole ticks. Frames that the line cannot carry are lost."
_SELFTEST = """Test the board with its emulated encoder. It goes fast and slow, to and fro, stops, and makes errors; \
every frame is compared with the golden model."""
_SERVE = "Run a simulated board for other programs. Its serial port is printed, and its manifest written to FILE."
_RECORD = "Record a row for each frame: time and all outputs. .csv or .parquet."
_PUBLISH = """Publish each frame: mqtt://HOST/TOPIC or epics:PREFIX. MQTT has a JSON object for each frame at TOPIC, \
and USER:PASSWORD@ before HOST and :PORT behind it where the broker needs them; EPICS serves a variable PREFIX + NAME \
for each output."""


@command(
    """\b
PORT is one of:
  /dev/ttyUSB1, COM5, ...  the serial port of a board, with its --manifest
"""
    + "".join(f"  {SIMULATED + name:<25}a simulated board, with options of the core\n" for name in BOARDS)
    + """
\b
Settings of the emulated encoder, for --set:
  speed=100rad/s         also rpm and rev/s
  acceleration=500rad/s2 how fast the speed changes; without it: at once
  phase-error=5%         how late B rises, as a part of a period
  duty-a=5% duty-b=5%    how late A and B fall
  jitter=1%              edges move at random by up to this
  bounce=5us             lines bounce after each edge
  drop=1%                so many edges are left out
  glitches=0.01%         in so many clocks A and B have the wrong level
  broken=b               lines that are high, as open inputs are; none
  stuck=a,z              lines that stay as they are; none
  source=pins            what is measured: pins or emulator

\b
Examples:
  tachometry monitor sim:icebreaker --ppr 500 --set speed=100rad/s
  tachometry monitor /dev/ttyUSB1 --manifest build/icebreaker/tachometer.json
  tachometry monitor sim:icebreaker --ppr 500 --selftest"""
)
@click.argument("port", metavar="PORT")
@option(_GROUP, "--manifest FILE", type=FilePath(dir_okay=False), help=_MANIFEST)
@option(_GROUP, "--set NAME=VALUE", "words", multiple=True, help=_SET)
@option(_GROUP, "--every TIME", default="10ms", help=_EVERY)
@option(_GROUP, "--duration TIME", help="End after TIME of the board. [default: at Ctrl-C]")
@option(_GROUP, "--plain", is_flag=True, help="Print a line a second in place of the live view.")
@option(_GROUP, "--selftest", is_flag=True, help=_SELFTEST)
@option(_GROUP, "--serve FILE", type=FilePath(dir_okay=False), help=_SERVE)
@output("--record", suffixes=(".csv", ".parquet"), help=_RECORD)
@option(_GROUP, "--publish ADDRESS", help=_PUBLISH)
@OPTIONAL_CORE_OPTIONS
def monitor(
    port: str,
    core: CoreTexts,
    manifest: Path | None,
    words: tuple[str, ...],
    every: str,
    duration: str | None,
    plain: bool,
    selftest: bool,
    serve: Path | None,
    record: Path | None,
    publish: str | None,
) -> int:
    """Show what a board measures: speed, position, errors, and a running plot of the speed.

    The board is one that `tachometry build` has made a bitstream for, or a simulated one: the same gates, compiled, in
    real time.

    A board that is unplugged or silent is waited for. Ctrl-C ends the monitor, and a recording is complete then.

    Exit status 1 if the self-test fails; 2 if something else answers than the board of the manifest.
    """
    if selftest:
        _refuse(
            "--selftest",
            {"--record": record, "--publish": publish, "--set": words, "--duration": duration, "--serve": serve},
        )
    if serve is not None:
        if not port.startswith(SIMULATED):
            raise ValueError("--serve must be given with a simulated board")
        _refuse("--serve", {"--record": record, "--publish": publish, "--set": words})
    seconds = None if duration is None else parse_time("duration", duration)
    if seconds is not None and seconds <= 0:
        raise ValueError(f"--duration must be longer than 0, not {duration}")
    target = target_of(port, core, manifest)
    if serve is not None:
        return _serve(target, serve, seconds)
    pyserial()  # before a simulated board is compiled
    if selftest:
        return _selftest(target)
    settings = emulator_settings(target.registers.spec, words)
    period = _ticks(target.registers, every)
    outputs = Outputs({"--record": record}, inputs=[] if manifest is None else [manifest])
    shown = {column.name: column for column in columns(target.registers)}
    state = State(target.title, target.registers.spec, shown, recorded="" if record is None else str(record))
    publisher = None if publish is None else publisher_of(publish, list(shown.values()))
    screen = display(plain)
    failure: Exception | None = None
    with _interrupts() as stop, outputs:
        where = outputs.get("--record")
        recorder = None if where is None else Recorder(where, where.suffix.lower(), list(shown.values()))
        try:
            with ExitStack() as stack:
                if recorder is not None:
                    stack.enter_context(recorder)
                if publisher is not None:
                    stack.enter_context(publisher)
                name = stack.enter_context(target.presence())
                stop.orderly = True
                about = (target.label(name), lambda: target.open(name), target.manifest, period, settings)
                session = Session(*about, screen.notice, target.timeout)
                with screen:
                    watch(session, state, screen, [one for one in (recorder, publisher) if one], seconds, stop)
        except Exception as error:
            if recorder is None or record is None or not recorder.rows:
                raise
            if not recorder.whole:
                raise _kept(outputs, recorder, record, error) from error
            failure = error  # what was recorded before is kept
    if failure is not None:
        raise failure
    return 0


def _kept(outputs: Outputs, recorder: Recorder, record: Path, error: Exception) -> Exception:
    """Keep the rows of a recording that could not be written to its end, and return an error that says where."""
    part, rows = recorder.saved()
    if not rows or not isinstance(error, OSError):
        return error
    kept = outputs.keep("--record", part)
    return OSError(f"cannot write {record}: {error.strerror or error}; {plural(rows, 'row')} kept in {kept}")


def _selftest(target: Target) -> int:
    """Run the self-test, and print what its steps have shown; 1 if one has failed."""
    report = SelftestReport([step.name for step in steps(target.registers)])
    with target.presence() as name, target.open(name) as port:
        board = connected(target.label(name), port, target.manifest, target.timeout)
        report.head()
        results = run_selftest(board, target.registers, told=report.line)
    return 0 if report.verdict(results) else 1


def _serve(target: Target, path: Path, seconds: Fraction | None) -> int:
    """Run a simulated board until it is stopped, for other programs."""
    with _interrupts() as stop, target.presence() as name:
        stop.orderly = True
        with Outputs({"--serve": path}) as outputs:
            outputs["--serve"].write_text(json.dumps(target.manifest, indent=2) + "\n", encoding="utf-8", newline="\n")
        click.echo(name)
        stop.wait(None if seconds is None else float(seconds))
    return 0


class _Stop(threading.Event):
    """Is set when the monitor shall end."""

    orderly = False  # from the beginning of what must have an orderly end: a compilation has none


@contextmanager
def _interrupts() -> Iterator[_Stop]:
    """Yield what Ctrl-C, SIGTERM and SIGHUP set; before and later on they interrupt, but not while all is tidied up."""
    stop = _Stop()
    begun = 0.0

    def hear(number: int, frame: FrameType | None) -> None:
        nonlocal begun
        if not stop.orderly:
            raise KeyboardInterrupt
        if not stop.is_set():
            begun = time.monotonic()
            stop.set()
        elif time.monotonic() - begun > _ORDERLY:
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = {number: signal.signal(number, hear) for number in STOPS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _refuse(other: str, others: dict[str, object]) -> None:
    for name, value in others.items():
        if value not in (None, ()):
            raise ValueError(f"{name} must not be given together with {other}")


def _ticks(registers: DemoMap, text: str) -> int:
    """Return ticks from a frame to the next."""
    timing = registers.spec.timing
    ticks = int(parse_time("every", text) / timing.tick_seconds + Fraction(1, 2))
    most = (1 << PERIOD_WIDTH) - 1
    if not 1 <= ticks <= most:
        raise ValueError(f"--every must be from 1 to {most} ticks of {float(timing.tick_seconds):g} s, not {text}")
    return ticks
