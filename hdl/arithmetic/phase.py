"""The phase of an update, and its slopes, by a multiplier of the FPGA."""

from collections.abc import Iterable, Sequence
from functools import reduce
from operator import or_

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed

from tachometry.hdl.arithmetic.products import term_of
from tachometry.spec.formats.angles import Angles


def take_phase(
    m: Module, angles: Angles, tick: Value, at: Value, update: tuple[Value, Value, Value, Value], s: Value
) -> tuple[Value, Value, Signal]:
    """Take products from an update on; return when all are there, the phase that is `s` later, and its slope from then.

    An update is when it comes, a place between counts, a velocity and an acceleration. The phase is that `at` the tick,
    to which two products are added, the first of which is finer. Others are of slopes: the acceleration comes first,
    and is kept; then the mean slope, from the velocity on.
    """
    begin, between, speed, acceleration = update
    (of_speed, of_fine, of_bend), clocks = angles.factors, angles.product
    finer = angles.factor_bits - max(of_fine.shift, 0)
    place = between.shift_right(max(-of_fine.shift, 0)).shift_left(max(-finer, 0))
    finer = max(finer, 0)
    bend, velocity = term_of(of_bend, acceleration), term_of(of_speed, speed)
    slope = Signal(signed(min(max(len(bend), len(velocity)), angles.bits)))
    kept = Signal.like(slope)
    line = Signal(6 * clocks)  # clocks since the update
    m.d.sync += line.eq(Cat(begin, line))
    begins, ends = [begin, *line[clocks - 1 : -1 : clocks]], line[1::clocks]
    half = s >> 1
    times = (half - angles.late, s - half + (angles.tick >> 1), s)
    factors = (of_fine.number, of_bend.number, of_speed.number, *times)
    factor = _chosen(m, factors, [C(0, 1), *line[clocks - 2 : -clocks : clocks]], angles.factor_bits)
    terms = ((place, begins[0]), (bend, begins[1]), (velocity, begins[2]), (kept, _any(begins[3:])))
    whole = _multiply(m, terms, factor)
    phase = Signal(angles.bits + 2 * finer)
    with m.If(tick):
        m.d.sync += phase.eq((at << finer | 1 << finer >> 1) << finer)
    with m.Elif(ends[0] | ends[5]):
        m.d.sync += phase.eq((phase >> finer) + whole)
    with m.If(begin | begins[2]):
        m.d.sync += slope.eq(0)
    with m.Elif(ends[1:5].any()):
        rounds, more = whole[angles.factor_bits - 1], whole[angles.factor_bits :]
        m.d.sync += slope.eq((Cat(C(1, 1), slope).as_signed() + Cat(rounds, more).as_signed()) >> 1)
    with m.If(begins[2] | begins[4]):
        m.d.sync += kept.eq(slope)
    return line[-1], phase[: angles.bits], slope


def _any(values: Iterable[Value]) -> Value:
    return reduce(or_, values)


def _chosen(m: Module, values: Sequence[Value | int], coming: Sequence[Value], bits: int) -> Signal:
    """Return a signed value: each two clocks after its strobe, the first one without."""
    number = Signal(range(len(values)))
    value = Signal(signed(bits))
    strobes = (_any(one for place, one in enumerate(coming) if place >> bit & 1) for bit in range(len(number)))
    m.d.sync += [number.eq(Cat(strobes)), value.eq(Array(values)[number])]
    return value


def _multiply(m: Module, terms: Sequence[tuple[Value, Value]], factor: Value) -> Signal:
    """Return the product of a factor and the term of a strobe, two clocks after that.

    Nothing chooses: each term has a register that is 0 but for a clock, as the reset of a register takes no cell.
    """
    held = [Signal(signed(len(term)), name="held") for term, _ in terms]
    for one, (term, begins) in zip(held, terms, strict=True):
        m.d.sync += one.eq(Mux(begins, term, 0))
    whole = Signal(signed(max(map(len, held)) + len(factor)))
    m.d.sync += whole.eq(reduce(or_, held) * factor)
    return whole
