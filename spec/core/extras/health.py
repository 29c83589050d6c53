"""Health: a watch of the encoder finds what is wrong with it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from typing import Any

from tachometry.spec.core.extras.extra import Event, Extra
from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.core.reads import ERROR_BIT, JUMP, NO_ANSWER, WRONG_CHECK
from tachometry.spec.core.timing import parse_filter
from tachometry.spec.language.option import ParameterError, check_options, option, parse_flag
from tachometry.spec.language.port import TICK, Port, held, pin
from tachometry.spec.language.units import format_time, plural


class Fault(IntEnum):
    """Names a fault; 0 is none. Of faults in one clock the lowest is shown."""

    A_STANDS = 1
    B_STANDS = 2
    INDEX_COUNTS = 3
    ILLEGAL = 4
    A_OPEN = 5
    B_OPEN = 6
    Z_OPEN = 7
    INDEX_MISSED = 8
    # Of an encoder that is read.
    NO_ANSWER = 16
    WRONG_CHECK = 17
    ERROR_BIT = 18
    WARNING = 19
    JUMP = 20


FAULT_WIDTH, READ_FAULT_WIDTH = 4, 5  # bits of a code, of edges and of reads
READ_FAULTS = Fault.NO_ANSWER - NO_ANSWER  # codes of reads are more by this than what is wrong with them
FAULTS_WIDTH = 8  # bits of the number of faults, which stays at its end
READ_COUNT_WIDTH = 16  # bits of the numbers of reads that were not taken, which stay at their end
READ_COUNTS = {"frame_errors": (NO_ANSWER, WRONG_CHECK, ERROR_BIT), "jumps": (JUMP,)}  # the reasons that each counts
_COUNTED = {
    "frame_errors": "Reads without an answer, with a wrong frame or with the error bit, since they were cleared",
    "jumps": "Reads that were further away than --max-speed allows, since they were cleared",
}
FAULT_TEXTS = {
    Fault.A_STANDS: "line a stands while b has edges: broken or shorted",
    Fault.B_STANDS: "line b stands while a has edges: broken or shorted",
    Fault.INDEX_COUNTS: "counts are lost or extra between two indices",
    Fault.ILLEGAL: "too many illegal transitions in a second",
    Fault.A_OPEN: "line a equals its complement a_n: an open circuit",
    Fault.B_OPEN: "line b equals its complement b_n: an open circuit",
    Fault.Z_OPEN: "line z equals its complement z_n: an open circuit",
    Fault.INDEX_MISSED: "z comes and goes without the state of --index-at",
    Fault.NO_ANSWER: "a read had no answer, or one that was too old",
    Fault.WRONG_CHECK: "a frame was wrong, by its CRC or sample_ok",
    Fault.ERROR_BIT: "the encoder's error bit: the position was not taken",
    Fault.WARNING: "the encoder's warning bit; the position was taken",
    Fault.JUMP: "a position was further away than --max-speed allows, and not taken",
}
COMPLEMENTS = (2, 1 << 20)  # the least and the most clocks
OPEN = {"a": Fault.A_OPEN, "b": Fault.B_OPEN, "z": Fault.Z_OPEN}  # of lines that have a complement

_ON = """Watch the encoder: outputs health, faults and fault. health is the first fault, faults how many there were, \
fault that there is one. With --index also index_error. A reset or CONTROL.clear clears them."""
_EDGES = """Edges of a line, 2 to 65536, by which the other is dead. They count within a second, without an edge of \
the other line. A shaft that swings about one edge has such edges as well (with --health)."""
_ERRORS = "Illegal transitions allowed in a second, 0 to 65535. More are a fault (with --health)."
_DIFFERENTIAL = """Differential encoder: inputs a_n, b_n, and z_n with --index. A line that equals its complement for \
longer than TIME is an open circuit, a fault (with --health). In s, ms, us or ns, rounded up to clocks; a plain number \
is clocks. 1us is more than the skew of receivers and cables."""


@dataclass(frozen=True, kw_only=True)
class Health(Extra):
    """Outputs `health`, the first fault, `faults`, how many, and `fault`; a reset or CONTROL.clear clears them."""

    name = "health"
    texts = {"health": FAULT_TEXTS}  # noqa: RUF012

    on: bool = option(True, _ON, name="health", flag=True, parse=parse_flag, tacit=True)
    edges: int = option(256, _EDGES, name="health-edges", metavar="N", limits=(2, 1 << 16), tests=("5",), tacit=True)
    errors: int = option(
        10, _ERRORS, name="health-errors", metavar="N", limits=(0, (1 << 16) - 1), tests=("0",), tacit=True
    )
    differential: int | None = option(
        None, _DIFFERENTIAL, name="differential", metavar="TIME", parse_at=parse_filter, tests=("2", "40"), tacit=True
    )

    def __post_init__(self) -> None:
        check_options(self)

    def missing(self) -> Mapping[str, str]:
        return {"axes": "must be left out with --axes: what watches the lines is for one axis"}

    def check(self, spec: Numbers) -> None:
        if not self.on:
            raise ParameterError("health", "must not be no among extras: leave it out")
        if spec.encoder.sampled:
            if self != Health():
                raise ParameterError("health", "must be alone for an encoder that is read: others are for edges")
            return
        if spec.encoder.sensor != "quadrature":
            rest = f"must be left out for {spec.encoder.sensor}: it watches two lines in quadrature"
            raise ParameterError("health", rest)
        if self.differential is not None and not COMPLEMENTS[0] <= self.differential <= COMPLEMENTS[1]:
            times = (format_time(Fraction(one) / spec.timing.clock_hz) for one in (*COMPLEMENTS, self.differential))
            raise ParameterError("differential", "must be from {} to {} at this clock, not {}".format(*times))

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        if self.differential is None:
            return
        for line in (*spec.encoder.kind.lines, *("z",) * (spec.index is not None)):
            port = pin(f"{line}_n", f"Complement of line {line.upper()}, asynchronous.")
            yield Pin(port, of=line, holds=self.differential)

    def faults(self, spec: Numbers) -> tuple[Fault, ...]:
        """Return the faults that can be seen."""
        if spec.encoder.sampled:
            reasons = (NO_ANSWER, WRONG_CHECK) if spec.reads is None else spec.reads.reasons
            return tuple(Fault(READ_FAULTS + one) for one in (*reasons, *(JUMP,) * (spec.reach is not None)))
        lines = spec.front_end.complemented
        absent = {fault for line, fault in OPEN.items() if line not in lines}
        absent |= {Fault.INDEX_MISSED} if spec.front_end.index_state is None else set()
        return tuple(fault for fault in Fault if fault < Fault.NO_ANSWER and fault not in absent)

    def read_counts(self, spec: Numbers) -> tuple[str, ...]:
        """Return which reads are counted, by the names of the ports."""
        return tuple(READ_COUNTS)[: 1 + (spec.reach is not None)] if spec.encoder.sampled else ()

    def ports(self, spec: Numbers) -> Iterable[Port]:
        codes = "; ".join(f"{code}: {FAULT_TEXTS[code]}" for code in self.faults(spec))
        now = "It also changes between ticks; a capture shows the present value."
        help = f"The first fault of the encoder since it was cleared; {codes}. {now}"
        yield held(TICK, "health", READ_FAULT_WIDTH if spec.encoder.sampled else FAULT_WIDTH, help=help)
        yield held(TICK, "faults", FAULTS_WIDTH, help="Faults of the encoder since they were cleared; it stays at 255.")
        yield held(TICK, "fault", help="There has been a fault of the encoder: health is not 0.")
        for name in self.read_counts(spec):
            yield held(TICK, name, READ_COUNT_WIDTH, unit="reads", help=f"{_COUNTED[name]}; it stays at 65535.")
        if spec.front_end.index_watched:
            text = "Counts by which the latest wrong turn from index to index went too far forward: lost, or extra."
            yield held(TICK, "index_error", spec.position_width, signed=True, unit="counts", help=text)

    def events(self, spec: Numbers) -> Mapping[str, Event]:
        return {"fault": Event("A fault of the encoder was seen, see health.", wires=("seen",))}

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        code, number = run.ticks.health[-1], int(run.ticks.faults[-1])
        faults = plural(number, "fault") + " or more" * (number == (1 << FAULTS_WIDTH) - 1)
        return "health", f"{faults}, first: {FAULT_TEXTS[code]}" if code else "no fault"
