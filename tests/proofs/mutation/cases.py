"""What is mutated: small cores in which, method by method, all hardware is there."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from tachometry.spec import METHODS, Encoder, Speed, TachometerSpec, Timing


@dataclass(frozen=True)
class Case:
    """A core and how often it is mutated.

    Parameters
    ----------
    name : str
    spec : TachometerSpec
    mutants : int
    max_table : int
        Stands in for `MAX_TABLE` of the S method, so that small cores carry their reciprocal as large ones do.
    """

    name: str
    spec: TachometerSpec
    mutants: int
    max_table: int = 2048

    @property
    def method(self) -> str:
        """Of the core."""
        return self.spec.method


def _case(
    method: str,
    name: str,
    tick_cycles: int,
    max_ticks: int,
    max_count: int | None,
    mutants: int = 510,
    max_table: int = 2048,
    decoding: int = 4,
    **options: Any,
) -> Case:
    """A core by its numbers: ticks of `tick_cycles` clocks, and speeds of at most `max_count` counts in each.

    None: a count in every clock, so that a velocity of few bits may saturate.
    """
    # One revolution a second is a count a tick.
    spec = METHODS[method](
        encoder=Encoder(1, decoding),
        timing=Timing(decoding * tick_cycles, tick_cycles, max_ticks),
        max_speed=None if max_count is None else Speed.parse(f"{max_count}rev/s"),
        position_width=8,
        **{"frac_bits": 4} | options,
    )
    return Case(f"{method}, {name}", spec, mutants, max_table)


_FRONT: dict[str, Any] = {"filter_clocks": 2, "index": True, "index_reset": True}

# Ticks of an odd number of clocks: inverters in a loop would cancel over an even one.
CASES = [
    _case("s", "table", 3, 6, 1, 340, age=True),
    _case("s", "carried, serial", 15, 16, 2, 340, max_table=8, frac_bits=6, **_FRONT),
    _case("s", "carried, bounds", 3, 9, 1, 340, max_table=4, bounds=True, cancel=False),
    _case("m", "of 3", 3, 2, 2, average=3, bounds=True, age=True),
    _case(
        *("m", "of 4, rpm, low pass", 5, 2, 3),
        decoding=2,
        average=4,
        unit="rpm",
        frac_bits=6,
        max_tick_cycles=9,
        lowpass=Fraction(1, 2),
    ),
    _case("t", "in clocks", 7, 5, 3, bounds=True, age=True),
    _case("t", "in ticks", 5, 44, None, timer="tick", unit="rad/s", frac_bits=5, velocity_width=8, **_FRONT),
    _case("mt", "in clocks", 7, 5, 3, bounds=True, age=True),
    _case("mt", "in ticks", 9, 12, 1, timer="tick", max_tick_cycles=11, decoding=1),
    _case("rairan", "adaptive", 3, 8, 2, 340, adaptive=Fraction(1, 4), bounds=True, age=True),
    _case("rairan", "n2", 5, 6, 2, 340, estimate="n2", **_FRONT),
    _case("rairan", "to the letter", 3, 6, 2, 340, estimate="n1", paper_exact=True),
]
