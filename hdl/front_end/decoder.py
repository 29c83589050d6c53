"""From levels to counts."""

from amaranth import Cat, Module, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.tooth_wheel import wheel_of
from tachometry.hdl.wires.ports import Box, by_name, only_if
from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.sensors import Levels, changes, packed_levels
from tachometry.spec.core.tooth_wheel import ToothWheel


class QuadratureDecoder(Box):
    """Decodes quadrature, x1, x2 or x4: gives a step of −1, 0 or +1 per clock, without latency.

    Forward is A before B: (A, B) = 00, 10, 11, 01. x4 counts every edge; x2 both edges of A; x1 the edges of A while B
    is low, rising forward and falling backward, so that a line which dithers on one edge never creeps. A clock in
    which both lines change has no direction: it counts nothing and is reported.

    It raises ValueError if `decoding` is not 1, 2 or 4.
    """

    def __init__(self, decoding: int, *, reverse: bool = False) -> None:
        if decoding not in (1, 2, 4):
            raise ValueError(f"decoding must be 1, 2 or 4, not {decoding}")
        self._decoding, self._reverse = decoding, reverse
        super().__init__(
            level_a=In(1),
            level_b=In(1),
            ready=In(1),  # low while the level before this one is not real: neither a step nor an error
            step=Out(signed(2)),  # −1, 0 or +1
            decode_error=Out(1),  # both lines changed
        )

    def build(self, m: Module) -> None:
        past_a = Signal()
        past_b = Signal()
        m.d.sync += [past_a.eq(self.level_a), past_b.eq(self.level_b)]
        counted, backward, illegal = transition(self._decoding, self.level_a, self.level_b, past_a, past_b)
        count = Signal()
        m.d.comb += [
            count.eq(self.ready & counted),
            self.step.eq(Cat(count, count & (~backward if self._reverse else backward))),
            self.decode_error.eq(self.ready & illegal),
        ]


def transition(
    decoding: int, level_a: Value, level_b: Value, past_a: Value, past_b: Value
) -> tuple[Value, Value, Value]:
    """Return whether a change of levels counts, whether backward, and whether both have changed, which never counts."""
    change_a = level_a ^ past_a
    change_b = level_b ^ past_b
    counted = {1: change_a & ~change_b & ~level_b, 2: change_a & ~change_b, 4: change_a ^ change_b}[decoding]
    backward = ~(level_a ^ past_b)
    return counted, backward, change_a & change_b


class SensorDecoder(Box):
    """Decodes any sensor: gives a step of −1, 0 or +1 per clock, without latency.

    It looks up what a change of the lines counts, see `Sensor.change`. Levels that no sensor has, as of halls that are
    all equal, are reported when they come, and the levels before them are remembered.
    """

    def __init__(self, encoder: Encoder, wheel: ToothWheel | None = None) -> None:
        self._encoder, self._wheel = encoder, wheel
        lines = {f"level_{line}": In(1) for line in encoder.kind.lines}
        super().__init__(
            **lines,
            ready=In(1),  # low while the levels before these are not real: neither a step nor an error
            step=Out(signed(2)),  # −1, 0 or +1
            decode_error=Out(1),  # the lines did what they should not
            **only_if(wheel, index=Out(1), synced=Out(1)),  # see `wheel_of`
        )

    def build(self, m: Module) -> None:
        encoder, sensor = self._encoder, self._encoder.kind
        level = Cat(by_name(self, sensor.lines, "level_{}").values())
        past = Signal(len(level))
        table = changes(encoder.sensor, encoder.decoding)
        forward, backward, wrong = (
            _looked_up(m, {pair for pair, (step, error) in table.items() if of(step, error)}, level, past)
            for of in (lambda step, _: step > 0, lambda step, _: step < 0, lambda _, error: error)
        )
        if encoder.reverse:
            forward, backward = backward, forward
        if len(sensor.legal) == 1 << len(level):
            m.d.sync += past.eq(level)
        else:
            illegal = Signal()
            told = Signal()
            m.d.comb += illegal.eq(~level.matches(*map(packed_levels, sensor.legal)))
            m.d.sync += told.eq(illegal & self.ready)
            with m.If(~illegal | ~self.ready):
                m.d.sync += past.eq(level)
            wrong |= illegal & ~told
        if self._wheel is not None:
            m.submodules.gap_filler = filler = wheel_of(self._wheel)
            m.d.comb += [
                filler.tooth.eq(self.ready & (forward | backward)),
                self.step.eq(Cat(filler.filled, filler.filled & encoder.reverse)),
                self.decode_error.eq(filler.error),
                self.index.eq(filler.index),
                self.synced.eq(filler.synced),
            ]
            return
        m.d.comb += [
            self.step.eq(Cat(self.ready & (forward | backward), self.ready & backward)),
            self.decode_error.eq(self.ready & wrong),
        ]


def _looked_up(m: Module, pairs: set[tuple[Levels, Levels]], level: Value, past: Value) -> Value:
    """Return whether the levels before and these are one of the pairs."""
    # No shift of a constant: Verilator 5.48 joins two of them, and cuts the longer constant.
    numbers = sorted(packed_levels(before) << len(level) | packed_levels(after) for before, after in pairs)
    found = Signal()
    with m.Switch(Cat(level, past)):
        with m.Case(*numbers):
            m.d.comb += found.eq(1)
        with m.Default():
            m.d.comb += found.eq(0)
    return found


def decoder_of(encoder: Encoder, wheel: ToothWheel | None = None) -> QuadratureDecoder | SensorDecoder:
    """Return the decoder of a sensor, and of a wheel of which teeth are missing."""
    if encoder.sensor == "quadrature":
        return QuadratureDecoder(encoder.decoding, reverse=encoder.reverse)
    return SensorDecoder(encoder, wheel)
