"""A tachometer and the control loop of its shaft as one core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

from tachometry.spec.control.coefficients import control_form, ratios_of
from tachometry.spec.control.form import ControlForm, Term, factor_bits
from tachometry.spec.control.generator import GeneratorForm, generator_clocks, generator_form
from tachometry.spec.control.law import Law
from tachometry.spec.control.ports import loop_ports
from tachometry.spec.control.units import Units
from tachometry.spec.core.described import written
from tachometry.spec.core.follows import Follows
from tachometry.spec.core.front_end import OF_CONTROLS
from tachometry.spec.core.scale import Scale
from tachometry.spec.language.option import ParameterError, check_options, option, options_of
from tachometry.spec.language.port import Port, Ports
from tachometry.spec.language.units import PI, plural, rounded
from tachometry.spec.methods.axes import CoreSpec

MAX_EXTRA_BITS = 24
MAX_FACTOR_BITS = 40
MAX_WORD_WIDTH = 80
MULTIPLIERS = ("serial", "parallel")
COMMANDS = ("ports", "generator")
FIXED_OR_INPUTS = ("fixed", "inputs")
# Clocks of a product: to load the word, to subtract from it, to begin, to store the result; and between them one for
# each bit of the coefficient, or one for the product and one to round it.
_STEPS = 4
_PARALLEL = 2
_UNFILTERED = 3  # to load the velocity, to subtract, to store
_LIMIT = 2  # to hold the sum within few bits, and within the limit


class LoopLatency(Follows["LoopSpec"]):
    """Counts the clocks of the ticks of a control loop, and of its computation."""

    @property
    def first_tick(self) -> int:
        """The clock of the first control tick, from 0: one clock after the update of the first tick has come.

        So a period of whole ticks meets each update when it is new.
        """
        spec = self.spec.tachometer
        return spec.timing.tick_cycles - 1 + spec.latency.tick + spec.latency.tick_to_velocity + 1

    @property
    def product(self) -> int:
        """Clocks from one product to the next."""
        return self._product(self.spec.form.factor_bits)

    def _product(self, factor_bits: int) -> int:
        return _STEPS + (factor_bits if self.spec.multiplier == "serial" else _PARALLEL)

    @property
    def tick_to_result(self) -> int:
        """Clocks from `control_tick` to `current_valid`."""
        return self._tick_to_result(self.spec.form.factor_bits)

    def _tick_to_result(self, factor_bits: int) -> int:
        unfiltered = self.spec.filter is None
        return (len(Term) - unfiltered) * self._product(factor_bits) + unfiltered * _UNFILTERED + _LIMIT

    @property
    def least_period(self) -> int:
        """Fewest clocks between two control ticks: the current is added to those before it."""
        return self.least_period_of(self.spec.form.factor_bits)

    def least_period_of(self, factor_bits: int) -> int:
        """Return the fewest clocks between two control ticks, for coefficients of so many bits."""
        generated = generator_clocks(self.spec.multiplier) if self.spec.command == "generator" else 0
        return max(self._tick_to_result(factor_bits) + 1, generated)


@dataclass(frozen=True, kw_only=True)
class LoopSpec(Law):
    """Describes a tachometer with disturbance observer and controller of position and velocity; see `ControlForm`.

    It raises ParameterError if a parameter is out of range, the program is longer than the period, or a format is too
    wide.
    """

    current_width: int = option(16, "Bits of current, 8 to 24.", metavar="N", limits=(8, 24))
    multiplier: str = option(
        "serial",
        "How products are formed: a bit a clock, or at once with multipliers of the FPGA.",
        name="loop-multiplier",
        choices=MULTIPLIERS,
    )
    command: str = option(
        "ports",
        "Where commands come from: from outside, or from a generator in the core of constant speeds, ramps and sines.",
        choices=COMMANDS,
    )
    gains: str = option(
        "fixed",
        "Whether gains and current limit are fixed, or inputs; a bus makes them registers that begin with the options.",
        choices=FIXED_OR_INPUTS,
    )

    # Outputs are of one axis.
    axes: ClassVar[None] = None
    latency = cached_property(LoopLatency)

    def __post_init__(self) -> None:
        super().__post_init__()
        encoder = self.tachometer.encoder
        if not encoder.plain:
            named = "reverse" if encoder.reverse else "invert" if encoder.invert else "sensor"
            raise ParameterError(named, "must not be given together with --loop, which takes A and B as they come")
        for name in self.tachometer.front_end.controls:
            raise ParameterError(OF_CONTROLS[name], "must not be given together with --loop, whose position would jump")
        if self.tachometer.compare is not None and self.tachometer.compare.depth:
            raise ParameterError("compare", "must not be a list together with --loop, whose inputs are commands")
        check_options(self)
        self._check_formats()
        if self.period < self.latency.least_period:
            periods = [self.period]
            while (needed := self._least_in(periods[-1])) not in periods:
                periods.append(needed)
            least = min(period for period in periods if self._least_in(period) <= period)
            raise ParameterError(
                "control_period",
                f"must be at least {plural(least, 'clock')}, as long as the controller computes with a "
                f"{self.multiplier} multiplier, not {self.period}",
            )

    def _least_in(self, period: int) -> int:
        """Return `latency.least_period` with another period: words are of other widths in it."""
        ratios = ratios_of(replace(self.units, period=period))
        return self.latency.least_period_of(factor_bits(list(ratios.values())))

    def _check_formats(self) -> None:
        for rate, name in ((self.observer, "observer"), (self.filter, "velocity_filter")):
            least = 4 / ((1 << MAX_EXTRA_BITS) * self.units.seconds)
            most = 2 * PI * self.timing.clock_hz
            if rate is not None and not least <= rate <= most:
                raise ParameterError(
                    name,
                    f"must be from {rounded(least, up=True)} to {rounded(most, up=False)} rad/s here, "
                    f"not {float(rate):.9g}",
                )
        bits = factor_bits(list(self.ratios.values()))
        if bits > MAX_FACTOR_BITS:
            raise ParameterError(
                "kv" if not self.position_gain else "kp",
                f"must fit the other gains: coefficients would have {bits} bits, and {MAX_FACTOR_BITS} are the most",
            )
        width = max(self.form.word_width, self.form.total_width)
        if width > MAX_WORD_WIDTH:
            raise ParameterError(
                "velocity_width",
                f"must be less with --loop here: words would have {width} bits, and {MAX_WORD_WIDTH} are the most; a "
                "max_speed, a lower observer or lower gains help, too",
            )

    @property
    def method(self) -> str:
        """Name of the tachometer's method."""
        return self.tachometer.method

    @property
    def scale(self) -> Scale[Any]:
        """Unit and LSB of the velocity."""
        return self.tachometer.scale

    @cached_property
    def units(self) -> Units:
        """Units of its numbers."""
        return Units(self, self.current_width, self.period)

    @cached_property
    def ratios(self) -> dict[Term, Sequence[Fraction]]:
        """The factor of each term, in units of its result for one of its word."""
        return ratios_of(self.units)

    @cached_property
    def form(self) -> ControlForm:
        """Formats and coefficients."""
        return control_form(self.units, self.ratios, inputs=self.gains == "inputs")

    @cached_property
    def generator(self) -> GeneratorForm:
        """Formats of the command generator."""
        return generator_form(self.units, self.form.command_width)

    @cached_property
    def ports(self) -> Ports:
        """Ports of the exported core, in order: those of the tachometer first."""
        return Ports((*self.tachometer.ports, *loop_ports(self)))

    @property
    def held_inputs(self) -> tuple[Port, ...]:
        """Inputs that are taken in the clock before a control tick: commands, gains and limit, if gains are inputs."""
        if self.gains == "fixed":
            return ()
        return tuple(
            port for port in loop_ports(self) if port.direction == "input" and port.name not in ("enable", "freeze")
        )

    @property
    def options(self) -> dict[str, str]:
        """Texts of all options that are asked for, by their names."""
        return {**self.tachometer.options, "loop": "yes", **written(self, self.tachometer)}

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults included."""
        follows = {"velocity_filter": self.filter, "control_period": self.period}
        own = {
            about.parameter: about.canonical(follows.get(about.field, getattr(self, about.field)))
            for about in options_of(LoopSpec)
        }
        return {**self.tachometer.parameters, "loop": own}


# A core of any kind: all have ports, options, parameters, `axes`, `latency.tick_to_result`, and a `tachometer`,
# the core of one axis that they are, or that is in them.
AnySpec = CoreSpec | LoopSpec
