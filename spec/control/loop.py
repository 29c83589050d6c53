"""The control loop of a core: its options, formats and times."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

from tachometry.spec.control.coefficients import control_form, ratios_of
from tachometry.spec.control.form import ControlForm, Term, factor_bits
from tachometry.spec.control.generator import GeneratorForm, generator_clocks, generator_form
from tachometry.spec.control.law import Law
from tachometry.spec.control.units import Units
from tachometry.spec.core.extras.extra import refuse
from tachometry.spec.core.front_end import OF_CONTROLS
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.option import ParameterError, check_options, option
from tachometry.spec.language.units import PI, plural, rounded

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


@dataclass(frozen=True)
class LoopLatency:
    """Clocks of the ticks of a control loop, and of its computation."""

    tachometer: TachometerSpec
    multiplier: str
    generated: bool  # whether commands come from a generator
    filtered: bool
    factor_bits: int  # of a coefficient

    @property
    def first_tick(self) -> int:
        """The clock of the first control tick, from 0: one clock after the update of the first tick has come.

        So a period of whole ticks meets each update when it is new.
        """
        latency = self.tachometer.latency
        return self.tachometer.timing.tick_cycles - 1 + latency.tick + latency.tick_to_velocity + 1

    @property
    def product(self) -> int:
        """Clocks from one product to the next."""
        return _STEPS + (self.factor_bits if self.multiplier == "serial" else _PARALLEL)

    @property
    def tick_to_result(self) -> int:
        """Clocks from `control_tick` to `current_valid`."""
        products = len(Term) - (not self.filtered)
        return products * self.product + (not self.filtered) * _UNFILTERED + _LIMIT

    @property
    def least_period(self) -> int:
        """Fewest clocks between two control ticks: the current is added to those before it."""
        return max(self.tick_to_result + 1, generator_clocks(self.multiplier) if self.generated else 0)


_MULTIPLIER = """Way in which products of the loop are computed. serial takes a clock for each bit, parallel \
multipliers of the FPGA."""
_COMMAND = """Source of commands: inputs or a generator. The generator in the core makes constant speeds, ramps and \
sines."""
_GAINS = "Let gains and current limit be fixed, or inputs. A bus makes inputs registers that begin with the options."


@dataclass(frozen=True, kw_only=True)
class Loop(Law):
    """Options and numbers of a disturbance observer and a controller of position and velocity; see `ControlForm`.

    It raises ParameterError if a parameter is out of range, the program is longer than the period, or a format is too
    wide.
    """

    current_width: int = option(16, "Bits of current, 8 to 24.", metavar="N", limits=(8, 24))
    multiplier: str = option("serial", _MULTIPLIER, name="loop-multiplier", choices=MULTIPLIERS)
    command: str = option("ports", _COMMAND, choices=COMMANDS)
    gains: str = option("fixed", _GAINS, choices=FIXED_OR_INPUTS)

    def __post_init__(self) -> None:
        super().__post_init__()
        encoder = self.tachometer.encoder
        if not encoder.plain:
            named = "reverse" if encoder.reverse else "invert" if encoder.invert else "sensor"
            raise ParameterError(named, "must not be given together with --loop, which takes A and B as they come")
        for name in self.tachometer.front_end.controls:
            raise ParameterError(OF_CONTROLS[name], "must not be given together with --loop, whose position would jump")
        refuse(self.tachometer.extras, "loop")
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
        return replace(self.latency, factor_bits=factor_bits(list(ratios.values()))).least_period

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
            rest = f"must fit the other gains: coefficients would have {bits} bits, and {MAX_FACTOR_BITS} are the most"
            raise ParameterError("kv" if not self.position_gain else "kp", rest)
        width = max(self.form.word_width, self.form.total_width)
        if width > MAX_WORD_WIDTH:
            raise ParameterError(
                "velocity_width",
                f"must be less with --loop here: words would have {width} bits, and {MAX_WORD_WIDTH} are the most; a "
                "max_speed, a lower observer or lower gains help, too",
            )

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
    def latency(self) -> LoopLatency:
        """Clocks of the ticks of the loop, and of its computation."""
        generated = self.command == "generator"
        return LoopLatency(self.tachometer, self.multiplier, generated, self.filter is not None, self.form.factor_bits)
