"""An encoder that is not there."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.core.line import EmulatedLine
from tachometry.hdl.wires.ports import Box, by_name, only_if
from tachometry.spec.registers.emulator import (
    BOUNCE_BITS,
    BOUNCE_WIDTH,
    DROP_BITS,
    DROP_WIDTH,
    ERROR_WIDTH,
    FINE_WIDTH,
    JITTER_WIDTH,
    NOISE_BIT,
    NOISE_WIDTH,
    PHASE_WIDTH,
    RANDOM_TAP,
    RANDOM_WIDTH,
    RATE_SHIFT,
    START,
    WIRES_WIDTH,
)

_HALF = 1 << FINE_WIDTH - 1
_QUARTER = 1 << FINE_WIDTH - 2


class EncoderEmulator(Box):
    """Turns a phase by a speed, the speed towards what is asked for, and makes the lines of an encoder of it.

    The lines follow the phase `spec.registers.emulator.LATENCY` clocks later. The random movement of the edges is
    chosen anew in the middle between two of them, so that it makes no edges of its own: all errors together must stay
    below an eighth of a period.

    - `lines_per_rev`: Periods in a revolution, for the index line; None: there is none.
    - `index_place`: Quarter of its period in which the index is high, 0 to 3.
    - `complemented`: Lines whose complements are there as well, which no broken wire harms.
    """

    def __init__(
        self, lines_per_rev: int | None = None, index_place: int = 0, complemented: tuple[str, ...] = ()
    ) -> None:
        self._lines_per_rev, self._index_place, self._complemented = lines_per_rev, index_place, complemented
        super().__init__(
            speed=In(signed(PHASE_WIDTH)),  # phase a clock that it goes to
            rate=In(PHASE_WIDTH),  # change of the speed in two clocks, in 2^-16; 0: at once
            # How late B rises, A falls and B falls, in 2^-10 periods.
            **{name: In(signed(ERROR_WIDTH)) for name in ("phase_error", "duty_a", "duty_b")},
            jitter=In(JITTER_WIDTH),  # bits that take part in the random movement, in 2^-10 periods
            bounce=In(BOUNCE_WIDTH),  # clocks for which a line bounces after an edge
            drop=In(DROP_WIDTH),  # edges of 256 that are left out
            glitches=In(NOISE_WIDTH),  # clocks of 65536 in which both A and B have the wrong level
            broken=In(WIRES_WIDTH),  # of A, B and Z: the line is high
            stuck=In(WIRES_WIDTH),  # of A, B and Z: it stays as it is
            jump=In(1),  # turns by half a period
            a=Out(1),
            b=Out(1),
            **only_if(lines_per_rev is not None, z=Out(1)),  # in one quarter of a period in each revolution
            **{f"{line}_n": Out(1) for line in complemented},
        )

    def build(self, m: Module) -> None:
        phase = Signal(PHASE_WIDTH, init=START)
        after = Signal(signed(PHASE_WIDTH + 2))
        m.d.comb += after.eq(phase + (self._speed(m) >> RATE_SHIFT))
        m.d.sync += phase.eq(after ^ (self.jump << PHASE_WIDTH - 1))
        random = Signal(RANDOM_WIDTH, init=1)
        m.d.sync += random.eq((random << 1) | (random[-1] ^ random[RANDOM_TAP - 1]))
        fine = Signal(FINE_WIDTH)
        m.d.comb += fine.eq(phase[-FINE_WIDTH:])
        self._lines(m, fine, random, self._jitter(m, fine, random))
        if self._lines_per_rev is not None:
            self._index(m, fine, after[PHASE_WIDTH:])

    def _speed(self, m: Module) -> Signal:
        """Go to the speed that is asked for in two clocks, as the sum and its comparison are long carry chains."""
        speed = Signal(signed(PHASE_WIDTH + RATE_SHIFT))
        target = Signal.like(speed)
        second = Signal()
        down = Signal()
        turned = Signal(signed(len(speed) + 1))  # the sum
        goes_down = Signal()
        m.d.comb += [target.eq(self.speed << RATE_SHIFT), goes_down.eq(target < speed)]
        passed = Mux(down, turned <= target, turned >= target)
        m.d.sync += second.eq(~second)
        with m.If(second & (goes_down != down) & self.rate.any()):
            pass  # the target has gone to the other side between the two clocks
        with m.Elif(second):
            m.d.sync += speed.eq(Mux((self.rate == 0) | passed, target, turned))
        with m.Else():
            m.d.sync += [down.eq(goes_down), turned.eq(speed + Mux(goes_down, -self.rate, self.rate))]
        return speed

    def _jitter(self, m: Module, fine: Signal, random: Signal) -> Signal:
        """Return how far the edges are moved, which changes in the middle between two of them."""
        between = Signal(2)
        between_before = Signal(2, init=1)
        moved = Signal(signed(JITTER_WIDTH + 1))
        m.d.comb += between.eq((fine + _QUARTER // 2)[FINE_WIDTH - 2 : FINE_WIDTH])
        m.d.sync += between_before.eq(between)
        with m.If(between != between_before):
            late, early = random[:JITTER_WIDTH], random[JITTER_WIDTH : 2 * JITTER_WIDTH]
            m.d.sync += moved.eq((late & self.jitter) - (early & self.jitter))
        return moved

    def _lines(self, m: Module, fine: Signal, random: Signal, moved: Signal) -> None:
        """Drive A and B, each high for half a period from its start on, less its errors."""
        starts = {"a": _QUARTER, "b": _HALF + self.phase_error}
        ends = {"a": self.duty_a, "b": self.duty_b}
        low, high = NOISE_BIT + NOISE_WIDTH, NOISE_BIT + 2 * NOISE_WIDTH
        noise = ~random[low:high].any() & (random[NOISE_BIT:low] < self.glitches)
        outputs, inverted = by_name(self, starts), by_name(self, self._complemented, "{}_n")
        for k, name in enumerate(starts):
            m.submodules[f"line_{name}"] = line = EmulatedLine(whole=name in self._complemented)
            since = Signal(FINE_WIDTH, name=f"since_{name}")
            m.d.comb += [
                since.eq(fine - moved - starts[name]),
                line.random.eq(random[BOUNCE_BITS[k]]),
                line.drop.eq((random[DROP_BITS[k] : DROP_BITS[k] + DROP_WIDTH] < self.drop) | self.stuck[k]),
                line.noise.eq(noise),
                line.broken.eq(self.broken[k]),
                line.bounce.eq(self.bounce),
                outputs[name].eq(line.line),
            ]
            m.d.sync += line.ideal.eq(since < _HALF + ends[name])
            if name in self._complemented:
                m.d.comb += inverted[name].eq(~line.whole)

    def _index(self, m: Module, fine: Signal, turns: object) -> None:
        """Drive the index line, in a quarter of the first period."""
        last = self._lines_per_rev - 1 if self._lines_per_rev else 0
        period = Signal(range(last + 1))
        with m.If(turns == 1):
            m.d.sync += period.eq(Mux(period == last, 0, period + 1))
        with m.Elif(turns != 0):
            m.d.sync += period.eq(Mux(period == 0, last, period - 1))
        index = Signal()
        m.d.sync += index.eq((period == 0) & (fine[-2:] == self._index_place))
        z = Signal()
        with m.If(~self.stuck[2]):
            m.d.sync += z.eq(index)
        m.d.comb += self.z.eq(z | self.broken[2])
        if "z" in self._complemented:
            m.d.comb += self.z_n.eq(~z)
