"""Ports of the exported core of one axis."""

from collections.abc import Iterable, Iterator
from math import ceil

from tachometry.spec.core.core import Core
from tachometry.spec.language.port import INDEX, MISSED, TICK, UPDATE, WIDE, Port, held, pin, strobe

# The ends of what encloses the true speed, and which way each is rounded: outward.
BOUNDS = {"velocity_lower": -1, "velocity_upper": 1}


_RESTS = {
    UPDATE: "The shaft stands still: at the end of this period the last count, or the reset, was the maximum time ago. "
    "The velocity is 0.",
    TICK: "The shaft rests: pulse_count was 0 in this period and in those before it for longer than the maximum time, "
    "that is for standstill_after_ticks of the manifest; the time before the first period is one of them. It falls "
    "with the next count.",
}


def ports_of(spec: Core, own: Iterable[Port]) -> Iterator[Port]:
    """Yield all ports of a core, in the order of the exported module; those of options and methods come last."""
    yield from _inputs(spec)
    unit = f"2^{-spec.velocity.frac_bits} {spec.unit}"
    text = "Measured velocity; multiplied by rad_per_s_per_lsb of the manifest it is in rad/s."
    yield held(UPDATE, "velocity", spec.velocity.width, signed=True, unit=unit, help=text)
    yield strobe(UPDATE, "One clock for every update of the velocity.")
    text = f"Length of the measurement: {spec.facts.interval}."
    yield held(UPDATE, "interval", spec.widths.interval, unit=f"{spec.times.interval_unit} clocks", help=text)
    yield held(UPDATE, "forced", help=spec.facts.forced)
    yield strobe(TICK, "One clock for every sampling period.")
    text = "m_e, the counts of this period."
    yield held(TICK, "pulse_count", spec.widths.count, signed=True, unit="counts", help=text)
    text = "Sum of all counts up to this period; it wraps in two's complement. It also changes between ticks."
    yield held(TICK, "position", spec.position_width, signed=True, unit="counts", help=text)
    wrong = _wrong(spec)
    yield strobe("decode_error", f"One clock: {wrong}" if wrong else "Never high: one line cannot be wrong.")
    text = "pulse_count was saturated at the maximum speed; position is exact all the same."
    yield held(TICK, "overflow", help=text)
    yield held(spec.facts.rests_with, "standstill", help=_RESTS[spec.facts.rests_with])
    if spec.encoder.sampled:
        text = "position is that of a good read; it falls when none has come for the maximum time."
        yield held(TICK, "position_valid", help=text)
    if spec.reads is not None:
        yield from spec.reads.ports[1:]
    if spec.velocity.output:
        yield held(UPDATE, "velocity_overflow", help="This velocity was saturated to the width of the port.")
    if spec.age:
        text = "Ticks after the count or the tick that caused the update, the one of this clock included: 1 with the "
        text += "first tick after the cause. It stays at the maximum time, and begins anew with an update, also "
        text += "between the ticks."
        yield held(TICK, "age", spec.timing.max_ticks.bit_length(), unit="ticks", help=text)
    yield from own
    yield from _more_ports(spec)


def _more_ports(spec: Core) -> Iterator[Port]:
    """Yield ports of options."""
    yield from _index_ports(spec)
    if modulus := spec.modulus:
        text = f"Counts up to this period modulo {modulus}, from 0 on, since reset or since an index that resets. "
        text += "It also changes between ticks. A preset does not change it."
        text = f"The position modulo {modulus}, from 0 on." if spec.encoder.sampled else text
        text += f" tick waits {spec.latency.tick - spec.latency.place} clocks for it." if spec.remainder else ""
        yield held(TICK, "position_modulo", (ceil(modulus) - 1).bit_length(), unit="counts", help=text)
    if spec.external_tick:
        text = "One clock. Together with tick: the external tick was missing, and the core made one. Alone: an "
        text += "external tick came too early and was left out."
        yield strobe("tick_error", text)
    yield from _of_extras(spec, -1)
    yield from _of_extras(spec, 0)
    if spec.filter_clocks:
        text = "Edges that the glitch filter has kept out, two for each glitch; it stays at 65534. "
        text += "It also changes between ticks; a capture shows the present value."
        yield held(TICK, "filtered_edges", 16, unit="edges", help=text)
    yield from _of_extras(spec, 1)


