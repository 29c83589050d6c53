"""Ports of the exported core of one axis."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from tachometry.spec.core.compare import COUNT_WIDTH
from tachometry.spec.core.health import FAULT_TEXTS, FAULT_WIDTH, FAULTS_WIDTH, OPEN, Fault
from tachometry.spec.core.stream import READY, stream_ports
from tachometry.spec.language.port import COMPARE, FINE, INDEX, MISSED, TICK, UPDATE, WIDE, Port, held, pin, strobe

if TYPE_CHECKING:
    from tachometry.spec.core.tachometer import TachometerSpec

# The ends of what encloses the true speed, and which way each is rounded: outward.
BOUNDS = {"velocity_lower": -1, "velocity_upper": 1}


def ports_of(spec: TachometerSpec, own: Iterable[Port]) -> tuple[Port, ...]:
    """Return all ports of a core, in the order of the exported module; those of options and methods come last."""
    front = spec.front_end
    place = "the first tooth after a gap" if spec.encoder.missing else "the index"
    return (
        pin("clk", "Clock; all outputs change at its rising edge."),
        pin("rst", "Synchronous reset, active high."),
        *(pin(line, help) for line, help in zip(spec.encoder.kind.lines, spec.encoder.kind.pins, strict=True)),
        *_if("z" in front.lines, pin("z", "Index line, asynchronous; the index captures the position.")),
        *(pin(f"{line}_n", f"Complement of line {line.upper()}, asynchronous.") for line in front.complemented),
        *_if(
            spec.external_tick,
            pin("tick_in", "External tick, asynchronous; its rising edge ends a sampling period."),
        ),
        *_if(
            spec.preset is not None,
            pin(
                "preset",
                f"Preset, asynchronous; its rising edge sets the position to {spec.preset}, or to register PRESET.",
            ),
        ),
        *_if(front.index_once, pin("home", "Homing, asynchronous; its rising edge lets the next index be taken.")),
        *_probe_pins(spec),
        *_list_pins(spec),
        *_if(spec.stream, pin(READY, "The record is taken in this clock; synchronous to clk.")),
        held(
            *(UPDATE, "velocity", spec.widths.velocity),
            signed=True,
            unit=f"2^{-spec.widths.frac_bits} {spec.unit}",
            help="Measured velocity; multiplied by rad_per_s_per_lsb of the manifest it is in rad/s.",
        ),
        strobe(UPDATE, "One clock for every update of the velocity."),
        held(
            *(UPDATE, "interval", spec.widths.interval),
            unit=f"{spec.times.interval_unit} clocks",
            help="Length of the measurement: m_s in ticks (s), the number of averaged ticks (m), timer periods (t, "
            "mt), Ndt1 in sampling periods dt (rairan), or ticks since the last one with counts (track).",
        ),
        held(
            UPDATE,
            "forced",
            help="No count or alteration caused this update: the maximum time passed, the velocity decayed, or the "
            "tick held no count (track).",
        ),
        strobe(TICK, "One clock for every sampling period."),
        held(
            TICK, "pulse_count", spec.widths.count, signed=True, unit="counts", help="m_e, the counts of this period."
        ),
        held(
            *(TICK, "position", spec.position_width),
            signed=True,
            unit="counts",
            help="Sum of all counts up to this period; it wraps in two's complement. Between the ticks it counts on.",
        ),
        strobe(
            "decode_error",
            f"One clock: {wrong}" if (wrong := _wrong(spec)) else "Never high: one line cannot be wrong.",
        ),
        held(TICK, "overflow", help="pulse_count was saturated at the maximum speed; position is exact all the same."),
        held(
            TICK,
            "stalled",
            help="The shaft rests: pulse_count was 0 in this period and in those before it for longer than the maximum "
            "time, that is for stalled_after_ticks of the manifest; the time before the first period is one of them. "
            "It falls with the next count.",
        ),
        *_if(
            spec.scale.output,
            held(UPDATE, "velocity_overflow", help="This velocity was saturated to the width of the port."),
        ),
        *_if(
            spec.age,
            held(
                *(TICK, "age", spec.timing.max_ticks.bit_length()),
                unit="ticks",
                help="Ticks after the count or the tick that caused the update, the one of this clock included: 1 with "
                "the first tick after the cause. It stays at the maximum time, and begins anew with an update, also "
                "between the ticks.",
            ),
        ),
        *own,
        *_if(
            spec.encoder.missing,
            held(TICK, "synced", help="The gap of the wheel was found, and the latest one was where it had to be."),
        ),
        *_if(
            spec.index,
            strobe(
                INDEX,
                "One clock for every first tooth after a gap."
                if spec.encoder.missing
                else "One clock for every index: z rises in the state of --index-at, or rises at all with edge.",
            ),
        ),
        *_index_strobes(spec),
        *_if(
            spec.index,
            held(
                *(INDEX, "index_position", spec.position_width),
                signed=True,
                unit="counts",
                help=f"Position at {place}, before any reset of the position.",
            ),
        ),
        *_if(
            front.index_once,
            held(TICK, "homed", help="The index was taken, since home rose. It does not wait for a tick."),
        ),
        *_if(
            front.modulus,
            held(
                *(TICK, "position_modulo", ((front.modulus or 2) - 1).bit_length()),
                unit="counts",
                help=f"Counts up to this period modulo {front.modulus}, from 0 on, since reset or since an index that "
                "resets. Between the ticks it counts on, and a preset leaves it as it is.",
            ),
        ),
        *_if(
            spec.external_tick,
            strobe(
                "tick_error",
                "One clock. Together with tick: the external tick was missing, and the core made one. Alone: an "
                "external tick came too early and was left out.",
            ),
        ),
        *_probe_ports(spec),
        *_compare_ports(spec),
        *_health_ports(spec),
        *_if(
            spec.over_speed,
            held(TICK, "over_speed", help=f"A velocity was beyond {spec.over_speed}, since it was cleared."),
        ),
        *_if(
            spec.filter_clocks,
            held(
                *(TICK, "swallowed_edges", 16),
                unit="edges",
                help="Edges that the glitch filter has kept out, two for each glitch; it stays at 65534. Between the "
                "ticks it counts on, and a capture takes what it is then.",
            ),
        ),
        *stream_ports(spec),
    )


def _wrong(spec: TachometerSpec) -> str:
    if spec.encoder.missing:
        return "the gap was not where it had to be, as of a tooth lost or extra; the next gap is taken."
    return spec.encoder.kind.wrong


def _index_strobes(spec: TachometerSpec) -> Iterable[Port]:
    if spec.front_end.index_state is None:
        return
    text = "One clock: z stayed high from the state of --index-at to the same state a period further, so the index is "
    yield strobe(WIDE, text + "at two places.")
    text = "One clock, with the first count after z has fallen: z came and went in one direction of counts without the "
    yield strobe(MISSED, text + "state of --index-at, so the index was not taken.")


def _probe_pins(spec: TachometerSpec) -> Iterable[Port]:
    if probes := len(spec.front_end.probes):
        yield pin("probe", "Probe inputs, asynchronous; their edges latch the position.", probes)
        text = "Arms probes, each while its bit is high, for the clocks after; synchronous to clk. After reset all are."
        yield pin("probe_arm", text, probes)


def _probe_ports(spec: TachometerSpec) -> Iterable[Port]:
    probes = range(len(spec.front_end.probes))
    if probes:
        text = "Probes that have latched and are not armed again. It changes between the ticks as well."
        yield held(TICK, "probed", len(probes), help=text)
    for number in probes:
        yield strobe(valid := f"probe_valid_{number}", f"One clock for every position that probe {number} latches.")
        text = f"Position at the latched edge of probe {number}, with a count of the same clock."
        yield held(valid, f"probe_position_{number}", spec.position_width, signed=True, unit="counts", help=text)
        text = f"Clocks from the last count to the latched edge of probe {number}; it stays at its end."
        yield held(valid, f"probe_time_{number}", spec.times.probe_width, unit="clocks", help=text)
        for fine in (port for port in spec.method_ports if port.name == FINE):
            text = f"Fine position that was shown when probe {number} latched: that of the end of a sampling period."
            yield held(valid, f"probe_fine_{number}", fine.width, signed=True, unit=fine.unit, help=text)
            text = (
                f"Clocks from the end of that period to the latched edge of probe {number}; all ones: there was none."
            )
            yield held(valid, f"probe_age_{number}", spec.times.probe_age_width, unit="clocks", help=text)


def _list_pins(spec: TachometerSpec) -> Iterable[Port]:
    if spec.compare is None or not spec.compare.depth:
        return
    texts = {
        "next": "Position that compare_append appends to the list of compare.",
        "append": "Appends it, in each clock in which it is high; if there is room in the list.",
        "clear": "Empties the list of compare.",
    }
    for name, text in texts.items():
        width = spec.position_width if name == "next" else 1
        yield Port(f"compare_{name}", "input", width, signed=width > 1, help=f"{text} Synchronous to clk.")


def _compare_ports(spec: TachometerSpec) -> Iterable[Port]:
    if spec.compare is None:
        return
    yield held(TICK, "compare", help=f"Pulse at a position, of {spec.compare.width}. It does not wait for a tick.")
    yield held(TICK, "compare_count", COUNT_WIDTH, help="Pulses of compare since reset; it wraps.")
    if depth := spec.compare.depth:
        text = f"Positions in the list of compare, with the one that is awaited: {depth} are all."
        yield held(TICK, "compare_waiting", depth.bit_length(), help=text)
    yield strobe(COMPARE, "The first clock of a pulse of compare.")
    text = "Position of the latest pulse of compare."
    fine = getattr(spec, "fine_bits", 0) * spec.compare.fine
    unit = f"2^-{fine} counts" if fine else "counts"
    yield held(COMPARE, "compare_position", spec.position_width + fine, signed=True, unit=unit, help=text)


def _health_ports(spec: TachometerSpec) -> Iterable[Port]:
    if not spec.health:
        return
    absent = {fault for line, fault in OPEN.items() if line not in spec.front_end.complemented}
    absent |= {Fault.INDEX_MISSED} if spec.front_end.index_state is None else set()
    codes = "; ".join(f"{code}: {text}" for code, text in FAULT_TEXTS.items() if code not in absent)
    now = "It changes between the ticks as well, and a capture takes what it is then."
    yield held(TICK, "health", FAULT_WIDTH, help=f"The first fault of the encoder since it was cleared; {codes}. {now}")
    yield held(TICK, "faults", FAULTS_WIDTH, help="Faults of the encoder since they were cleared; it stays at 255.")
    yield held(TICK, "fault", help="There has been a fault of the encoder: health is not 0.")
    if spec.front_end.index_watched:
        text = "Counts by which the latest wrong turn from index to index went too far forward: lost, or extra."
        yield held(TICK, "index_error", spec.position_width, signed=True, unit="counts", help=text)


def _if(present: object, port: Port) -> Iterable[Port]:
    return (port,) if present else ()


def bound_ports(spec: TachometerSpec) -> tuple[Port, ...]:
    """Return ports that enclose the true speed."""
    if not spec.bounds:
        return ()
    width = spec.bound.width if spec.scale.output is None else spec.widths.velocity
    return (
        *(
            held(
                *(UPDATE, name, width),
                signed=True,
                unit=f"2^{-spec.widths.frac_bits} {spec.unit}",
                help=f"{side} end of what the true mean speed over the measured window was, for edges within "
                "--edge-error (0: an ideal disc and ideal lines) while no count is lost or added; "
                f"{sign} bounds.none of the manifest means that there is none.",
            )
            for name, side, sign in zip(BOUNDS, ("Lower", "Upper"), ("minus", "plus"), strict=True)
        ),
        held(UPDATE, "bounds_valid", help="There are bounds; not yet for the first measurement."),
    )
