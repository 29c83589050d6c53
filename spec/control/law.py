"""The law of a control loop is declared once, for cores that have it in gates and for loops that are simulated."""

from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.control.motor import Motor
from tachometry.spec.core.tachometer import TachometerSpec, WithTachometer
from tachometry.spec.core.timing import parse_clocks
from tachometry.spec.language.option import ParameterError, option, options_of
from tachometry.spec.language.units import CURRENT, PLAIN, Quantity, parse_bandwidth

MAX_PERIOD = 1 << 24
# Least and greatest: beyond them no drive is, so they are slips of the pen.
_SIZES = {
    "kp": ("1e-12", "1e12"),
    "kv": ("1e-9", "1e9"),
    "observer": ("1e-6", "1e9"),
    "inertia": ("1e-12", "1e6"),
    "torque_constant": ("1e-9", "1e6"),
    "current_limit": ("1e-9", "1e9"),
}


class _Filter:
    """Reads and writes the bandwidth of the velocity filter, 0 for none."""

    def __call__(self, what: str, text: str) -> Fraction:
        if text.strip().lower() == "none":
            return Fraction(0)
        if (value := parse_bandwidth(what, text)) <= 0:
            raise ParameterError(what, f"must be greater than 0, not {float(value):.9g}")
        return value

    def written(self, value: Fraction) -> str:
        return parse_bandwidth.written(value) if value else "none"


_POSITION_GAIN = "Gain k_p of the position error, in 1/s²; 0: none. With 0 the velocity alone is controlled."
_OBSERVER = "Bandwidth of the disturbance observer G_dis. In rad/s, Hz or kHz."
_CURRENT_LIMIT = "Greatest commanded current, in A or mA. The observer gets the current that is held within it."
_CONTROL_PERIOD = "Time between two control ticks, such as 20us or 960clk. It is a whole number of clocks."
_SYNCHRONISED = """Let filter and observer work at velocity updates. That is Fig. 11; otherwise they work at every \
control tick (Fig. 2)."""


@dataclass(frozen=True, kw_only=True)
class Law(WithTachometer, Motor):
    """Says how position and velocity are controlled, and how disturbances are observed.

    A value out of range raises ParameterError.
    """

    tachometer: TachometerSpec  # of any method
    position_gain: Fraction = option(  # noqa: RUF009
        None, _POSITION_GAIN, text="100", name="kp", metavar="KP", parse=Quantity(PLAIN)
    )
    velocity_gain: Fraction = option(  # noqa: RUF009
        None, "Gain k_v of the velocity error, in 1/s.", text="30", name="kv", metavar="KV", parse=Quantity(PLAIN)
    )
    observer: Fraction = option(  # noqa: RUF009
        None, _OBSERVER, text="40rad/s", metavar="BANDWIDTH", unit="rad/s", parse=parse_bandwidth
    )
    velocity_filter: Fraction | None = option(  # noqa: RUF009
        None,
        "Bandwidth G_v of the velocity filter, or none.",
        shown="that of --observer; none with method track",
        metavar="[BANDWIDTH|none]",
        unit="rad/s",
        parse=_Filter(),
    )
    current_limit: Fraction = option(  # noqa: RUF009
        None, _CURRENT_LIMIT, text="20A", metavar="CURRENT", parse=Quantity(CURRENT)
    )
    control_period: int | None = option(
        None, _CONTROL_PERIOD, shown="one tick", metavar="TIME", unit="clocks", parse_at=parse_clocks
    )
    synchronised: bool = option(True, _SYNCHRONISED)

    def __post_init__(self) -> None:
        for about in options_of(Law):
            if about.parameter in _SIZES:
                self._check_size(about.parameter, getattr(self, about.field))
        if self.velocity_filter is not None and self.velocity_filter < 0:
            raise ParameterError("velocity_filter", f"must be at least 0, not {float(self.velocity_filter):.9g}")
        if not 1 <= self.period <= MAX_PERIOD:
            raise ParameterError("control_period", f"must be from 1 to {MAX_PERIOD} clocks, not {self.period}")

    def _check_size(self, parameter: str, value: Fraction) -> None:
        if parameter == "kp" and value <= 0:
            if value < 0:
                raise ParameterError(parameter, f"must be at least 0, not {float(value):.9g}")
            return
        if value <= 0:
            raise ParameterError(parameter, f"must be greater than 0, not {float(value):.9g}")
        least, most = _SIZES[parameter]
        if not Fraction(least) <= value <= Fraction(most):
            raise ParameterError(parameter, f"must be of a size from {least} to {most}, not {float(value):g}")

    @property
    def filter(self) -> Fraction | None:
        """G_v in rad/s; None: there is no filter."""
        asked = self.velocity_filter
        if asked is None:
            asked = Fraction(0) if self.tachometer.method == "track" else self.observer
        return asked or None

    @property
    def period(self) -> int:
        """Clocks between two control ticks."""
        return self.timing.tick_cycles if self.control_period is None else self.control_period
