"""The words of the command line are read here without the program that is tested."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

PI = Fraction(31415926535897932384626433832795028841971, 10**40)
# How many of each unit are one revolution per second.
PER_TURN = {"rad/s": 2 * PI, "rev/s": Fraction(1), "rpm": Fraction(60)}

Words = Mapping[str, str]  # options without their dashes; a flag has the word "yes" or "no"


# Times, which the words have as numbers of clocks.
_CLOCKS = ("tick", "dt", "max-time", "min-time", "max-tick-period", "max-memory")


def arguments(words: Words) -> list[str]:
    """Return the words as the command line takes them."""
    flags = {"yes": "--{}", "no": "--no-{}"}
    return [
        part
        for name, word in words.items()
        for part in (
            [flags[word].format(name)]
            if word in flags
            else [f"--{name}", word + "clk" * (name in _CLOCKS and word.isdigit())]
        )
    ]


@dataclass(frozen=True)
class Settings:
    """The words, and the numbers that the pages of the project say they mean.

    Times are given in clocks here, so that a reader of units is not needed twice.
    """

    method: str
    words: Words

    def _whole(self, name: str, default: int) -> int:
        return int(str(self.words.get(name, default)).removesuffix("clk"))

    def flag(self, name: str, default: bool = False) -> bool:
        """Return whether a flag is set."""
        return self.words.get(name, "yes" if default else "no") == "yes"

    @cached_property
    def clock_hz(self) -> int:
        return int(self.words.get("clock", "48000000").removesuffix("Hz"))

    @cached_property
    def tick(self) -> int:
        """T, clocks of a tick: 20 µs if it is not given."""
        return self._whole("dt" if "dt" in self.words else "tick", self.clock_hz // 50_000)

    @cached_property
    def max_ticks(self) -> int:
        """Ticks of the maximum time: 10 ms if it is not given."""
        return self._whole("max-time", self.clock_hz // 100) // self.tick

    @cached_property
    def longest_tick(self) -> int:
        """Clocks of the longest tick: from outside it may last two nominal ticks if nothing is said."""
        return self._whole("max-tick-period", 2 * self.tick) if self.external else self.tick

    @cached_property
    def external(self) -> bool:
        return self.flag("external-tick")

    @cached_property
    def ppr(self) -> int:
        return self._whole("ppr", 0)

    @cached_property
    def decoding(self) -> int:
        return self._whole("decoding", 4)

    @cached_property
    def counts_per_turn(self) -> int:
        """P."""
        return self.ppr * self.decoding

    @property
    def turns(self) -> Fraction:
        """Turns of the encoder in one of the shaft."""
        return Fraction(self.words.get("ratio", "1"))

    @cached_property
    def tick_seconds(self) -> Fraction:
        """T_s."""
        return Fraction(self.tick, self.clock_hz)

    @cached_property
    def unit(self) -> str:
        return self.words.get("unit", "count/tick")

    @cached_property
    def native(self) -> bool:
        """Whether the velocity is in counts per tick."""
        return self.unit == "count/tick"

    @cached_property
    def own(self) -> bool:
        """Whether the velocity is shown as it is measured, in counts per tick and with all its bits."""
        every = self.max_velocity.bit_length() + 1 + self.frac_bits
        return self.native and self.velocity_bits in (None, every)

    @cached_property
    def filter(self) -> int:
        return self._whole("filter", 0)

    @cached_property
    def position_bits(self) -> int:
        return self._whole("position-width", 32)

    def per_count(self, unit: str) -> Fraction:
        """Return one count per tick in a unit: 1/(P·T_s) turns per second."""
        counts = self.counts_per_turn * self.turns * self.tick_seconds
        return Fraction(1) if unit == "count/tick" else PER_TURN[unit] / counts

    @cached_property
    def max_speed(self) -> tuple[Fraction, str] | None:
        """The greatest speed as number and unit."""
        word = self.words.get("max-speed")
        if word is None:
            return None
        unit = next(name for name in PER_TURN if word.endswith(name))
        return Fraction(word.removesuffix(unit)), unit

    @cached_property
    def max_count(self) -> int:
        """The most counts that a tick can show: ⌈max_speed/ω_u⌉ of the longest tick, and never more than its clocks."""
        if self.max_speed is None:
            return self.longest_tick
        value, unit = self.max_speed
        turns = value / PER_TURN[unit] * self.turns
        return min(
            self.longest_tick, math.ceil(turns * self.counts_per_turn * Fraction(self.longest_tick, self.clock_hz))
        )

    @cached_property
    def max_velocity(self) -> int:
        """The greatest speed in counts per tick; times have a count per timer period at most."""
        return min(self.max_count, self.tick // self.period) if self.method == "t" else self.max_count

    @cached_property
    def frac_bits(self) -> int:
        """Of the velocity: 16 in counts per tick, else 10, or as many as leave a count per tick within 2^22 LSB.

        Given both a width and a greatest speed, there are no more than leave all velocities within the width.
        """
        if "lsb" in self.words:
            return -int(self.words["lsb"].removeprefix("2^"))
        if "frac-bits" in self.words:
            return int(self.words["frac-bits"])
        count = self.per_count(self.unit)
        most = next(bits for bits in range(60, -200, -1) if count * Fraction(2) ** bits <= 1 << 22)
        most = 16 if self.native else min(10, most)
        if self.max_speed is not None and self.velocity_bits is not None:
            limit = (1 << self.velocity_bits - 1) - 1
            while count * self.max_velocity * Fraction(2) ** most > limit:
                most -= 1
        # The greatest speed must be more than one LSB.
        fewest = next(bits for bits in range(-200, 60) if count * self.max_velocity * Fraction(2) ** bits > 1)
        return max(4 if self.native else fewest, most)

    @cached_property
    def lsb_per_count(self) -> Fraction:
        """LSBs of the velocity in one count per tick."""
        return self.per_count(self.unit) * Fraction(2) ** self.frac_bits

    @cached_property
    def rad_per_s_per_lsb(self) -> Fraction:
        """An LSB of the velocity in rad/s."""
        return self.per_count("rad/s") / self.lsb_per_count

    @cached_property
    def velocity_bits(self) -> int | None:
        """Bits that the velocity was limited to."""
        return int(self.words["velocity-width"]) if "velocity-width" in self.words else None

    @cached_property
    def narrow(self) -> bool:
        """Whether the bits of the velocity do not hold its greatest value."""
        limit = math.inf if self.velocity_bits is None else 1 << self.velocity_bits - 1
        return self.max_velocity * self.lsb_per_count >= limit

    @cached_property
    def edge_error(self) -> Fraction:
        """The error of the distance of two edges, in counts: whole eighths, the word or more."""
        return Fraction(math.ceil(8 * Fraction(self.words.get("edge-error", "0"))), 8)

    @cached_property
    def lowpass(self) -> Fraction | None:
        """G in rad/s."""
        return self._bandwidth("lowpass")

    def _bandwidth(self, name: str) -> Fraction | None:
        """Return a bandwidth in rad/s; one in Hz is 2π times as many."""
        word = self.words.get(name)
        if word is None:
            return None
        for suffix, factor in (("rad/s", Fraction(1)), ("kHz", 2000 * PI), ("Hz", 2 * PI)):
            if word.endswith(suffix):
                return Fraction(word.removesuffix(suffix)) * factor
        raise AssertionError(word)

    @cached_property
    def max_memory(self) -> int | None:
        """Clocks that the memory does not grow beyond."""
        return self._whole("max-memory", 0) or None

    @cached_property
    def position_fine_bits(self) -> int:
        """Fraction bits of `position_fine`."""
        return self._whole("position-fine-bits", 6)

    @cached_property
    def average(self) -> int:
        return self._whole("average", 1)

    @cached_property
    def lattice(self) -> bool:
        return self.words.get("timer") == "tick"

    @cached_property
    def period(self) -> int:
        """Clocks of a timer period."""
        return self.tick if self.lattice else 1

    @cached_property
    def min_time(self) -> int:
        """T_c in clocks: a tick if it is not given."""
        return self._whole("min-time", self.tick)

    @cached_property
    def paper_exact(self) -> bool:
        return self.flag("paper-exact")

    @cached_property
    def decays(self) -> bool:
        return self.flag("bound-decay", True) and not self.paper_exact

    @cached_property
    def estimate(self) -> str:
        return self.words.get("estimate", "n3")

    @cached_property
    def target(self) -> Fraction | None:
        """The greatest error of eq. (13), for an adaptive dt."""
        word = self.words.get("adaptive")
        return None if word is None else Fraction(word.removesuffix("%")) / (100 if word.endswith("%") else 1)

    @cached_property
    def greatest_shift(self) -> int:
        """K of an adaptive dt, see docs/concepts/rairan.md."""
        if self.target is None:
            return 0
        found = 0
        while self._shift_fits(found + 1):
            found += 1
        return found

    def _shift_fits(self, k: int) -> bool:
        in_time = 2 << k <= self.max_ticks
        in_tables = self.max_count << k <= 2048
        if self.estimate == "n3" or self.flag("bounds"):
            return in_time and in_tables and (self.estimate == "n3" or k <= self.frac_bits)
        return in_time and k <= self.frac_bits
