"""Gates of `spec.core.extras.electrical`."""

from typing import Self

from amaranth import Array, C, Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.phase import take_phase
from tachometry.hdl.arithmetic.products import Product, take_products, term_of
from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.arithmetic.sine_cosine import SineCosine, SineTable
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name, only_if
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import LEADS, REFUSED, REFUSED_BITS, ElectricalAngle
from tachometry.spec.formats.angles import LEAD_BITS, SHOWN_BITS, Angles
from tachometry.spec.formats.sine import AHEAD_BITS
from tachometry.spec.formats.velocity_output import VelocityOutput


class Gates(Box):
    """The angle of the counts, carried on to every clock, and a shift that `angle_set` and an offset make.

    A set in clock c takes the value of clock c + 1. `latency` is that of a step to the position that has it. `inputs`
    have their widths. With `corrects` an index behind the first may show lost counts.
    """

    def __init__(
        self, extra: ElectricalAngle, angles: Angles, latency: int, inputs: dict[str, int], *, corrects: bool
    ) -> None:
        led = (angles.led.width, inputs["native_position_fine"]) if angles.led else ()
        self._angles, self._latency, self._corrects, self._offset = angles, latency, corrects, extra.offset
        self._turn = SineTable if extra.sincos_table else SineCosine
        super().__init__(
            {
                **only_if(not angles.is_read, step=In(signed(2))),
                **{name: In(signed(width) if width > 1 else 1) for name, width in inputs.items()},
                **dict.fromkeys(("tick", "native_valid", "angle_set"), In(1)),
                "position": In(angles.place_bits),
                "angle_value": In(SHOWN_BITS),
                "angle_offset": In(SHOWN_BITS, init=extra.offset),
                "angle_lead": In(LEAD_BITS, init=extra.ahead),
                "angle": Out(SHOWN_BITS),
                "angle_valid": Out(1),
                **({REFUSED: Out(REFUSED_BITS)} if corrects else {}),
                **{name: Out(signed(width)) for name, width in zip(LEADS, led, strict=False)},
                **(dict.fromkeys(("angle_sin", "angle_cos"), Out(signed(SHOWN_BITS))) if extra.turns else {}),
            }
        )

    @classmethod
    def of(cls, extra: ElectricalAngle, spec: TachometerSpec) -> Self:
        taken = [one for one in spec.method_ports if spec.carrying and one.name in ("acceleration", "position_fine")]
        inputs = {"native_velocity": spec.velocity.native, **{f"native_{one.name}": one.width for one in taken}}
        if read := spec.encoder.sampled:
            inputs |= {"phase": read.width, "position_valid": 1}
            return cls(extra, extra.angles(spec), spec.latency.tick, inputs, corrects=False)
        if extra.angles(spec).cycle:
            inputs |= dict.fromkeys(("ready", "level_a", "level_b", "level_c"), 1)
        else:
            inputs |= {"index_rises": 1} if spec.index else {}
            inputs |= {"home_rises": 1} if spec.front_end.index_once else {}
        return cls(extra, extra.angles(spec), spec.latency.tick, inputs, corrects=extra.corrects(spec))

    def build(self, m: Module) -> None:
        indexed = Signal()
        sets = Signal()
        members = self.signature.members
        rises = self.index_rises if "index_rises" in members else C(0)
        known = Signal(init=not self._angles.cycle)
        m.d.sync += sets.eq(self.angle_set)
        step: Value = C(0, 2)
        if self._angles.is_read:
            counted, moves = self._placed(), C(0)
        else:
            (step,) = delay(m, self.step, clocks=self._latency - 1)
            counted, moves = self._read(m, known) if self._angles.cycle else self._count(m, step, rises, indexed)
        if self._angles.tracks:
            begun, phase, slope = self._tracked(m, counted)
        else:
            begun, (phase, slope) = known, self._counted(m, step, counted, moves, known)
        valid = C(0) if self._angles.is_read else sets | rises | (known & begun if self._angles.cycle else 0)
        with m.If(valid):
            m.d.sync += [self.angle_valid.eq(1), indexed.eq(indexed | rises)]
        if "home_rises" in members:
            with m.If(self.home_rises):
                m.d.sync += [indexed.eq(0), self.angle_valid.eq(0)]
        # What the angle was set to, or nothing from the first index on.
        difference = Signal(SHOWN_BITS)
        shift = Signal(SHOWN_BITS)
        offset = Signal(SHOWN_BITS, init=self._offset)
        with m.If(self.native_valid):
            m.d.sync += offset.eq(self.angle_offset)
        with m.If(rises & ~indexed):
            m.d.sync += difference.eq(0)
        with m.Elif(sets):
            m.d.sync += difference.eq(self.angle_value - phase[-SHOWN_BITS:] - offset)
        coming = (phase[-SHOWN_BITS:] + shift)[:SHOWN_BITS]
        m.d.sync += [shift.eq(difference + offset), self.angle.eq(coming)]
        if "angle_sin" in members:
            m.submodules.sine_cosine = box = self._turn()
            m.d.comb += [
                box.angle.eq(coming + (slope >> self._angles.bits - SHOWN_BITS - AHEAD_BITS)),
                self.angle_sin.eq(box.sin),
                self.angle_cos.eq(box.cos),
            ]

    def _count(self, m: Module, step: Value, rises: Value, indexed: Value) -> tuple[Signal, Signal]:
        """Return the angle of the counts, a clock after a step, and whether an index zeroes it in the next clock.

        It is a sum for each count, and a remainder whose carry is one more. An index behind the first is refused if the
        angle is off by more than 1/16 of a turn, and is not that of the index before.
        """
        angles, counts = self._angles, self._angles.counts
        sum_ = Signal(angles.bits, init=angles.of(0))
        rest = Signal(range(counts))
        marks = Signal()
        zeroes = Signal()
        later = Signal()
        m.d.sync += [marks.eq(rises), later.eq(indexed)]
        m.d.comb += zeroes.eq(marks)
        if self._corrects:
            # No two counts of a turn have the same bits here.
            place = sum_[-max(counts.bit_length(), 4) :]
            before = Signal.like(place, init=0)
            top = place[-4:]
            m.d.comb += zeroes.eq(marks & (~later | ~top.any() | top.all() | (place == before)))
            m.d.sync += before.eq(Mux(marks, place, before))
            with m.If(marks & ~zeroes & ~self.angle_refused.all()):
                m.d.sync += self.angle_refused.eq(self.angle_refused + 1)
        angle, left = counted_on(angles, step, sum_, rest)
        # A zero is added to no sum, as it is known late.
        first = Mux(step[0], Mux(step[1], angles.of(-1), angles.of(1)), angles.of(0))
        begun = Mux(step[0], Mux(step[1], -angles.count[1] % counts, angles.count[1]), 0)
        m.d.sync += [sum_.eq(Mux(zeroes, first, angle)), rest.eq(Mux(zeroes, begun, left))]
        return sum_, zeroes

    def _read(self, m: Module, known: Signal) -> tuple[Signal, Signal]:
        """Return the angle of the latest state of the halls, and whether it changes in the next clock."""
        ready, level = delay(m, self.ready, Cat(by_name(self, "abc", "level_{}").values()), clocks=self._latency - 1)
        states = self._angles.states
        state = Signal.like(level)
        moves = Signal()
        angle = Signal(self._angles.bits)
        m.d.comb += moves.eq(ready & level.matches(*states) & (level != state))
        m.d.sync += known.eq(state.any())
        with m.If(moves):
            m.d.sync += [state.eq(level), angle.eq(Array(states.get(number, 0) for number in range(8))[level])]
        return angle, moves

    def _placed(self) -> Value:
        """Return the angle of the read of a tick."""
        angles = self._angles
        turned = (self.phase[: angles.place_bits] * angles.pole_pairs) << angles.bits - angles.place_bits
        return (turned + angles.of(0))[: angles.bits]

    def _tracked(self, m: Module, counted: Value) -> tuple[Signal, Value, Signal]:
        """Return whether an update has come, a phase that grows by its slope in each clock, and this slope.

        It begins anew after each update. The first phase owes nothing.
        """
        angles, bits = self._angles, self._angles.bits
        s = Signal(angles.factor_bits)
        done, start, now = self._carried(m, counted, s)
        phase = Signal(bits)
        run = Signal(bits)
        grows = Signal.like(now)
        begun = Signal()
        m.d.comb += run.eq(phase + grows)
        m.d.sync += [phase.eq(Mux(done, start, run)), begun.eq(begun | done)]
        debt = _owed(m, angles, done, Mux(begun, run - start, 0)[:bits])
        with m.If(self.native_valid):
            m.d.sync += s.eq(self.angle_lead + angles.span)
        with m.If(done):
            m.d.sync += grows.eq(now)
        if angles.is_read:
            with m.If(done | ~self.position_valid):
                m.d.sync += self.angle_valid.eq(self.position_valid)
        return begun, (phase + debt)[:bits], grows

    def _carried(self, m: Module, counted: Value, s: Value) -> tuple[Value, Value, Signal]:
        """Return when the products of an update are there, the phase `s` after it, and the slope from then on."""
        angles, begin = self._angles, self.native_valid
        bits, factor_bits, fine_bits = angles.bits, angles.factor_bits, angles.position_fine_bits
        # Place of the counts at a tick, for the update that it has.
        place = Signal(angles.place_bits)
        between = Signal(signed(fine_bits + angles.place_bits))
        with m.If(self.tick):
            m.d.sync += place.eq(self.position)
        m.d.comb += between.eq(self.native_position_fine - (place << fine_bits))
        led = Signal()
        update = between, self.native_velocity, self.native_acceleration
        more = self._lead(m, s + (angles.all_clocks - angles.clocks), angles.led, led) if angles.led else ()
        if angles.block:
            done, start, now = take_phase(m, angles, self.tick, counted, (begin, *update), s)
            if more:
                _, ends, _ = take_products(m, done, more, factor_bits, bits, block=True)
                m.d.sync += led.eq(ends)
            return done, start, now
        at = Signal(bits)
        now = Signal(signed(bits))
        with m.If(self.tick):
            m.d.sync += at.eq(counted)
        *first, mean, last = phase_products(angles, update, at, (s, (s >> 1) - angles.late))
        products = (*first, mean, (mean[0], s - (s >> 1) + (angles.tick >> 1), mean[2], now), last, *more)
        done, ends, start = take_products(m, begin, products, factor_bits, bits)
        m.d.sync += led.eq(ends)
        return done, start, now

    def _lead(self, m: Module, s: Value, led: VelocityOutput, ready: Value) -> tuple[Product, ...]:
        """Return products of velocity and position at a time, which are shown when they are ready."""
        angles, velocity, fine = self._angles, self.native_velocity, self.native_position_fine
        of_curve, of_way, of_shown = angles.lead_factors
        bend = term_of(of_curve, self.native_acceleration)
        curve = Signal(signed(len(bend)))
        mean = Signal(signed(max(len(curve), len(velocity)) + 1))
        end = Signal.like(mean)
        way = Signal(signed(len(term_of(of_way, mean))))
        place = Signal.like(fine)
        shown = Signal(signed(len(term_of(of_shown, end))))
        most, _ = saturate(m, shown, led.limit)
        with m.If(ready):
            m.d.sync += [self.velocity_lead.eq(most), self.position_lead.eq(place)]
        return (
            (bend, of_curve.number, C(0), curve),
            (curve, (s >> 1) - angles.late, velocity, mean),
            (curve, s - angles.late, velocity, end),
            (term_of(of_way, mean), of_way.number, C(0), way),
            (way, s, fine, place),
            (term_of(of_shown, end), of_shown.number, C(0), shown),
        )

    def _counted(self, m: Module, step: Value, counted: Value, moves: Value, known: Value) -> tuple[Value, Signal]:
        """Return a phase and its slope: it is at an edge after a count, and grows to the next edge at most.

        It owes nothing until its angle is known.
        """
        angles, bits, half = self._angles, self._angles.bits, self._angles.count[0] >> 1
        velocity, *_ = angles.factors
        s = Signal(angles.factor_bits)
        slope = Signal(signed(bits))
        products = ((term_of(velocity, self.native_velocity), velocity.number, C(0), slope), (slope, s, C(0), None))
        done, _, far = take_products(m, self.native_valid, products, angles.factor_bits, bits)
        most, _ = saturate(m, slope, half)
        grows = Signal.like(most)
        place = Signal.like(most)
        room = Signal(signed(len(most) + 1), init=half)  # to the next edge from before it by a slope
        beyond = Signal(signed(len(most) + 2))
        on = Mux(beyond[-1] == grows[-1], Mux(grows[-1], -half, half), place + grows)
        ahead = Signal(bits)
        with m.If(self.native_valid):
            m.d.sync += s.eq(self.angle_lead + angles.span)
        with m.If(done):
            m.d.sync += [grows.eq(most), room.eq(Mux(most[-1], -half, half) - most), ahead.eq(far)]
        m.d.comb += beyond.eq(place - room)
        m.d.sync += place.eq(Mux(step[0], Mux(step[1], half, -half), on))
        phase = Signal(bits)
        coming = Signal(bits)
        moved = Signal()
        m.d.comb += coming.eq(counted + place + ahead)
        m.d.sync += [phase.eq(coming), moved.eq(done | step[0] | moves)]
        debt = _owed(m, angles, moved, Mux(known, phase - coming, 0)[:bits])
        return (phase + debt)[:bits], grows


