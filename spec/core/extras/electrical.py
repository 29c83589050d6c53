"""The electrical angle of a motor, new in every clock, at the instant of its use."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from typing import Any

from tachometry.spec.core.extras.extra import Extra
from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.core.sensors import packed_levels
from tachometry.spec.formats.angles import LEAD_BITS, SHOWN_BITS, Angles
from tachometry.spec.formats.sine import ONE, STEPS
from tachometry.spec.formats.velocity_output import VelocityOutput
from tachometry.spec.language.field import Draft, Field
from tachometry.spec.language.option import REQUIRED, ParameterError, option, parse_whole
from tachometry.spec.language.port import FINE, TICK, Port, held, pin
from tachometry.spec.language.units import DEGREES, TIME, Unit, is_zero, read_quantity

REFUSED = "angle_refused"
REFUSED_BITS = 16  # of the number of refused indices, which stays at its end
_UNIT = f"2^-{SHOWN_BITS} electrical turns"
_POLE_PAIRS = """Electrical angle of a motor with P pole pairs, 1 to 512. Outputs angle, in 2^-16 electrical turns and \
new in every clock, and angle_valid. It is 0 at the index, at the rise of A of halls, where an encoder that is read \
has 0, or what angle_set sets it to."""
_OFFSET = "Electrical angle that is added, as 12.3deg. Register ANGLE_OFFSET begins with it."
_USE = """Time from the angle at the port to its use, as 1.5tick. Or 75us, or 300clk; below 65536 clocks. The angle \
is that of the motor so much later. Register ANGLE_LEAD begins with it. With track it also outputs velocity_lead and \
position_lead, of that instant."""
LEADS = ("velocity_lead", "position_lead")
_SINCOS = """Outputs angle_sin and angle_cos, from -32767 to 32767. CORDIC computes new ones every 16 clocks, for the \
instant that --lead gives."""
_TABLE = """As --sincos, by a table of sines in a block RAM. It takes a quarter of the cells of CORDIC."""


def parse_offset(what: str, text: str) -> int:
    """Return an angle in 2^-16 turns, from degrees."""
    value, _ = read_quantity(what, text, DEGREES, "deg" if is_zero(text) else "")
    if abs(value) > 360:
        raise ParameterError(what, f"must be from -360deg to 360deg, not {text!r}")
    return round(value * (1 << SHOWN_BITS) / 360) % (1 << SHOWN_BITS)


parse_offset.written = lambda turns: f"{turns * 360 / (1 << SHOWN_BITS)!r}deg"  # type: ignore[attr-defined]


def parse_lead(what: str, text: str, timing: Mapping[str, Any]) -> int:
    """Return a time in clocks, from a time, ticks or clocks."""
    units = {"tick": Unit(), **TIME, "clk": Unit()}
    value, unit = read_quantity(what, text, units, "clk" if is_zero(text) else "")
    clocks, most = {"tick": timing["tick_cycles"], "clk": 1}, (1 << LEAD_BITS) - 1
    found = round(value * (clocks[unit] if unit in clocks else TIME[unit].exact * timing["clock_hz"]))
    if not 0 <= found <= most:
        limit = f"{most}clk, {most / timing['tick_cycles']:.4g} ticks"
        raise ParameterError(what, f"must be from 0clk to {limit}, not {text!r}")
    return found


parse_lead.written = "{}clk".format  # type: ignore[attr-defined]


@dataclass(frozen=True, kw_only=True)
class ElectricalAngle(Extra):
    """Output `angle` is that of a motor with so many pole pairs, `lead` clocks after the clock in which it is shown."""

    name = "electrical"
    compared = settles = True

    pole_pairs: int = option(
        REQUIRED, _POLE_PAIRS, name=name, metavar="P", parse=parse_whole, limits=(1, 512), tests=("", "7"), tacit=True
    )
    offset: int = option(
        0, _OFFSET, name="electrical-offset", metavar="ANGLE", parse=parse_offset, tests=("", "30deg"), tacit=True
    )
    lead: int | None = option(
        None, _USE, shown="0", metavar="TIME", parse_at=parse_lead, tests=("", "1.5tick"), tacit=True
    )
    sincos: bool = option(False, _SINCOS, tests=("", "yes"), tacit=True)
    sincos_table: bool = option(False, _TABLE, tests=("", "yes"), tacit=True)

    @property
    def ahead(self) -> int:
        """The lead in clocks."""
        return self.lead or 0

    @property
    def turns(self) -> bool:
        """Whether it outputs sine and cosine."""
        return self.sincos or self.sincos_table

    @classmethod
    def respelled(cls, texts: Mapping[str, str]) -> Mapping[str, str]:
        halls = texts.get("sensor", "").strip().lower() == "hall"
        if halls or not {"lines", "ppr", "cpr"} & texts.keys():
            return texts
        if {cls.name, "pole-pairs"} <= texts.keys():
            raise ParameterError("pole_pairs", "must not be given together with --electrical, which means the same")
        return {cls.name if name == "pole-pairs" else name: text for name, text in texts.items()}

    def angles(self, spec: Numbers) -> Angles:
        """Return the formats of the angles of a core."""
        counts, tick, bits = spec.encoder.encoder_counts, spec.timing.tick_cycles, spec.velocity.native_frac_bits
        late, carrying, latency = spec.latency.pin_to_count + spec.latency.tick, spec.carrying, spec.latency
        of_track = (
            (latency.native_update, carrying.position_fine_bits, carrying.slope) if carrying else (0, 0, Fraction(0))
        )
        states = spec.encoder.kind.cycle[:: -1 if spec.encoder.reverse else 1] if spec.encoder.sensor == "hall" else ()
        halls = tuple(map(packed_levels, states))
        block, late = carrying is not None and carrying.block, late + (latency.datapath if carrying else 0)
        rest = of_track[0] - latency.datapath if carrying else 0
        speed, led = spec.velocity, None
        if carrying and self.lead is not None:
            led = speed.output or VelocityOutput(Fraction(1), speed.max << speed.native_frac_bits, speed.width)
        read = spec.encoder.sampled
        angles = Angles(
            counts, self.pole_pairs, tick, spec.tick.longest, bits, late, *of_track, halls, block, led, rest=rest
        )
        return replace(angles, place_bits=read.bits, is_read=True) if read else angles

    def least_fine_bits(self, spec: Numbers) -> int:
        return ((self.pole_pairs << SHOWN_BITS) // spec.encoder.counts_per_rev).bit_length()

    def missing(self) -> Mapping[str, str]:
        return {
            **({"axes": "does not work with both --axes and --sincos"} if self.turns else {}),
            "loop": "does not work with --loop",
        }

    def in_turn(self, slots: int) -> "AngleInTurn":
        return AngleInTurn(**{one.name: getattr(self, one.name) for one in fields(ElectricalAngle)}, slots=slots)

    def check(self, spec: Numbers) -> None:
        if spec.encoder.sensor == "hall" and self.pole_pairs != (pairs := spec.encoder.pulses_per_rev):
            raise ParameterError(self.name, f"must be {pairs}, the pole pairs of the halls, not {self.pole_pairs}")
        if spec.encoder.sampled and spec.carrying is None:
            raise ParameterError(self.name, "must be given together with --method track for an encoder that is read")
        if spec.encoder.ratio is not None:
            raise ParameterError(self.name, "does not work with --ratio: its index is not that of the motor")
        most = (spec.encoder.encoder_counts - 1) // 2
        if self.pole_pairs > most:
            raise ParameterError(self.name, f"must be at most {most} with so few counts per revolution")
        angles = self.angles(spec)
        # All products are there before the next update, and what holds the angle of a tick is free before that.
        first = angles.clocks if angles.block else angles.product
        clocks = max(angles.all_clocks + angles.rest, angles.tracks + first + 1)
        if (spec.times.shortest_tick if angles.tracks else angles.tick) < clocks:
            needs = f"needs a tick of {clocks} clocks"
            raise ParameterError(self.name, f"{needs}: take a longer --tick", needs)

    def corrects(self, spec: Numbers) -> bool:
        """Return whether an index behind the first may show lost counts."""
        return spec.index is not None and not (spec.index.reset or spec.index.once or spec.encoder.sensor == "hall")

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        text = "The angle is angle_value now, in the clock of a current vector that has aligned the motor."
        yield Pin(pin("angle_set", text), act=True)
        text = "The angle that angle_set sets, in 2^-16 electrical turns, in the clock after it."
        yield Pin(pin("angle_value", text, SHOWN_BITS), act=True)

    def ports(self, spec: Numbers) -> Iterable[Port]:
        use = f"{self.ahead} clocks (ANGLE_LEAD) after"
        text = f"Electrical angle, new in every clock, {use} this one. It also changes between ticks."
        yield held(TICK, "angle", SHOWN_BITS, unit=_UNIT, help=text)
        text = "The angle is that of the motor: by an index, by halls, by reads, or set. It also changes between ticks."
        yield held(TICK, "angle_valid", help=text)
        if self.corrects(spec):
            text = "Refused indices: the angle was off by more than 1/16 turn. It also changes between ticks, to 65535."
            yield held(TICK, REFUSED, REFUSED_BITS, unit="indices", help=text)
        if led := self.angles(spec).led:
            when = f"{use} the one in which it is new: once a tick, tick_to_lead clocks after that."
            place = next(one for one in spec.method_ports if one.name == FINE)
            unit = f"2^{-spec.velocity.frac_bits} {spec.unit}"
            yield held(TICK, LEADS[0], led.width, signed=True, unit=unit, help=f"Velocity {when}")
            yield held(TICK, LEADS[1], place.width, signed=True, unit=place.unit, help=f"Position {when}")
        for name, function in {"angle_sin": "Sine", "angle_cos": "Cosine"}.items() if self.turns else ():
            text = f"{function} of the angle. It also changes between ticks, every {STEPS} clocks."
            yield held(TICK, name, SHOWN_BITS, signed=True, unit=f"1/{ONE}", help=text)

    def registers(self, spec: Numbers) -> Iterable[Draft]:
        offset = Field("offset", SHOWN_BITS, unit=_UNIT, writable=True, reset=self.offset, port="angle_offset")
        yield "ANGLE_OFFSET", "Electrical angle that is added, from the next update on.", (offset,), {}
        lead = Field("lead", LEAD_BITS, unit="clocks", writable=True, reset=self.ahead, port="angle_lead")
        yield "ANGLE_LEAD", "Time from the angle at the port to its use, from the next update on.", (lead,), {}
        value = Field("value", SHOWN_BITS, help="The angle.", unit=_UNIT, writable=True, port="angle_value")
        text = "1: the angle is this now."
        sets = Field("set", 1, low=SHOWN_BITS, help=text, writable=True, single=True, port="angle_set")
        yield "ANGLE_SET", "Sets the angle, and makes it valid.", (value, sets), {}

    def latency(self, spec: Numbers) -> Mapping[str, int]:
        angles = self.angles(spec)
        return {"tick_to_lead": angles.tracks + angles.all_clocks + 1} if angles.led else {}

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        return "angle", f"{[0, *run.ticks.angle][-1] * 360 / 2**SHOWN_BITS:.1f}° electrical at the end"


@dataclass(frozen=True, kw_only=True)
class AngleInTurn(ElectricalAngle):
    """One of these for each axis of many: with its tick, `lead` clocks after that; every index is its zero."""

    name = "electrical_in_turn"
    compared = settles = False

    slots: int  # clocks of a round

    def angles(self, spec: Numbers) -> Angles:
        carrying, slots = spec.carrying, self.slots
        if carrying is None:
            raise ParameterError("electrical", "must be given together with --method track if there are --axes")
        tick, counts = spec.timing.tick_cycles * slots, spec.encoder.encoder_counts
        formats = (1, carrying.position_fine_bits, carrying.slope / slots**2)  # a turn ends within a tick
        bits, longest = spec.velocity.native_frac_bits, spec.tick.longest * slots
        return Angles(counts, self.pole_pairs, tick, longest, bits, tick, *formats, block=carrying.block, once=True)

    def check(self, spec: Numbers) -> None:
        self.angles(spec)

    def corrects(self, spec: Numbers) -> bool:
        return False

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        return ()

    def ports(self, spec: Numbers) -> Iterable[Port]:
        text = f"Electrical angle, {self.ahead} clocks after this one."
        yield held(TICK, "angle", SHOWN_BITS, unit=_UNIT, help=text)
        yield held(TICK, "angle_valid", help="The angle is that of the motor: there was an index.")

    def registers(self, spec: Numbers) -> Iterable[Draft]:
        return ()

    def turn_clocks(self, spec: Numbers) -> int:
        return self.angles(spec).clocks
