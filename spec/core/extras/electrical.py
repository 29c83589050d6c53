"""The electrical angle of a motor, new in every clock, at the instant of its use."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from tachometry.spec.core.extras.extra import Extra
from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.core.timing import parse_filter
from tachometry.spec.formats.angles import LEAD_BITS, SHOWN_BITS, Angles, Carried, Counted
from tachometry.spec.language.field import Draft, Field
from tachometry.spec.language.option import REQUIRED, ParameterError, option, parse_whole
from tachometry.spec.language.port import TICK, Port, held, pin

MOST_POLE_PAIRS = 512
REFUSED = "angle_refused"
REFUSED_BITS = 16  # of the number of refused indices, which stays at its end
SHOW_CLOCKS = 1  # from a phase to the angle at the port


def parse_offset(what: str, text: str) -> int:
    """Return an angle in 2^-16 turns, of `12.3deg` or a number of these; ParameterError if it is neither."""
    found = re.fullmatch(r"([+-]?\d{1,9}(?:\.\d{1,9})?)(deg)?", text.strip().lower(), re.ASCII)
    if found is None or (not found[2] and "." in found[1]):
        form = f"must be an electrical angle such as 12.3deg, or a number of 2^-{SHOWN_BITS} turns"
        raise ParameterError(what, f"{form}, not {text!r}")
    turns = float(found[1]) / 360 * 2**SHOWN_BITS if found[2] else int(found[1])
    return round(turns) % (1 << SHOWN_BITS)


def parse_lead(what: str, text: str, timing: Mapping[str, Any]) -> int:
    """Return a time in clocks, of `1.5tick`, or as of `parse_filter`."""
    if found := re.fullmatch(r"(\d{1,3}(?:\.\d{1,6})?)ticks?", text.strip().lower(), re.ASCII):
        return round(float(found[1]) * timing["tick_cycles"])
    return parse_filter(what, text, timing)


@dataclass(frozen=True, kw_only=True)
class ElectricalAngle(Extra):
    """Output `angle` is that of a motor with so many pole pairs, `lead` clocks after the clock in which it is shown.

    Between counts the place is carried on with the velocity, and with method track with the acceleration.
    """

    name = "electrical"
    missing = {"axes": "does not work with --axes"}  # noqa: RUF012

    pole_pairs: int = option(
        REQUIRED,
        "Electrical angle of a motor with P pole pairs, 1 to 512. Outputs angle, in 2^-16 electrical turns and new in "
        "every clock, and angle_valid. It is 0 at the index, or what angle_set sets it to.",
        name="electrical",
        metavar="P",
        parse=parse_whole,
        limits=(1, MOST_POLE_PAIRS),
        tests=("", "7"),
        tacit=True,
    )
    offset: int = option(
        0,
        "Angles angle that is added, as 12.3deg. Or a number of 2^-16 turns. With --bus, register ANGLE_OFFSET "
        "begins with it.",
        name="electrical-offset",
        metavar="ANGLE",
        parse=parse_offset,
        tests=("", "30deg"),
    )
    lead: int = option(
        0,
        "Time from the angle at the port to its use, as 1.5tick. Or 75us, or 300clk; below 65536 clocks. The angle is "
        "that of the motor so much later. With --bus, register ANGLE_LEAD begins with it.",
        metavar="TIME",
        parse_at=parse_lead,
        tests=("", "1.5tick"),
    )

    def angles(self, spec: Numbers) -> Angles:
        """Return how angles are counted."""
        return Angles(spec.encoder.counts_per_rev, self.pole_pairs, spec.timing.tick_cycles, spec.tick.longest)

    def phases(self, spec: Numbers) -> Carried | Counted:
        """Return how places become angles of every clock: of method track, or of counts and velocities."""
        bits, late = spec.velocity.native_frac_bits, spec.latency.pin_to_count + spec.latency.tick
        if spec.tracked is None:
            return Counted(self.angles(spec), bits, late + SHOW_CLOCKS + 1, block=False)
        return Carried(self.angles(spec), spec.tracked, bits, late + spec.latency.datapath, SHOW_CLOCKS)

    def check(self, spec: Numbers) -> None:
        if spec.encoder.sensor == "hall":
            raise ParameterError("electrical", "does not work with --sensor hall: take --position-modulo rev/P")
        if spec.encoder.counts_per_rev <= 2 * self.pole_pairs:
            most = (spec.encoder.counts_per_rev - 1) // 2
            raise ParameterError("electrical", f"must be at most {most} with so few counts per revolution")
        if not 0 <= self.lead < 1 << LEAD_BITS:
            raise ParameterError("lead", f"must be from 0 to {(1 << LEAD_BITS) - 1} clocks, not {self.lead}")
        phases = self.phases(spec)
        if isinstance(phases, Carried) and spec.times.update_spacing < phases.clocks:
            raise ParameterError("electrical", f"needs a tick of {phases.clocks} clocks: take a longer --tick")

    def corrects(self, spec: Numbers) -> bool:
        """Return whether an index behind the first may show lost counts."""
        return spec.index is not None and not spec.index.reset and not spec.index.once

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        text = "The angle is angle_value now, in the clock of a current vector that has aligned the motor."
        yield Pin(pin("angle_set", text), act=True)
        yield Pin(
            pin(
                "angle_value",
                "The angle that angle_set sets, in 2^-16 electrical turns, in the clock after it.",
                SHOWN_BITS,
            ),
            act=True,
        )

    def ports(self, spec: Numbers) -> Iterable[Port]:
        unit = f"2^-{SHOWN_BITS} electrical turns"
        text = "Angles angle, ANGLE_LEAD clocks after this one. It is new in every clock."
        yield held(TICK, "angle", SHOWN_BITS, unit=unit, help=text)
        text = "The angle is that of the motor: an index was taken, or the angle was set, since reset and home."
        yield held(TICK, "angle_valid", help=text)
        if self.corrects(spec):
            text = "Indices that were refused: the angle was off by more than 1/16 turn. It stays at 65535."
            yield held(TICK, REFUSED, REFUSED_BITS, unit="indices", help=text)

    def registers(self, spec: Numbers) -> Iterable[Draft]:
        unit = f"2^-{SHOWN_BITS} electrical turns"
        text = "Angle that is added, from the next update on."
        offset = Field("offset", SHOWN_BITS, unit=unit, writable=True, reset=self.offset, port="angle_offset")
        yield "ANGLE_OFFSET", text, (offset,), {}
        lead = Field("lead", LEAD_BITS, unit="clocks", writable=True, reset=self.lead, port="angle_lead")
        yield "ANGLE_LEAD", "Time from the angle at the port to its use, from the next update on.", (lead,), {}
        value = Field("value", SHOWN_BITS, help="The angle.", unit=unit, writable=True, port="angle_value")
        sets = Field(
            "set", 1, low=SHOWN_BITS, help="1: the angle is this now.", writable=True, single=True, port="angle_set"
        )
        yield "ANGLE_SET", "Sets the angle, and makes it valid.", (value, sets), {}

    def entry(self, spec: Numbers) -> dict[str, Any]:
        return {"pole_pairs": self.pole_pairs, "degrees_per_lsb": 360 / 2**SHOWN_BITS}

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        last = run.ticks.angle[-1] * 360 / 2**SHOWN_BITS if len(run.ticks.angle) else 0
        valid = (
            "" if len(run.ticks.angle) and run.ticks.angle_valid[-1] else ", not valid: it needs an index or angle_set"
        )
        return "angle", f"{last:.1f}° electrical at the end{valid}"