def counted_on(angles: Angles, step: Value, angle: Value, left: Value) -> tuple[Value, Value]:
    """Return an angle, and what is left of it in 1/counts, after a step."""
    counts, (quotient, remainder), back = angles.counts, angles.count, step[1]
    wraps, move = Mux(back, left < remainder, left >= counts - remainder), Const(quotient, angles.bits)
    change = Mux(back, Mux(wraps, counts - remainder, -remainder), Mux(wraps, remainder - counts, remainder))
    moved = angle + Mux(step[0], move ^ back.replicate(len(move)), 0) + (step[0] & (wraps ^ back))
    return moved, Mux(step[0], (left + change)[: len(left)], left)


def phase_products(
    angles: Angles, update: tuple[Value, Value, Value], at: Value, times: tuple[Value, Value]
) -> tuple[Product, ...]:
    """Return products whose last one is the phase at a time after an update: place between counts, velocity, and
    acceleration. Beside the time is how much later than the velocity its middle is.
    """
    (between, speed, acceleration), (velocity, fine, slopes) = update, angles.factors
    bend = term_of(slopes, acceleration)
    curve = Signal(signed(max(len(bend), 2)))
    target = Signal(angles.bits)
    slope = Signal(signed(angles.bits))
    return (
        (term_of(fine, between), fine.number, at, target),  # before the next tick
        (bend, slopes.number, C(0), curve),
        (term_of(velocity, speed), velocity.number, C(0), slope),
        (curve, times[1], slope, slope),
        (slope, times[0], target, None),
    )


def _owed(m: Module, angles: Angles, jumps: Value, gap: Value) -> Signal:
    """Return a debt: with `jumps` a gap is added to it; in all other clocks 2^-spread of it is paid."""
    debt = Signal(signed(angles.bits))
    pay = Signal(angles.bits)
    spread = angles.spread
    m.d.comb += pay.eq(Mux(jumps, gap, ~(debt >> spread)))
    m.d.sync += debt.eq(debt + pay + (~jumps & ~(debt[-1] & debt[:spread].any())))
    return debt
