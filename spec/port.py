"""Ports of the exported core: what each one is, and with which strobe it is new.

Everything that shows or compares a core reads this list: engines, comparison, waveform, CSV, testbench, manifest,
documents. A port that is added here, and driven by hardware and golden model, appears in all of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tachometry.spec.tachometer import TachometerSpec

TICK, UPDATE, INDEX = "tick", "velocity_valid", "index_valid"


@dataclass(frozen=True)
class Port:
    """A scalar port of the exported core.

    Parameters
    ----------
    name : str
    direction : str
        `input` or `output`.
    width : int
        Bits.
    signed : bool
    held_by : str
        Of an output, the strobe in whose clocks it is read; a strobe is read with itself.
    unit : str
        What one LSB is.
    help : str
        What the port means, in a sentence or two.
    """

    name: str
    direction: str
    width: int = 1
    signed: bool = False
    held_by: str = ""
    unit: str = ""
    help: str = ""

    @property
    def is_strobe(self) -> bool:
        """Whether it is high for one clock when something is new."""
        return self.held_by == self.name


def pin(name: str, help: str, width: int = 1) -> Port:
    """An input, of one bit as a rule."""
    return Port(name, "input", width, help=help)


def strobe(name: str, help: str) -> Port:
    """An output that is high for one clock when something is new."""
    return Port(name, "output", held_by=name, help=help)


def held(by: str, name: str, width: int = 1, *, signed: bool = False, unit: str = "", help: str) -> Port:
    """An output that is read in the clocks of the strobe `by`."""
    return Port(name, "output", width, signed, by, unit, help)


class HasPorts:
    """What follows from the ports of an exported core."""

    @property
    def ports(self) -> tuple[Port, ...]:
        """Ports of the exported core, in order."""
        raise NotImplementedError

    @property
    def pins(self) -> tuple[Port, ...]:
        """Inputs beside clock and reset."""
        return tuple(port for port in self.ports if port.direction == "input" and port.name not in ("clk", "rst"))

    @property
    def outputs(self) -> tuple[Port, ...]:
        """Outputs of the exported core, in order."""
        return tuple(port for port in self.ports if port.direction == "output")

    @property
    def strobes(self) -> dict[str, tuple[str, ...]]:
        """Outputs that strobe, each with the names of the outputs that are new with it."""
        outputs = self.outputs
        return {
            strobe.name: tuple(
                port.name for port in outputs if port.held_by == strobe.name and port.name != strobe.name
            )
            for strobe in outputs
            if strobe.is_strobe
        }


def ports_of(spec: TachometerSpec) -> tuple[Port, ...]:
    """All ports of a core, in the order of the exported module; those of options and methods come last."""
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
        *spec.bound_ports,
        *spec.method_ports,
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
