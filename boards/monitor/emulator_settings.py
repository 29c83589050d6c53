"""Reads settings of the emulator as people write them."""

import math
from collections.abc import Callable, Iterable
from fractions import Fraction

from tachometry.spec import ParameterError, TachometerSpec
from tachometry.spec.language.field import WORD
from tachometry.spec.language.units import FRACTION, SPEED, TIME, Unit, read_exactly, read_nearest, rounded
from tachometry.spec.registers.demo import ENCODER_LINES
from tachometry.spec.registers.emulator import (
    BOUNCE_WIDTH,
    DROP_WIDTH,
    ERROR_WIDTH,
    FINE_WIDTH,
    JITTER_WIDTH,
    NOISE_WIDTH,
    fastest,
    rate_of,
    speed_of,
)

_ACCELERATION = {name: SPEED[speed] for name, speed in {"rad/s/s": "rad/s", "rev/s/s": "rev/s", "rpm/s": "rpm"}.items()}
_OF_PERIOD = {"": Unit(), "%": Unit(Fraction(1, 100)), "deg": Unit(Fraction(1, 360))}
_SOURCES = {"pins": 0, "emulator": 1}

Fields = dict[str, int]


def emulator_settings(spec: TachometerSpec, words: Iterable[str]) -> Fields:
    """Return fields of the demo's registers from words such as `speed=100rad/s`.

    It raises ValueError if a word is none of these, or its value cannot be set.
    """
    found: Fields = {}
    for word in words:
        name, sign, text = word.partition("=")
        if not sign or name not in _READERS:
            raise ValueError(f"--set must be NAME=VALUE with a NAME of {', '.join(_READERS)}, not {word!r}")
        try:
            found |= _READERS[name](spec, text.strip())
        except ParameterError as error:  # options of other commands have these names, too
            raise ValueError(f"--set {name} {error.rest}") from error
    if "speed" in found:
        found = {"emulated": 1} | found
    return found


def limits(spec: TachometerSpec) -> dict[str, tuple[float, float, str]]:
    """Return the least and the greatest of each setting that is a number, and its unit, by its name."""
    error, jitter, drop = (1 << ERROR_WIDTH - 1, (1 << JITTER_WIDTH) - 1, (1 << DROP_WIDTH) - 1)
    speed, edge = float(rounded(fastest(spec), up=False, digits=6)), 100 / (1 << FINE_WIDTH)
    return {
        "speed": (-speed, speed, "rad/s"),
        "jitter": (0.0, jitter * edge, "%"),
        **{name: (-error * edge, (error - 1) * edge, "%") for name in ("phase-error", "duty-a", "duty-b")},
        "bounce": (0.0, ((1 << BOUNCE_WIDTH) - 1) / spec.timing.clock_hz * 1e6, "us"),
        "drop": (0.0, 100 * drop / (1 << DROP_WIDTH), "%"),
    }


def _speed(spec: TachometerSpec, text: str) -> Fields:
    speed, most = read_nearest("speed", text, SPEED, "rad/s"), fastest(spec)
    if abs(speed) > most:
        limit = rounded(most, up=False, digits=6)
        raise ParameterError("speed", f"must be from -{limit} to {limit} rad/s with this clock, not {text}")
    return {"speed": min(speed_of(spec, speed), (1 << WORD - 1) - 1)}


def _acceleration(spec: TachometerSpec, text: str) -> Fields:
    plain = text.replace("s2", "s/s").replace("s^2", "s/s")
    rate = rate_of(spec, read_nearest("acceleration", plain, _ACCELERATION, "rad/s/s"))
    if not 1 <= rate < 1 << WORD:
        least = 1e9 / rate_of(spec, 1e9)
        most = least * ((1 << WORD) - 1)
        raise ParameterError("acceleration", f"must be from {least:.4g} to {most:.4g} rad/s/s here, not {text}")
    return {"rate": rate}


def _source(spec: TachometerSpec, text: str) -> Fields:
    if text not in _SOURCES:
        raise ParameterError("source", f"must be pins or emulator, not {text!r}")
    return {"emulated": _SOURCES[text]}


def _error(name: str) -> Callable[[TachometerSpec, str], Fields]:
    """Return how late an edge is, as a part of a period of the line."""
    field = name.replace("-", "_")

    def read(spec: TachometerSpec, text: str) -> Fields:
        steps = _steps(name, text, 1 << FINE_WIDTH, -(1 << ERROR_WIDTH - 1), (1 << ERROR_WIDTH - 1) - 1)
        return {field: steps}

    return read


def _jitter(spec: TachometerSpec, text: str) -> Fields:
    # Each set bit takes part: the greatest movement of all is 2^k - 1.
    steps = _steps("jitter", text, 1 << FINE_WIDTH, 0, (1 << JITTER_WIDTH) - 1)
    return {"jitter": min(((1 << bits) - 1 for bits in range(JITTER_WIDTH + 1)), key=lambda most: abs(most - steps))}


def _bounce(spec: TachometerSpec, text: str) -> Fields:
    hertz = spec.timing.clock_hz
    seconds = read_exactly("bounce", text, {"": Unit(Fraction(1, hertz)), **TIME})
    clocks, most = math.floor(seconds * hertz + Fraction(1, 2)), (1 << BOUNCE_WIDTH) - 1
    if not 0 <= clocks <= most:
        raise ParameterError("bounce", f"must be from 0 to {most} clocks, {most / hertz * 1e6:.4g}us, not {text}")
    return {"bounce": clocks}


def _wires(name: str) -> Callable[[TachometerSpec, str], Fields]:
    """Return which lines are at fault."""

    def read(spec: TachometerSpec, text: str) -> Fields:
        words = {word.strip() for word in text.lower().split(",")} - {"none"}
        if wrong := sorted(words - {*ENCODER_LINES}):
            raise ParameterError(name, f"must be none, or of a, b, z, with commas between, not {wrong[0]!r}")
        return {name: sum(1 << place for place, line in enumerate(ENCODER_LINES) if line in words)}

    return read


def _steps(name: str, text: str, per_one: int, least: int, most: int) -> int:
    units = FRACTION if name in ("drop", "glitches") else _OF_PERIOD
    steps = math.floor(read_exactly(name, text, units) * per_one + Fraction(1, 2))
    if not least <= steps <= most:
        raise ParameterError(
            name, f"must be from {100 * least / per_one:.4g}% to {100 * most / per_one:.4g}%, not {text}"
        )
    return steps


_READERS: dict[str, Callable[[TachometerSpec, str], Fields]] = {
    "speed": _speed,
    "acceleration": _acceleration,
    **{name: _error(name) for name in ("phase-error", "duty-a", "duty-b")},
    "jitter": _jitter,
    "bounce": _bounce,
    "drop": lambda _, text: {"drop": _steps("drop", text, 1 << DROP_WIDTH, 0, (1 << DROP_WIDTH) - 1)},
    "glitches": lambda _, text: {"glitches": _steps("glitches", text, 1 << 2 * NOISE_WIDTH, 0, (1 << NOISE_WIDTH) - 1)},
    **{name: _wires(name) for name in ("broken", "stuck")},
    "source": _source,
}
