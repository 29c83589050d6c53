"""Small cores are mutated, in which, method by method, all hardware is there."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from amaranth.lib import wiring
from numpy.typing import NDArray
from proofs.mutation.stimulus import Stimulus, stimulus

from tachometry.hdl import Tachometer
from tachometry.sim import golden
from tachometry.sim.signals.run import Run
from tachometry.spec import METHODS, Encoder, Port, Speed, TachometerSpec, Timing
from tachometry.spec.core.index import Index


@dataclass(frozen=True)
class Pins:
    """Ports of what is mutated.

    - `inputs`: The reset first; the clock is not among them.
    - `strobes`: Outputs with which there is a row; none: in every clock.
    """

    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    strobes: tuple[str, ...] = ()

    @property
    def places(self) -> list[tuple[int, int]]:
        """Word and lowest bit of each input in what is played: none goes over the end of a word."""
        found, word, bit = [], 0, 0
        for port in self.inputs:
            if bit + port.width > 64:
                word, bit = word + 1, 0
            found.append((word, bit))
            bit += port.width
        return found

    @property
    def n_words(self) -> int:
        """Words of all inputs in a clock."""
        return self.places[-1][0] + 1

    def words(self, n_clocks: int, levels: Mapping[str, NDArray[Any]]) -> NDArray[np.uint64]:
        """Return the played words, shape (n_clocks, n_words), from the level of each input in every clock; others are
        0.
        """
        found = np.zeros((n_clocks, self.n_words), dtype=np.uint64)
        for port, (word, bit) in zip(self.inputs, self.places, strict=True):
            if port.name in levels:
                level = levels[port.name].astype(np.uint64) & np.uint64((1 << port.width) - 1)
                found[:, word] |= level << np.uint64(bit)
        return found


@dataclass(frozen=True)
class Case:
    """A core and how often it is mutated.

    - `max_table`: Stands in for `MAX_TABLE` of the S method, so that small cores carry their reciprocal as large ones
      do.
    """

    name: str
    spec: TachometerSpec
    mutants: int
    max_table: int = 2048

    selection = "t:*"  # what of the netlist is mutated, for Yosys

    @property
    def group(self) -> str:
        """The method."""
        return self.spec.method

    @property
    def component(self) -> wiring.Component:
        """The core."""
        return Tachometer(self.spec)

    def play(self, n_clocks: int) -> Stimulus:
        """Return the words that are played on the mutants."""
        return stimulus(self.spec, n_clocks)

    def right(self, trace: Any) -> Run:
        """Return what the golden model says of a part of what is played."""
        return golden.run(self.spec, trace)

    @property
    def pins(self) -> Pins:
        """Ports of the core."""
        ports = [port for port in self.spec.ports if port.name != "clk"]
        return Pins(
            tuple(port for port in ports if port.direction == "input"),
            tuple(port for port in ports if port.direction == "output"),
            tuple(self.spec.ports.strobes),
        )


def _case(
    method: str,
    name: str,
    tick_cycles: int,
    max_ticks: int,
    max_count: int | None,
    mutants: int = 510,
    max_table: int = 2048,
    ppr: int = 1,
    decoding: int = 4,
    **options: Any,
) -> Case:
    """Return a core by its numbers: ticks of `tick_cycles` clocks, and speeds of at most `max_count` counts in each.

    None: a count in every clock, so that a velocity of few bits may saturate.
    """
    # One revolution a second is a count a tick.
    spec = METHODS[method](
        encoder=Encoder(ppr, decoding),
        timing=Timing(ppr * decoding * tick_cycles, tick_cycles, max_ticks),
        max_speed=None if max_count is None else Speed.parse(f"{max_count}rev/s"),
        position_width=8,
        **{"frac_bits": 4} | options,
    )
    return Case(f"{method}, {name}", spec, mutants, max_table)


_FRONT: dict[str, Any] = {"filter_clocks": 2, "index": Index(reset=True, at="edge")}

# Ticks of an odd number of clocks: inverters in a loop would cancel over an even one.
CASES = [
    _case("s", "carried", 3, 6, 1, 340, age=True),
    _case("s", "table", 15, 16, 2, 340, frac_bits=6, reciprocal_source="table", **_FRONT),
    _case("s", "divided", 31, 16, 2, 340, frac_bits=6),
    _case("s", "divided, wide", 47, 16, None, 340, frac_bits=24),
    _case("s", "carried, bounds", 3, 9, 1, 340, max_table=4, bounds=True, cancel=False),
    _case("m", "of 3", 3, 2, 2, average=3, bounds=True, age=True),
    _case(
        "m",
        "of 4, rpm, low pass",
        5,
        2,
        3,
        decoding=2,
        average=4,
        unit="rpm",
        frac_bits=6,
        external_tick=True,
        max_tick_cycles=9,
        lowpass=Fraction(1, 2),
    ),
    _case("t", "in clocks", 7, 5, 3, bounds=True, age=True),
    _case("t", "in ticks", 5, 44, None, timer="tick", unit="rpm", frac_bits=5, velocity_width=8, **_FRONT),
    _case("mt", "in clocks", 7, 5, 3, bounds=True, age=True),
    _case("mt", "whole cycles", 7, 5, 1, 340, whole_cycles=True),
    _case("mt", "in ticks", 9, 12, 1, timer="tick", external_tick=True, max_tick_cycles=11, decoding=1),
    _case("rairan", "adaptive", 3, 8, 2, 340, adaptive=Fraction(1, 4), bounds=True, age=True),
    _case("rairan", "n2", 5, 6, 2, 340, estimate="n2", **_FRONT),
    _case("rairan", "to the letter", 3, 6, 2, 340, estimate="n1", paper_exact=True),
    # A tenth of a second, after which they forget, is 26 ticks, and their longest memory 1024.
    _case("track", "serial", 900, 13, 2, 500, ppr=64, frac_bits=None, multiplier="serial", age=True),
    _case(
        "track",
        "block, external tick",
        300,
        13,
        5,
        500,
        ppr=64,
        frac_bits=None,
        multiplier="block",
        external_tick=True,
        max_tick_cycles=340,
        **_FRONT,
    ),
]
