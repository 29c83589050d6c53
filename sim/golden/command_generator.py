"""The golden command generator makes constant speeds, ramps and sines in exact integers, one control tick at a time."""

from collections.abc import Iterable
from dataclasses import dataclass

from tachometry.spec.control.generator import FACTOR_BITS, RAMP, SINE, GeneratorForm, Scale


@dataclass(frozen=True)
class Command:
    """Holds the commands of a control tick, in LSB of the ports."""

    position: int = 0
    velocity: int = 0
    acceleration: int = 0
    enable: bool = True


@dataclass(frozen=True)
class Demand:
    """Holds the inputs of the generator in a control tick, in LSB of the ports."""

    mode: int = 0
    velocity: int = 0
    acceleration: int = 0
    amplitude: int = 0
    rate: int = 0
    enable: bool = True


@dataclass(frozen=True)
class Gains:
    """Holds gains and limit of a control tick, in LSB of the ports."""

    position: int
    velocity: int
    acceleration: int
    disturbance: int
    limit: int


def _product(word: int, factor: int) -> int:
    return (word * factor + (1 << (FACTOR_BITS - 1))) >> FACTOR_BITS


def _held(value: int, most: int) -> int:
    return max(-most, min(value, most))


class Generator:
    """Keeps the state of a generator between two control ticks.

    - `place`, `speed`, `change`: In 2^−F counts, counts per control tick, and counts per control tick squared; the
      place does not wrap.
    - `toward`: The way to the middle of the sine.
    """

    def __init__(self, form: GeneratorForm) -> None:
        self._form = form
        self.place = self.speed = self.change = self.toward = 0
        self._swings = False

    def command(self, enable: bool = True) -> Command:
        """Return the present command."""
        form = self._form
        wide = form.place_width
        place = (self.place + (1 << (wide - 1))) % (1 << wide) - (1 << (wide - 1))
        return Command(
            place >> form.amplitude_shift,
            self._shown(self.speed, form.velocity, form.command_width),
            self._shown(self.change, form.acceleration, form.acceleration_width),
            enable,
        )

    def _shown(self, value: int, scale: Scale, width: int) -> int:
        word = value >> scale.shift if scale.shift >= 0 else value << -scale.shift
        return _held(_product(word, scale.factor), (1 << (width - 1)) - 1)

    def tick(self, position: int, demand: Demand) -> None:
        """Take a control tick at a position, in counts."""
        form = self._form
        if not demand.enable:
            self.place, self.speed, self.change, self._swings = position << form.fraction, 0, 0, False
            return
        sine = demand.mode >= SINE
        if sine and self._swings:
            self.change = _product(self.toward >> form.away_shift, demand.rate)
        else:
            self.change = (0 if sine else demand.velocity << form.velocity_shift) - self.speed
            self.toward = demand.amplitude << form.amplitude_shift
            if demand.mode == RAMP:
                self.change = _held(self.change, demand.acceleration)
        self._swings = sine
        self.speed = _held(self.speed + self.change, form.most_velocity)
        self.place += self.speed
        self.toward = _held(self.toward - self.speed, form.most_away)


def generated(form: GeneratorForm, positions: Iterable[int], demands: Iterable[Demand]) -> list[Command]:
    """Return the command of each control tick, from its position and demand."""
    generator = Generator(form)
    found = []
    for position, demand in zip(positions, demands, strict=True):
        found.append(generator.command(demand.enable))
        generator.tick(position, demand)
    return found
