"""In the self-test of a demo board the emulator moves in known ways, and golden models say what every frame must
show.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from tachometry.boards.host.demo import DemoBoard
from tachometry.boards.host.link import NoAnswer
from tachometry.boards.monitor.emulated_reads import with_reads
from tachometry.sim.golden.emulator import Change, GoldenEmulator
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.spec.registers.demo import DemoMap, emulated
from tachometry.spec.registers.emulator import EmulatorSettings, fastest, rate_of, speed_of

_EVENTS = ("updated", "indexed")  # flags that say what was between two captures
_SILENCE = 30.0  # seconds after which no more telemetry will come


@dataclass(frozen=True)
class Step:
    """Is a part of the self-test, from a restart on."""

    name: str
    first: EmulatorSettings  # what holds from the restart on
    # settings that change, each so many seconds after the change before, or the restart, at the earliest
    then: Sequence[tuple[float, dict[str, int]]] = ()
    rest: float = 0.05  # seconds after the last change


@dataclass(frozen=True)
class Result:
    """Holds the outcome of a step."""

    name: str
    frames: int  # frames of telemetry that were compared
    values: int  # words that were compared
    difference: str = ""  # the first difference; empty if there is none

    @property
    def passed(self) -> bool:
        """Whether there was something to compare, and no difference."""
        return self.frames > 0 and not self.difference


def steps(registers: DemoMap) -> list[Step]:
    """Return speeds, reversals, standstill, illegal edges, an encoder with all its faults, and lines at fault."""
    spec = registers.spec
    highest = min(spec.max_speed.rad_per_s if spec.max_speed else math.inf, fastest(spec))
    silence = 2.5 * spec.times.standstill_after_ticks * spec.timing.tick_cycles / spec.timing.clock_hz

    def at(part: float) -> int:
        return speed_of(spec, part * highest)

    quick = min(rate_of(spec, highest / 0.02), (1 << 32) - 1)
    turning = EmulatorSettings(speed=at(0.3))
    faults = replace(turning, phase_error=30, duty_a=-20, duty_b=15, jitter=15, bounce=1, drop=3)
    return [
        *(Step(f"speed {part:+.4g} of the highest", EmulatorSettings(speed=at(part))) for part in (1, -0.5, 0.05)),
        Step("slow", EmulatorSettings(speed=at(0.001)), rest=0.05 + silence),
        Step("acceleration", EmulatorSettings(speed=at(0.9), rate=quick)),
        Step(
            "reversals",
            EmulatorSettings(speed=at(0.5), rate=quick),
            [(0.03, {"speed": at(-0.5)}), (0.03, {"speed": at(0.5)})],
        ),
        Step("standstill", turning, [(0.02, {"speed": 0})], rest=silence),
        Step("from standstill", EmulatorSettings(), [(silence, {"speed": at(-0.2)})]),
        Step("illegal edges", turning, [(0.02, {"jump": 1})] * 3),
        Step("a bad encoder", faults),
        Step("wires", turning, [(0.02, {"broken": 1}), (0.02, {"broken": 0, "stuck": 2})]),
        Step("noise, and no index", replace(turning, glitches=8), [(0.02, {"stuck": 4})]),
    ]


def selftest(
    board: DemoBoard,
    registers: DemoMap,
    period: int = 0,
    told: Callable[[Result], None] | None = None,
    chosen: Sequence[Step] | None = None,
) -> list[Result]:
    """Run all steps, and hold what the board says against the golden models; NoAnswer if the board falls silent.

    - `period`: Ticks between frames; 0: about 2 ms.
    - `chosen`: None: those of `steps`.
    """
    timing = registers.spec.timing
    period = period or max(1, math.ceil(timing.clock_hz / timing.tick_cycles / 500))
    results = []
    try:
        for step in steps(registers) if chosen is None else chosen:
            results.append(_run(board, registers, step, period))
            if told is not None:
                told(results[-1])
    finally:
        board.stream(0)
        board.set(speed=0, emulated=0)
    return results


def _run(board: DemoBoard, registers: DemoMap, step: Step, period: int) -> Result:
    clock_hz = registers.spec.timing.clock_hz
    board.stream(0)
    board.set(emulated=1, **asdict(step.first))
    board.stream(period)  # before the restart: the line may be slower than what is to be seen
    board.restart()
    board.client.clear()
    cleared = board.changed()
    held = step.first
    changes = [Change(-1, held)]
    seen: list[tuple[int, ...]] = []
    words = _Words(board, registers)
    for wait, values in step.then:
        seen += words.until(changes[-1].clock + 1 + round(wait * clock_hz))
        for name, value in values.items():
            held = held if name == "jump" else replace(held, **{name: value})
            changes.append(Change(board.set(**{name: value}), held, name == "jump"))
    seen += words.until(changes[-1].clock + 1 + round(step.rest * clock_hz))
    board.stream(0)
    errors = board.client.counters()["decode_errors"]
    counted = (errors, board.set(glitches=held.glitches))  # faults may go on after the last frame, up to this clock
    return _compared(registers, step.name, changes, cleared, seen, counted, period)


class _Words:
    """Waits for telemetry until an instant, however long that takes."""

    def __init__(self, board: DemoBoard, registers: DemoMap) -> None:
        self._board = board
        self._time = [register.name for register in registers if register.captured].index("TIME")

    def until(self, clock: int) -> Iterator[tuple[int, ...]]:
        latest = time.monotonic()
        while True:
            arrived = self._board.link.poll()
            yield from arrived
            if arrived:
                latest = time.monotonic()
                if arrived[-1][self._time] >= clock:
                    return
            if time.monotonic() - latest > _SILENCE:
                raise NoAnswer(f"no telemetry has come for {_SILENCE:g} s")


def _compared(
    registers: DemoMap,
    name: str,
    changes: list[Change],
    cleared: int,
    seen: list[tuple[int, ...]],
    counted: tuple[int, int],
    period: int,
) -> Result:
    spec = registers.spec
    most = 1.5 * period * spec.timing.tick_cycles  # clocks between two frames if none was lost
    captured = [(number, register) for number, register in enumerate(registers) if register.captured]
    at = [register.name for _, register in captured].index("TIME")
    n_clocks = max(words[at] for words in seen) + 1
    errors, until = counted
    played = GoldenEmulator(*emulated(spec)).trace(changes, max(n_clocks, until + 1))
    ticks = np.arange(1, played.n_clocks, spec.timing.tick_cycles)
    trace = played.with_tick_in(ticks) if spec.external_tick else played
    trace = with_reads(spec, trace) if spec.encoder.sampled else trace
    bank = GoldenBank(registers, trace)
    before = sum(words[at] < cleared for words in seen) * len(captured)
    reads = [Access(words[at], number) for words in seen for number, _ in captured]
    reads.insert(before, Access(cleared, registers["CONTROL"].offset // 4, 1))
    reads += [Access(clock, registers["COUNTERS"].offset // 4) for clock in (n_clocks - 1, played.n_clocks - 1)]
    golden = [right for right, _ in bank.answers(reads)]
    del golden[before]
    compared = 0
    for k, words in enumerate(seen):
        answers = golden[k * len(captured) : (k + 1) * len(captured)]
        for (_, register), word, right in zip(captured, words, answers, strict=True):
            if right is None:
                continue
            wrong = right ^ word
            if k == 0 or words[at] - seen[k - 1][at] > most:  # what was before a restart or a lost frame is not known
                wrong &= ~sum(field.mask for field in register.fields if field.name in _EVENTS)
            compared += 1
            if wrong:
                other = f"{register.name} is 0x{word:08x}, not 0x{right:08x}, in clock {words[at]}"
                return Result(name, k + 1, compared, other)
    (field,) = (field for field in registers["COUNTERS"].fields if field.name == "decode_errors")
    least, greatest = ((right or 0) >> field.low & (1 << field.width) - 1 for right in golden[-2:])
    wanted = f"{least}" if least == greatest else f"{least} to {greatest}"
    other = "" if least <= errors <= greatest else f"{errors} illegal transitions are counted, not {wanted}"
    return Result(name, len(seen), compared + 1, other)
