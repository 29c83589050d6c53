"""All methods share checks and ports, and say here how they differ."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

from tachometry.spec.core.numbers import Numbers
from tachometry.spec.core.ports import ports_of
from tachometry.spec.core.timing import MAX_TICK_CYCLES
from tachometry.spec.formats.low_pass import MAX_EXTRA_BITS
from tachometry.spec.formats.velocity_output import NATIVE, UNITS
from tachometry.spec.language.option import ParameterError, is_derived, options_of, settle
from tachometry.spec.language.port import UPDATE, HasPorts, Port, held
from tachometry.spec.language.units import PI, SpeedUnit, plural, rounded, signed_width

TICK_IN_TO_WINDOW_END = 2  # clocks: the synchroniser
# The ends of what encloses the true speed, and which way each is rounded: outward.
BOUNDS = {"velocity_lower": -1, "velocity_upper": 1}


@dataclass(frozen=True, kw_only=True)
class TachometerSpec(Numbers, HasPorts):
    """From encoder pins to velocity, whatever the method; its parameters are those of `Parameters`.

    A method is a subclass: it declares the members below, and all code that depends on the method reads them.

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    # Name of the method.
    method: ClassVar[str]
    # What texts call it; empty: its name in capitals.
    title: ClassVar[str] = ""
    # What it does, for --help: it stands behind the name.
    summary: ClassVar[str] = ""
    # What makes its updates.
    update_by: ClassVar[str] = "tick"
    # Whether the method ends the ticks itself, by what it counts.
    own_ticks: ClassVar[bool] = False
    # Whether the 0 that the maximum time forces is the last update before the next count.
    last_at_rest: ClassVar[bool] = False
    # Whether its windows can have bounds.
    has_bounds: ClassVar[bool] = True
    # Whether pairwise tests give all options all of their values.
    pairs_all: ClassVar[bool] = False
    # Tenths of the maximum time after which it shows that the shaft stands, counted from the last count but one.
    rest_tenths: ClassVar[int] = 17

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise ParameterError("unit", f"must be one of {', '.join(UNITS)}, not {self.unit!r}")
        self._check_ticks()
        if not is_derived(self.velocity_width) and not 8 <= self.velocity_width <= 64:
            raise ParameterError("velocity_width", f"must be from 8 to 64, not {self.velocity_width}")
        settle(self)
        self._check_velocity()
        if not 8 <= self.position_width <= 48:
            raise ParameterError("position_width", f"must be from 8 to 48, not {self.position_width}")
        if not 0 <= self.filter_clocks <= 255:
            raise ParameterError("filter_clocks", f"must be from 0 to 255, not {self.filter_clocks}")
        if self.index_reset and not self.index:
            raise ParameterError("index_reset", "must be given together with an index")
        self._check_edge_error()
        if self.lowpass is not None:
            self._check_lowpass(self.lowpass)

    def _check_edge_error(self) -> None:
        if not 0 <= self.edge_error <= 1:
            raise ParameterError("edge_error", f"must be from 0 to 1, not {float(self.edge_error):.9g}")
        if self.edge_error and not self.bounds:
            raise ParameterError("edge_error", "must be given together with bounds")
        object.__setattr__(self, "edge_error", Fraction(math.ceil(8 * self.edge_error), 8))

    def _check_lowpass(self, bandwidth: Fraction) -> None:
        least = 4 / (self.timing.tick_seconds * (1 << MAX_EXTRA_BITS))
        greatest = 2 * PI * self.timing.clock_hz  # nothing is faster than the clock
        if bandwidth <= 0 or self.low_pass.extra_bits > MAX_EXTRA_BITS or bandwidth > greatest:
            raise ParameterError(
                "lowpass",
                f"must be from {rounded(least, up=True)} to {rounded(greatest, up=False)} rad/s here, "
                f"not {float(bandwidth):.9g} rad/s",
            )

    def _check_ticks(self) -> None:
        settle(self, "max_tick_cycles")
        if self.max_tick_cycles is None:
            return
        if self.own_ticks:
            raise ParameterError(
                "method", f"must be another than {self.method} for an external tick: it makes its own ticks"
            )
        shortest = self.timing.tick_cycles
        if shortest < 2:
            raise ParameterError("tick_cycles", "must be at least 2 with an external tick, not 1")
        if not shortest <= self.max_tick_cycles <= MAX_TICK_CYCLES:
            raise ParameterError(
                "max_tick_cycles",
                f"must be from {shortest}, one tick, to {MAX_TICK_CYCLES}, not {self.max_tick_cycles}",
            )

    def _check_velocity(self) -> None:
        coarsest, finest = self.frac_bits_range(self.unit)
        if coarsest <= self.frac_bits <= finest:
            self._check_full_scale(coarsest)
            return
        if self.unit == NATIVE:
            raise ParameterError("frac_bits", f"must be from {coarsest} to {finest}, not {self.frac_bits}")
        raise ParameterError(
            "lsb",
            f"must be from 2^{-finest} to 2^{-coarsest} {self.unit} with this encoder and tick, "
            f"not 2^{-self.frac_bits}",
        )

    def _check_full_scale(self, coarsest: int) -> None:
        """Check that a velocity of so many bits shows the greatest speed."""
        if self.max_speed is None or is_derived(self.velocity_width):
            return
        counts = self.max_speed.counts(self.encoder.counts_per_rev, self.timing.tick_seconds)
        counts = min(counts, Fraction(self.max_velocity))
        fitting = self.fitting_frac_bits(counts)
        if self.frac_bits <= fitting:
            return
        needs = f"to show {self.max_speed} in {self.velocity_width} bits"
        if fitting < coarsest:
            width = signed_width(math.ceil(counts * self.per_count * Fraction(2) ** coarsest))
            raise ParameterError("velocity_width", f"must be at least {width} to show {self.max_speed} in {self.unit}")
        if self.unit == NATIVE:
            raise ParameterError("frac_bits", f"must be at most {fitting} {needs}, not {self.frac_bits}")
        raise ParameterError("lsb", f"must be at least 2^{-fitting} {self.unit} {needs}, not 2^{-self.frac_bits}")

    @property
    def description(self) -> str:
        """How it measures, in the words of its paper."""
        return self.summary

    @property
    def heading(self) -> str:
        """The name that figures give it."""
        return f"{self.title or self.method.upper()} method"

    @property
    def remark(self) -> str:
        """A remark below the plan of the method; empty: none."""
        return ""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what of the core is not as its options say."""
        if self.max_speed is None:
            return ()
        counts = self.max_speed.counts(self.encoder.counts_per_rev, self.timing.tick_seconds)
        if counts <= self.max_velocity:
            return ()
        unit, most = SpeedUnit(self.max_speed.unit), plural(self.max_velocity, "count")
        greatest = unit.of(self.max_velocity * self.unit_velocity)
        return (f"greatest speed cut from {self.max_speed} to {greatest:.6g}{unit.name}: {most} per tick is the most",)

    @property
    def min_time_cycles(self) -> int | None:
        """Clocks that every measurement lasts longer than; None: there is no such time."""
        return None

    @property
    def max_time_cycles(self) -> int:
        """Clocks after which an update is forced, with ticks as long as nominal."""
        return self.timing.max_ticks * self.timing.tick_cycles

    @property
    def memory(self) -> tuple[str, int, int] | None:
        """The memory of the reciprocal: its kind, entries, bits of an entry. None: there is no such memory."""
        return None

    @property
    def division(self) -> str:
        """How the reciprocal is found where it is divided; empty: it is not."""
        return ""

    @property
    def standstill_ticks(self) -> int:
        """Ticks from that of the last count to the update that reads 0, at most."""
        return self.timing.max_ticks

    @property
    def max_tick_shift(self) -> int:
        """Greatest k where a tick may last 2^k nominal ones."""
        return 0

    @property
    def tick_latency(self) -> int:
        """Clocks from the last one of a window to `tick`: one completes the sum, one registers it."""
        return 2

    @property
    def registers_steps(self) -> bool:
        """Whether a step is in a register before it counts for the tick: a clock of `tick_latency`."""
        return False

    @property
    def stamp_width(self) -> int:
        """Bits of the number of ticks that may fall between the cause of an update and the update; 0 without an age."""
        # An update may have to wait for the filter as long as this works.
        clocks = self.tick_to_velocity + self.low_pass_latency
        shortest = self.timing.tick_cycles if self.max_tick_cycles is None else self.min_tick_cycles
        by_tick = self.update_by != "count"
        ticks = -(-clocks // shortest) - by_tick
        return ticks.bit_length() if self.age else 0

    @property
    def stalled_after_ticks(self) -> int:
        """Nominal ticks that ticks in a row without a count must last for `stalled` to rise."""
        return self.timing.max_ticks + 1

    @property
    def recovery_clocks(self) -> int | None:
        """Clocks after which, from any state of the flip-flops, all outputs are right again; position aside.

        docs/concepts/verification.md defines when outputs are right. Counters that an upset has set beyond their ends
        continue until they wrap. None: the core has a low-pass filter, which forgets only gradually.
        """
        if self.lowpass is not None:
            return None
        # What counts the ticks of a silence may have to begin anew.
        silence = ((1 << self.timing.max_ticks.bit_length()) + 1) * self.longest_tick
        method = self.remembered_clocks + self.tick_to_velocity
        return self.front_recovery_clocks + max(method, silence) + self.tick_latency

    @property
    def front_recovery_clocks(self) -> int:
        """Clocks after which, from any state, a window begins all counts of which are right."""
        # A line that must be known anew has to hold still once more.
        held = 1 << max(self.filter_clocks - 1, 1).bit_length()
        conditioned = 2 + (held + self.filter_clocks if self.filter_clocks else 0)
        # One clock to decode. The first complete window then begins with the end of another.
        window = 1 + (
            1 << (self.longest_tick if self.longest_tick >= 16 else max(self.longest_tick - 2, 0)).bit_length()
        )
        return conditioned + 1 + window

    @property
    def remembered_clocks(self) -> int:
        """Clocks of right counts after which the method remembers nothing from before."""
        raise NotImplementedError

    @property
    def method_ports(self) -> tuple[Port, ...]:
        """Outputs that only this method has; they are new with `velocity_valid`."""
        return ()

    @property
    def method_entries(self) -> dict[str, dict[str, Any]]:
        """Entries of the manifest that say how numbers of these outputs are read, by the names of the ports."""
        return {}

    @property
    def bound_ports(self) -> tuple[Port, ...]:
        """Ports that enclose the true speed."""
        if not self.bounds:
            return ()
        width = self.bound_width if self.output is None else self.velocity_width
        return (
            *(
                held(
                    *(UPDATE, name, width),
                    signed=True,
                    unit=f"2^{-self.frac_bits} {self.unit}",
                    help=f"{side} end of what the true mean speed over the measured window was, for edges within "
                    "--edge-error (0: an ideal disc and ideal lines) while no count is lost or added; "
                    f"{sign} bounds.none of the manifest means that there is none.",
                )
                for name, side, sign in zip(BOUNDS, ("Lower", "Upper"), ("minus", "plus"), strict=True)
            ),
            held(UPDATE, "bounds_valid", help="There are bounds; not yet for the first measurement."),
        )

    @property
    def ports(self) -> tuple[Port, ...]:
        """Ports of the exported core, in order."""
        return ports_of(self, (*self.bound_ports, *self.method_ports))

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults included."""
        found: dict[str, Any] = {"method": self.method}
        for part in (self.encoder, self.timing, self):
            for about in options_of(type(part)):
                found[about.field] = about.canonical(getattr(part, about.field))
        return found
