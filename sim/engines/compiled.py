"""Engines that compile the core: a trace goes in as arrays, rows come out as arrays, and nothing in between is Python.

Memory grows with edges, ticks and updates, never with clocks.
"""

import ctypes
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from amaranth.lib import wiring
from numpy.typing import NDArray

from tachometry.hdl import core_of
from tachometry.hdl.arithmetic.idle import HasIdle, Idle
from tachometry.sim.engines.engine import NO_WATCH, Interrupted, Watch, driven_pins
from tachometry.sim.engines.probes import WORD, Watched
from tachometry.sim.engines.waveform import Waveform
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.recording import packed
from tachometry.sim.signals.run import Run, observed
from tachometry.spec import CoreSpec, Port
from tachometry.spec.control import AnySpec

DRIVER = files(__package__).joinpath("driver.h").read_text(encoding="utf-8")

_CALL = 0.05  # seconds that a call should take, so that progress is seen and Ctrl-C is heard
_FIRST_CALL = 1000  # clocks
_CAPACITY = 1 << 14  # rows
_SHORT, _LONG = 30_000, 30_000_000  # clocks: a run is brief up to the first, and long above the second
_SHORT_OF = {"track": 400_000}  # a machine takes seconds more to be compiled than those that its clocks take
# Members of a job of driver.h, but the last.
_JOB = (
    *("clock", "end", "at", "level", "n_changes", "next", "rows", "n_rows", "capacity"),
    *("shown", "n_shown", "shown_capacity", "shown_from", "shown_to", "every_clock", "skipped"),
)


def struct(name: str, **members: Any) -> type[ctypes.Structure]:
    """Return a structure of C with these members."""
    return type(name, (ctypes.Structure,), {"_fields_": list(members.items())})


