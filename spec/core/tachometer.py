"""A tachometer is what is asked for: from encoder pins to velocity, whatever the method."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self, cast

from tachometry.spec.core.checks import check
from tachometry.spec.core.core import Core
from tachometry.spec.core.described import options_as_asked, parameters_of
from tachometry.spec.core.ports import bound_ports, ports_of
from tachometry.spec.core.tick import Scale
from tachometry.spec.core.timing import Timing
from tachometry.spec.core.velocity import Velocity
from tachometry.spec.language.port import Ports


@dataclass(frozen=True, kw_only=True)
class TachometerSpec(Core):
    """A core of one axis; a method is a subclass, which states what it has of its own.

    Its fields are options, None where nothing is asked for: those of the measurement are in `Asked`, those of features
    beside it in `Core`. What follows from them is in stages: `tick`, `scale`, `bound`, `velocity`, `form` (of the
    method alone), `latency`, `times`, `widths`, `recovery`, `front_end` and `words`; see `Numbers`. A value out of
    range raises ParameterError.
    """

    def __post_init__(self) -> None:
        check(self)

    @property
    def tachometer(self) -> "TachometerSpec":
        """The spec itself."""
        return self

    def shown_in(self, unit: str) -> Self:
        """Return the same core, whose speeds are shown in this unit unless they have one."""
        return replace(self, shown=unit)

    @cached_property
    def ports(self) -> Ports:
        """Ports of the exported core, in order."""
        return Ports(ports_of(self, (*bound_ports(self), *self.method_ports)))

    @property
    def options(self) -> dict[str, str]:
        """Texts of all options that are asked for, by their names; `of_options` makes the core of them again."""
        return options_as_asked(self)

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults and what follows included."""
        return parameters_of(self)

    @property
    def entries(self) -> dict[str, Any]:
        """Entries of the manifest beside ports and options: what a program must know of a core."""
        times, velocity, frac_bits = self.times, self.velocity, self.velocity.frac_bits
        found = {
            "method": self.method,
            "clock_hz": self.timing.clock_hz,
            "tick_cycles": self.timing.tick_cycles,
            "max_ticks": self.timing.max_ticks,
            "standstill_after_ticks": times.standstill_after_ticks,
            "counts_per_rev": counts if isinstance(counts := self.encoder.counts_per_rev, int) else float(counts),
            "decoding": self.encoder.decoding,
            "velocity": {
                "width": self.velocity.width,
                "frac_bits": frac_bits,
                "unit": self.unit,
                "rad_per_s_per_lsb": velocity.rad_per_s_per_lsb,
                "full_scale": velocity.full_scale * 2.0**-frac_bits,
                "full_scale_rad_per_s": velocity.full_scale * velocity.rad_per_s_per_lsb,
            },
            **self.method_entries,
            **{extra.name: extra.entry(self) for extra in self.extras},
            "max_time_cycles": times.longest,
            "min_time_cycles": times.shortest,
            "bounds": {"none": self.velocity.shown_absent} if self.bounds else None,
            "interval_unit_cycles": times.interval_unit,
            "latency_cycles": self.latency_entries,
            "recovery_cycles": self.recovery.clocks,
            "external_tick_cycles": (
                {"min": times.min_tick_cycles, "max": self.tick.longest} if self.external_tick else None
            ),
        }
        return {name: entry for name, entry in found.items() if entry is not None}


class WithTachometer:
    """Properties that a core has from its tachometer."""

    tachometer: TachometerSpec

    def shown_in(self, unit: str) -> Self:
        """Return the same core, whose speeds are shown in this unit unless they have one."""
        return replace(cast(Any, self), tachometer=self.tachometer.shown_in(unit))

    @property
    def method(self) -> str:
        """Name of the tachometer's method."""
        return self.tachometer.method

    @property
    def timing(self) -> Timing:
        """Clock, tick and maximum time."""
        return self.tachometer.timing

    @property
    def scale(self) -> Scale:
        """One count per tick, in other units."""
        return self.tachometer.scale

    @property
    def velocity(self) -> Velocity:
        """Unit and LSB of the velocity."""
        return self.tachometer.velocity
