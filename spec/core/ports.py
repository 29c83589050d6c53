"""Ports of the exported core of one axis."""

from collections.abc import Iterable

from tachometry.spec.core.numbers import Numbers
from tachometry.spec.language.port import INDEX, TICK, UPDATE, Port, held, pin, strobe


def ports_of(spec: Numbers, own: Iterable[Port]) -> tuple[Port, ...]:
    """Return all ports of a core, in the order of the exported module; those of options and methods come last."""
    return (
        pin("clk", "Clock; all outputs change at its rising edge."),
        pin("rst", "Synchronous reset, active high."),
        pin("a", "Encoder line A, asynchronous. Forward is A before B."),
        pin("b", "Encoder line B, asynchronous."),
        *_if(spec.index, pin("z", "Index line, asynchronous; its rising edge captures the position.")),
        *_if(
            spec.max_tick_cycles,
            pin("tick_in", "External tick, asynchronous; its rising edge ends a sampling period."),
        ),
        held(
            *(UPDATE, "velocity", spec.velocity_width),
            signed=True,
            unit=f"2^{-spec.frac_bits} {spec.unit}",
            help="Measured velocity; multiplied by rad_per_s_per_lsb of the manifest it is in rad/s.",
        ),
        strobe(UPDATE, "One clock for every update of the velocity."),
        held(
            *(UPDATE, "interval", spec.interval_width),
            unit=f"{spec.interval_unit_cycles} clocks",
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
        held(TICK, "pulse_count", spec.count_width, signed=True, unit="counts", help="m_e, the counts of this period."),
        held(
            *(TICK, "position", spec.position_width),
            signed=True,
            unit="counts",
            help="Sum of all counts up to this period; it wraps in two's complement.",
        ),
        strobe(
            "decode_error",
            "One clock: both lines changed at once, so the direction is unknown and nothing was counted.",
        ),
        held(TICK, "overflow", help="pulse_count was saturated at the maximum speed; position is exact all the same."),
        held(
            TICK,
            "stalled",
            help="The shaft rests: pulse_count was 0 in this period and in those before it for longer than the maximum "
            "time, see stalled_after_ticks of the manifest. It falls with the next count.",
        ),
        *_if(
            spec.output, held(UPDATE, "velocity_overflow", help="This velocity was saturated to the width of the port.")
        ),
        *_if(
            spec.age,
            held(
                *(TICK, "age", spec.timing.max_ticks.bit_length()),
                unit="ticks",
                help="Ticks between the count or the tick that caused the update and this tick; it stays at the "
                "maximum time.",
            ),
        ),
        *own,
        *_if(spec.index, strobe(INDEX, "One clock for every rising edge of z.")),
        *_if(
            spec.index,
            held(
                *(INDEX, "index_position", spec.position_width),
                signed=True,
                unit="counts",
                help="Position at the rising edge of z, before any reset of the position.",
            ),
        ),
        *_if(
            spec.max_tick_cycles,
            strobe(
                "tick_error",
                "One clock. Together with tick: the external tick was missing, and the core made one. Alone: an "
                "external tick came too early and was left out.",
            ),
        ),
        *_if(
            spec.filter_clocks,
            held(
                *(TICK, "swallowed_edges", 16),
                unit="edges",
                help="Edges that the glitch filter has kept out, two for each glitch; it stays at 65534.",
            ),
        ),
    )


def _if(present: object, port: Port) -> Iterable[Port]:
    return (port,) if present else ()
