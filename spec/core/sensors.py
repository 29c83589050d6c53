"""Facts of the sensors: the lines of each, the order of their levels, and what a change of them counts."""

import re
from dataclasses import dataclass
from functools import cache

from tachometry.spec.language.option import ParameterError

Levels = tuple[int, ...]  # of the lines, 0 or 1
EDGE = "edge"  # where an index is taken that is not taken in a state of the lines
USUAL_STATE = "A=1,B=1"  # where it is taken in quadrature, unless it is said


def packed_levels(levels: Levels) -> int:
    """Return levels of lines as a number, the first lowest."""
    return sum(level << line for line, level in enumerate(levels))


@dataclass(frozen=True)
class Sensor:
    """Describes a kind of sensor."""

    name: str
    lines: tuple[str, ...]  # its lines, beside the index
    decodings: tuple[int, ...]  # counts per pulse that it can have, the usual one first
    # levels of the lines in a period, in forward order; empty where levels do not tell a place in a period
    cycle: tuple[Levels, ...]
    pins: tuple[str, ...]  # what each line is
    wrong: str  # in which clocks `decode_error` is high, and what is counted then; empty: never

    def after(self, levels: Levels) -> Levels:
        """Return the levels that follow these forward."""
        return self.cycle[(self.cycle.index(levels) + 1) % len(self.cycle)]

    def held(self, decoding: int) -> dict[str, bool]:
        """Return the lines whose changes are counted or tell where they are, and whether their rises alone are."""
        rises = self.name != "quadrature" and decoding == 1
        return dict.fromkeys(self.lines[:1] if self.name == "step-dir" else self.lines, rises)

    @property
    def legal(self) -> tuple[Levels, ...]:
        """Levels that there may be."""
        return self.cycle or tuple((number & 1, number >> 1) for number in range(4))

    def change(self, decoding: int, before: Levels, after: Levels) -> tuple[int, bool]:
        """Return what a change from legal levels to legal levels counts, −1, 0 or +1, and whether it is wrong.

        In a cycle a change to the next levels is forward and one to those before is backward. A greater one is wrong
        and counts nothing. Quadrature x2 counts where A changes, x1 where it does so while B is low.
        """
        if before == after:
            return 0, False
        match self.name:
            case "pulses":
                return int(decoding == 2 or after == (1,)), False
            case "step-dir":
                steps = before[0] != after[0] if decoding == 2 else before[0] < after[0]
                return (2 * after[1] - 1) * steps, steps and before[1] != after[1]
            case "up-down":
                up, down = (now > then for then, now in zip(before, after, strict=True))
                return up - down, up and down
        turn = (self.cycle.index(after) - self.cycle.index(before)) % len(self.cycle)
        step = {1: 1, len(self.cycle) - 1: -1}.get(turn, 0)
        counted = decoding >= 4 or (before[0] != after[0] and (decoding == 2 or after[1] == 0))
        return step * counted, step == 0


_SENSORS = (
    Sensor(
        "quadrature",
        ("a", "b"),
        (4, 2, 1),
        ((0, 0), (1, 0), (1, 1), (0, 1)),
        ("Encoder line A, asynchronous. Forward is A before B.", "Encoder line B, asynchronous."),
        "both lines changed at once, so the direction is unknown and nothing was counted.",
    ),
    Sensor("pulses", ("a",), (2, 1), ((0,), (1,)), ("Line of the sensor, asynchronous.",), ""),
    Sensor(
        "step-dir",
        ("a", "b"),
        (1, 2),
        (),
        (
            "Step line, asynchronous: each rise is a count, with decoding 2 each fall, too.",
            "Direction, asynchronous: high is forward. It must be stable for a clock before the step.",
        ),
        "the direction changed together with a step, which was counted in the new direction.",
    ),
    Sensor(
        "up-down",
        ("a", "b"),
        (1,),
        (),
        (
            "Line of the pulses up, asynchronous: each rise is a count forward.",
            "Line of the pulses down, asynchronous: each rise is a count backward.",
        ),
        "a pulse up and one down rose at once, and nothing was counted.",
    ),
    Sensor(
        "hall",
        ("a", "b", "c"),
        (6,),
        ((1, 0, 1), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)),
        (
            "Hall sensor A, asynchronous. Forward is A before B before C, 120 electrical degrees apart.",
            "Hall sensor B, asynchronous.",
            "Hall sensor C, asynchronous.",
        ),
        "all lines became equal, or more than one changed from one state to another; nothing was counted.",
    ),
)
SENSORS = {sensor.name: sensor for sensor in _SENSORS}  # whose edges are counted
_NOT_TAKEN = "a read was wrong or older than two ticks, and was not taken."
# Whose position is read: by what is around the core, or by the core itself.
READ = {name: Sensor(name, (), (1,), (), (), _NOT_TAKEN) for name in ("sampled", "ssi", "biss", "spi", "tformat")}
KINDS = {**SENSORS, **READ}


def parse_state(what: str, text: str) -> str:
    """Return levels of lines in which an index is taken, `A=1,B=1`, or `edge`."""
    words = [word.strip().upper() for word in text.split(",")]
    if words == [EDGE.upper()]:
        return EDGE
    if not all(re.fullmatch("[ABC] *= *[01]", word, re.ASCII) for word in words):
        raise ParameterError(what, f"must be {EDGE}, or levels such as A=1,B=1, not {text!r}")
    return ",".join(sorted(f"{word[0]}={word[-1]}" for word in words))


def parse_modulo(what: str, text: str) -> str:
    """Return counts in which a position is told, a number, or parts of a revolution, `rev` or `rev/4`."""
    word = text.replace(" ", "").lower()
    if not re.fullmatch(r"0*[1-9]\d{0,8}|rev(/0*[1-9]\d{0,8})?", word, re.ASCII):
        raise ParameterError(
            what, f"must be a number of counts up to 999999999, rev, or rev/P for P pole pairs, not {text!r}"
        )
    of, slash, parts = word.partition("/")
    return of + slash + str(int(parts)) if slash else of if of == "rev" else str(int(of))


@cache
def changes(name: str, decoding: int) -> dict[tuple[Levels, Levels], tuple[int, bool]]:
    """Return what each change of legal levels counts, and whether it is wrong, see `Sensor.change`."""
    sensor = SENSORS[name]
    return {
        (before, after): sensor.change(decoding, before, after) for before in sensor.legal for after in sensor.legal
    }