@dataclass(frozen=True)
class Design:
    """Describes what is to be compiled."""

    spec: AnySpec
    pins: list[Port]  # inputs, in the order of their levels
    watched: Watched | None = None  # the core with shown signals, if there are any to be shown
    effort: int = 1  # of the compiler: 0 for a brief run, 1 for a short one, 2 for a long one

    @cached_property
    def component(self) -> wiring.Component:
        """The hardware, with the ports of the spec."""
        return core_of(self.spec) if self.watched is None else self.watched

    @property
    def wide(self) -> bool:
        """Whether levels are numbers, one for each pin, with a bit for each axis; else all are the bits of a byte."""
        return len(self.pins) > 8 or any(pin.width > 1 for pin in self.pins)

    def levels(self, trace: Trace) -> NDArray[Any]:
        """Return levels of all pins for each row of a trace, as `pins_text` reads them."""
        kind = np.uint64 if self.wide else np.uint8
        lines: list[NDArray[Any]] = [trace.lines[pin.name].astype(kind) for pin in self.pins]
        return np.stack(lines, axis=1) if self.wide else packed(lines)

    def pins_text(self, assign: Callable[[str, str], str]) -> str:
        """Return functions of the struct `Model` that set the pins; `assign` gives what sets one of them in C++."""
        level = "level[{}]" if self.wide else "level >> {} & 1"
        text = " ".join(assign(pin.name, level.format(place)) for place, pin in enumerate(self.pins))
        if self.wide:
            kind, row = "const uint64_t *", f"static_cast<const uint64_t *>(levels) + row * {len(self.pins)}"
        else:
            kind, row = "uint8_t ", "static_cast<const uint8_t *>(levels)[row]"
        return f"void pins({kind}level) {{ {text} }}\n  void play(const void *levels, int64_t row) {{ pins({row}); }}"

    @property
    def n_words(self) -> int:
        """Number of outputs `shown_0`, `shown_1` …."""
        return 0 if self.watched is None else self.watched.n_words

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Registers that may be moved on; none where signals are shown, as these change with them."""
        return self.component.idle if isinstance(self.component, HasIdle) else ()

    @property
    def outputs(self) -> list[Port]:
        """Outputs of the core, in order."""
        return list(self.spec.ports.outputs)

    @property
    def strobes(self) -> list[str]:
        """Names of those that make a row."""
        return list(self.spec.ports.strobes)

    def source(self, model: str) -> str:
        """Return the driver behind a text with the struct `Model`."""
        head = f"#define N_SHOWN {self.n_words}\n#define N_COLUMNS {1 + len(self.outputs)}\n"
        return f"{head}#include <cstdint>\n{model}\n{DRIVER}"


def effort_of(method: str, n_clocks: int) -> int:
    """Return the effort of the compiler for so many clocks of a method."""
    return (n_clocks > _SHORT_OF.get(method, _SHORT)) + (n_clocks > _LONG)


class CompiledEngine(ABC):
    """Loads a shared library with the core, which it looks up once for each spec."""

    name: str
    every_clock = False  # none is skipped

    def __init__(self) -> None:
        self._libraries: dict[tuple[AnySpec, int], Path] = {}

    @abstractmethod
    def library(self, design: Design) -> Path:
        """Return the compiled design, with the entries of driver.h."""

    def kept(self, design: Design) -> Path:
        """Return the library of a design, which is looked up once."""
        if design.watched is not None:
            return self.library(design)
        key = (design.spec, design.effort)
        if key not in self._libraries:
            self._libraries[key] = self.library(design)
        return self._libraries[key]

    def run(self, spec: CoreSpec, trace: Trace, watch: Watch = NO_WATCH) -> Run:
        return next(self.in_pieces(spec, iter([trace]), trace.n_clocks, watch))

    def in_pieces(self, spec: CoreSpec, pieces: Iterator[Trace], n_clocks: int, watch: Watch) -> Iterator[Run]:
        """Simulate pieces of a trace of `n_clocks` clocks; yield the rows of each, on the clock of all.

        Interrupted has the rows of a piece. A waveform has the first piece alone.
        """
        watched, play = None if watch.vcd is None else Watched(spec), None
        for pins in pieces:
            if play is None:
                design = Design(spec, driven_pins(spec, pins), watched, effort_of(spec.method, n_clocks))
                play = Play(self.kept(design), design, pins, watch.window or (0, n_clocks), self.every_clock)
            else:
                play.go_on(pins)
            with ExitStack() as stack:
                interrupt, waveform = None, None
                if watch.vcd is not None and watched is not None:
                    waveform = stack.enter_context(Waveform(watch.vcd, spec.timing.clock_hz, watched.widths))
                try:
                    play.to_the_end(waveform, watch.progress)
                except KeyboardInterrupt as raised:
                    interrupt = raised
                if waveform is not None:
                    waveform.close(min(play.done, play.window[1]))
            run = observed(spec, play.done, play.rows())
            if interrupt is not None:
                raise Interrupted(run) from interrupt
            yield run


class Play:
    """Plays a trace on a compiled design."""

    def __init__(self, library: Path, design: Design, trace: Trace, window: tuple[int, int], every_clock: bool) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.tachometer_new.restype = ctypes.c_void_p
        self._library.tachometer_delete.argtypes = (ctypes.c_void_p,)
        self._design, self.window, self._every_clock = design, window, every_clock
        self.done = self.skipped = 0  # clocks
        self._columns = 1 + len(design.outputs)
        self._n_words = design.n_words
        self._rows = np.empty((_CAPACITY, self._columns), dtype=np.int64)
        self._shown = np.empty((_CAPACITY if design.n_words else 0, 1 + design.n_words), dtype=np.int64)
        self._model = ctypes.c_void_p(self._library.tachometer_new())
        self._job = self._new_job()
        self.go_on(trace)

    def __del__(self) -> None:
        self._library.tachometer_delete(self._model)

    def go_on(self, trace: Trace) -> None:
        """Take the next trace, which follows the one that is done."""
        self._end = self.done + trace.n_clocks
        self._found: list[NDArray[np.int64]] = []
        self._at = np.ascontiguousarray(trace.clock + self.done, dtype=np.int64)
        self._level = self._design.levels(trace)
        job = self._job
        job.at, job.level, job.n_changes, job.next = self._at.ctypes.data, self._level.ctypes.data, len(self._at), 0

    def rows(self) -> NDArray[np.int64]:
        """Clock and outputs in every clock of the trace with a strobe that is done."""
        rows = np.concatenate([np.empty((0, self._columns), dtype=np.int64), *self._found])
        return rows[rows[:, 0] < self.done]

    def to_the_end(self, waveform: Waveform | None, progress: Callable[[int], None] | None) -> None:
        """Run all clocks; `done` and `rows` are of what has been run, also after an interrupt."""
        job, clocks = self._job, _FIRST_CALL
        while self.done < self._end:
            job.end = min(self.done + clocks, self._end)
            job.n_rows = job.n_shown = 0
            begun = time.perf_counter()
            self._library.tachometer_run(self._model, ctypes.byref(job))
            self._found.append(self._rows[: job.n_rows].copy())
            if waveform is not None:
                for clock, *words in self._shown[: job.n_shown].tolist():
                    waveform.sample(clock, sum(word << WORD * k for k, word in enumerate(words)))
            took = time.perf_counter() - begun
            clocks = max(_FIRST_CALL, int((job.clock - self.done) * min(_CALL / max(took, 1e-6), 4)))
            self.done, self.skipped = job.clock, job.skipped
            if progress is not None:
                progress(self.done)

    def _new_job(self) -> Any:
        kinds: dict[str, Any] = dict.fromkeys(_JOB, ctypes.c_int64)
        kinds |= dict.fromkeys(("at", "level", "rows", "shown"), ctypes.c_void_p)
        window = dict(zip(("shown_from", "shown_to"), self.window, strict=True))
        return struct("Job", **kinds, last=ctypes.c_uint32 * (self._n_words + 1))(
            **{name: array.ctypes.data for name, array in (("rows", self._rows), ("shown", self._shown))},
            **{"capacity": _CAPACITY, "shown_capacity": len(self._shown), "every_clock": self._every_clock, **window},
        )
