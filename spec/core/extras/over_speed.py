"""Over-speed: an output trips when the velocity exceeds a limit, and stays high until it is cleared."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from tachometry.spec.core.extras.extra import Event, Extra
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.language.option import REQUIRED, ParameterError, option
from tachometry.spec.language.port import TICK, Port, held
from tachometry.spec.language.units import Speed, SpeedUnit, format_time, parse_speed

_LIMIT = """Latch output over_speed when the speed exceeds SPEED. In rad/s, rev/s or rpm. A reset or CONTROL.clear \
clears it."""


@dataclass(frozen=True, kw_only=True)
class OverSpeed(Extra):
    """Output `over_speed` rises when |velocity| exceeds a limit, and stays high until a reset or CONTROL.clear."""

    name = "over_speed"

    limit: Speed = option(  # noqa: RUF009
        REQUIRED, _LIMIT, name="over-speed", metavar="SPEED", parse=parse_speed, tests=("", "30rad/s"), tacit=True
    )

    def greatest(self, spec: Numbers) -> int:
        """Return the greatest |velocity|, in its LSB, that does not trip."""
        counts = self.limit.counts(spec.encoder.counts_per_rev, spec.timing.tick_seconds)
        return math.floor(counts * spec.scale.per_count * 2**spec.velocity.frac_bits)

    def missing(self) -> Mapping[str, str]:
        return {"axes": "must be left out with --axes: it trips for one axis"}

    def check(self, spec: Numbers) -> None:
        if self.greatest(spec) < spec.velocity.full_scale:
            return
        unit = SpeedUnit(self.limit.unit)
        most = f"{unit.of(spec.velocity.full_scale * spec.velocity.rad_per_s_per_lsb):.6g} {unit.name}"
        raise ParameterError("over_speed", f"must be less than {most}, the greatest velocity, not {self.limit}")

    def ports(self, spec: Numbers) -> Iterable[Port]:
        yield held(TICK, "over_speed", help=f"A velocity was beyond {self.limit}, since it was cleared.")

    def events(self, spec: Numbers) -> Mapping[str, Event]:
        return {"over_speed": Event(f"A velocity was beyond {self.limit}.", wires=("beyond",))}

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        high = run.ticks.over_speed
        if not high.any():
            return "over speed", f"never beyond {self.limit}"
        return "over speed", f"tripped within {format_time(spec.tick.seconds(int(run.ticks.clock[high.argmax()])))}"
