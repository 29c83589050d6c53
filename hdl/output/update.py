"""An update of the velocity, as one typed payload on its way from the method to the ports."""

from typing import Any

from amaranth import signed
from amaranth.lib import data, stream

from tachometry.spec import TachometerSpec
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.formats.velocity_output import VelocityOutput
from tachometry.spec.language.port import UPDATE, WHOLE

# The velocities of an update, and which way each is rounded: to the nearest (0), down (−1) or up (1).
VELOCITIES = {"velocity": 0, "velocity_smooth": 0, **BOUNDS}


def update_layout(spec: TachometerSpec) -> data.StructLayout:
    """Return what a method hands on: all outputs that change only with `velocity_valid`, velocities in counts per tick.

    `stamp` is for the age: how many ticks there were when the update was caused, modulo a power of two. `rests` is for
    the low-pass filter: no update will follow before the next count.
    """
    fields = {"velocity": signed(spec.velocity.native), "interval": spec.widths.interval, "forced": 1}
    if spec.facts.rests_with == UPDATE:
        fields["standstill"] = 1
    if spec.widths.stamp:
        fields["stamp"] = spec.widths.stamp
    if spec.facts.last_at_rest and spec.lowpass is not None:
        fields["rests"] = 1
    if spec.bounds:
        fields |= {name: signed(spec.velocity.bound_width) for name in BOUNDS} | {"bounds_valid": 1}
    fields |= _fields(spec, UPDATE)
    if "velocity_smooth" in fields:
        fields["velocity_smooth"] = fields["velocity"]
    return data.StructLayout(fields)


def rest_layout(spec: TachometerSpec) -> data.StructLayout:
    """Return what a method hands on after the velocity of an update, if there is such a thing."""
    return data.StructLayout(_fields(spec, WHOLE))


def _fields(spec: TachometerSpec, strobe: str) -> dict[str, Any]:
    ports = (port for port in spec.method_ports if port.held_by == strobe and not port.is_strobe)
    return {port.name: signed(port.width) if port.signed else port.width for port in ports}


def shown_layout(layout: data.StructLayout, output: VelocityOutput) -> data.StructLayout:
    """Return what the output stage makes of an update: velocities in another unit, and whether one saturates."""
    shown = {name: signed(output.width) for name in layout.members if name in VELOCITIES}
    return data.StructLayout({**layout.members, **shown, "velocity_overflow": 1})


def update_stream(layout: data.StructLayout) -> stream.Signature:
    """Return updates, each valid for a clock; nothing can hold them up."""
    return stream.Signature(layout, always_ready=True)
