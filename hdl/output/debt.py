"""A difference to a new value is owed, and paid little by little."""

from amaranth import Module, Mux, Signal, Value, signed

from tachometry.spec.formats.angles import Angles


def owed(m: Module, angles: Angles, jumps: Value, gap: Value) -> Signal:
    """Return what is owed: with `jumps` a gap is added to it; in all other clocks 2^-spread of it is paid."""
    debt = Signal(signed(angles.bits))
    spread, pay = angles.spread, Signal(angles.bits)
    m.d.comb += pay.eq(Mux(jumps, gap, ~(debt >> spread)))
    m.d.sync += debt.eq(debt + pay + (~jumps & ~(debt[-1] & debt[:spread].any())))
    return debt