def _of_extras(spec: Core, place: int) -> Iterator[Port]:
    for extra in spec.extras:
        yield from extra.ports(spec) if extra.place == place else ()


def _inputs(spec: Core) -> Iterator[Port]:
    front = spec.front_end
    yield pin("clk", "Clock; all outputs change at its rising edge.")
    yield pin("rst", "Synchronous reset, active high.")
    for line, help in zip(spec.encoder.kind.lines, spec.encoder.kind.pins, strict=True):
        yield pin(line, help)
    if spec.reads is not None:
        yield spec.reads.ports[0]
    elif spec.encoder.sampled:
        yield from spec.encoder.sampled.ports(spec.tick.longest)
    if "z" in front.lines:
        yield pin("z", "Index line, asynchronous; the index captures the position.")
    yield from (pin.port for pin in front.pins if pin.of)
    if spec.external_tick:
        yield pin("tick_in", "External tick, asynchronous; its rising edge ends a sampling period.")
    if spec.preset is not None:
        text = f"Preset, asynchronous; its rising edge sets the position to {spec.preset}, or to register PRESET."
        yield pin("preset", text)
    if front.index_once:
        yield pin("home", "Homing, asynchronous; its rising edge lets the next index be taken.")
    for extra in sorted(spec.extras, key=lambda extra: extra.place):
        yield from (pin.port for pin in extra.pins(spec) if not pin.of)


# By the number of gaps, at most 2: after what the index comes, and what is found.
_OF_WHEELS = (("the extra one", "extra tooth"), ("a gap", "gap of the wheel"), ("the longest row of teeth", "gaps"))


def _index_ports(spec: Core) -> Iterator[Port]:
    wheel, place = spec.front_end.wheel, "the index"
    if wheel is not None:
        after, what = _OF_WHEELS[min(len(wheel.gaps), 2)]
        place = f"the first tooth after {after}"
        yield held(TICK, "synced", help=f"The {what} was found, and the latest one was where it had to be.")
    if not spec.index:
        return
    text = "index: z rises in the state of --index-at, or rises at all with edge."
    yield strobe(INDEX, f"One clock for every {text if wheel is None else place.removeprefix('the ') + '.'}")
    if spec.front_end.index_state is not None:
        text = "One clock: z stayed high from the state of --index-at to the same state a period further, so the index "
        yield strobe(WIDE, text + "is at two places.")
        text = "One clock, with the first count after z has fallen: z came and went in one direction of counts without "
        yield strobe(MISSED, text + "the state of --index-at, so the index was not taken.")
    text = f"Position at {place}, before any reset of the position."
    yield held(INDEX, "index_position", spec.position_width, signed=True, unit="counts", help=text)
    if spec.front_end.index_once:
        yield held(TICK, "homed", help="The index was taken, since home rose. It does not wait for a tick.")


def _wrong(spec: Core) -> str:
    if spec.encoder.teeth:
        return "the gap was not where it had to be, as of a tooth lost or extra; the next gap is taken."
    return spec.encoder.kind.wrong


def bound_ports(spec: Core) -> Iterator[Port]:
    """Yield ports that enclose the true speed."""
    if not spec.bounds:
        return
    width = spec.velocity.bound_width if spec.velocity.output is None else spec.velocity.width
    for name, side, sign in zip(BOUNDS, ("Lower", "Upper"), ("minus", "plus"), strict=True):
        text = f"{side} end of what the true mean speed over the measured window was, for edges within --edge-error "
        text += f"(0: an ideal disc and ideal lines) while no count is lost or added; {sign} bounds.none of the "
        text += "manifest means that there is none."
        unit = f"2^{-spec.velocity.frac_bits} {spec.unit}"
        yield held(UPDATE, name, width, signed=True, unit=unit, help=text)
    text = "There are bounds; not yet for the first measurement"
    text += "" if spec.displacement is None else ", nor while the map of the disc is not used"
    yield held(UPDATE, "bounds_valid", help=f"{text}.")
