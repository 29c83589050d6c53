"""Outputs of a datapath that enclose the true speed."""

from amaranth import signed
from amaranth.lib.wiring import Member, Out

from tachometry.spec import TachometerSpec
from tachometry.spec.tachometer import BOUNDS


def bound_members(spec: TachometerSpec) -> dict[str, Member]:
    """`velocity_lower`, `velocity_upper` and `bounds_valid`; none without bounds."""
    if not spec.bounds:
        return {}
    return {name: Out(signed(spec.bound_width)) for name in BOUNDS} | {"bounds_valid": Out(1)}
