"""`monitor` watches a board, tests it, or runs a simulated one for others."""

from __future__ import annotations

import json
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from types import FrameType

import click

from tachometry.boards.monitor.recorder import Recorder
from tachometry.boards.monitor.selftest import Result, steps
from tachometry.boards.monitor.selftest import selftest as run_selftest
from tachometry.boards.monitor.session import Session, connected
from tachometry.cli.commands.monitored import Target
from tachometry.cli.files import Outputs
from tachometry.cli.reports.monitor import Display, State
from tachometry.spec.language.units import plural

# A terminal that is closed, too, where there is this signal.
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_ORDERLY = 3.0  # seconds that an end may take before it can be interrupted
_COUNTERS = 0.5  # seconds from a look at the counters to the next
_PATIENCE = 5.0  # seconds without telemetry after which a duration can be over


@contextmanager
def interrupts() -> Iterator[threading.Event]:
    """Yield an event that Ctrl-C, SIGTERM and SIGHUP set; later on they interrupt, but not while
    all is put in order.
    """
    stop = threading.Event()
    begun = 0.0

    def hear(number: int, frame: FrameType | None) -> None:
        nonlocal begun
        if not stop.is_set():
            begun = time.monotonic()
            stop.set()
        elif time.monotonic() - begun > _ORDERLY:
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = {number: signal.signal(number, hear) for number in _SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def watch(
    session: Session,
    state: State,
    screen: Display,
    recorder: Recorder | None,
    seconds: Fraction | None,
    stop: threading.Event,
) -> None:
    """Show and record telemetry until it is stopped, or for so many seconds of the board.

    Raises
    ------
    TimeoutError
        If none has come in this time.
    """
    heard = looked = time.monotonic()
    over = False
    try:
        while not (over or stop.is_set()):
            frames = list(session.poll())
            now = time.monotonic()
            if frames:
                heard = now
            elif seconds is not None and now - heard > max(float(seconds), _PATIENCE):
                if state.frame is None:
                    raise TimeoutError(f"no telemetry has come in {now - heard:.0f} s: {session.waits_for}")
                over = True
            if seconds is not None and frames and frames[-1].time > seconds:
                frames = [frame for frame in frames if frame.time <= seconds]
                over = True
            if recorder is not None:
                for frame in frames:
                    recorder.write(frame)
            if over or not state.counters or now - looked >= _COUNTERS:
                looked = now
                state.counters = session.counters() or state.counters
            state.take(frames)
            state.counts, state.waits_for = session.counts, session.waits_for
            screen.show(state)
    finally:
        session.close()
    screen.end(state)


def selftest(target: Target) -> int:
    """Run the self-test, and print what its steps have shown; 1 if one has failed.

    Raises
    ------
    OSError
        If the port cannot be used, or nothing answers.
    ValueError
        If something else than the board answers.
    """
    names = [step.name for step in steps(target.registers)]
    width = max(map(len, names))

    def told(result: Result) -> None:
        verdict = "pass" if result.passed else f"FAIL: {result.difference or 'no telemetry'}"
        click.echo(f"{result.name:<{width}}  {result.frames:>6}  {result.values:>7}  {verdict}")

    with target.running() as name, target.opened(name) as port:
        board = connected(target.label(name), port, target.manifest)
        click.echo(f"{'step':<{width}}  frames   values")
        results = run_selftest(board, target.registers, told=told)
    failed = sum(not result.passed for result in results)
    click.echo(f"{'FAIL' if failed else 'PASS'}: {len(results) - failed} of {plural(len(results), 'step')} passed")
    return 1 if failed else 0


def serve(target: Target, path: Path, seconds: Fraction | None) -> int:
    """Run a simulated board until it is stopped, for other programs."""
    with interrupts() as stop, target.running() as name:
        with Outputs({"--serve": path}) as outputs:
            outputs["--serve"].write_text(json.dumps(target.manifest, indent=2) + "\n", encoding="utf-8", newline="\n")
        click.echo(name)
        stop.wait(None if seconds is None else float(seconds))
    return 0
