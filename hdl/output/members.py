"""Members that every datapath has."""

from amaranth import signed
from amaranth.lib.wiring import In, Member, Out

from tachometry.spec import TachometerSpec
from tachometry.spec.tachometer import BOUNDS


def tick_members(spec: TachometerSpec) -> dict[str, Member]:
    """What a datapath measures: `tick`, and `pulse_count` with it."""
    return {"tick": In(1), "pulse_count": In(signed(spec.count_width))}


def update_members(spec: TachometerSpec) -> dict[str, Member]:
    """An update: `velocity` to `stalled`, and with bounds `velocity_lower`, `velocity_upper`, `bounds_valid`."""
    members = {
        "velocity": Out(signed(spec.native_width)),
        "velocity_valid": Out(1),
        "interval": Out(spec.interval_width),
        "forced": Out(1),
        "stalled": Out(1),
    }
    if spec.bounds:
        members |= {name: Out(signed(spec.bound_width)) for name in BOUNDS} | {"bounds_valid": Out(1)}
    return members
