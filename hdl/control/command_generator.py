"""Commands that the core makes itself: constant speeds, ramps and sines."""

from amaranth import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.control.product import ParallelProduct, SerialProduct
from tachometry.spec.control.form import POSITION_FRAC_BITS
from tachometry.spec.control.generator import (
    AMPLITUDE_WIDTH,
    FACTOR_BITS,
    MODE_WIDTH,
    RAMP,
    WORD,
    GeneratorForm,
    Scale,
)


def _shifted(value: Signal, scale: Scale) -> Value:
    return value >> scale.shift if scale.shift >= 0 else value << -scale.shift


class CommandGenerator(wiring.Component):
    """Makes a step at each control tick, as `GeneratorForm` has it. All inputs are taken with `tick`.

    The commands are those of a control tick from its clock on, for at least two clocks. The next `tick` may come
    `generator_clocks` after it.

    Parameters
    ----------
    form : GeneratorForm
    multiplier : str
        `serial` or `parallel`.

    Members
    -------
    tick : In(1)
    enable : In(1)
        Where it is low the position is commanded, at rest.
    position : In(signed)
    mode : In(2)
    velocity : In(signed(32))
    acceleration : In(32)
    amplitude : In(signed(28))
    rate : In(32)
    command_position, command_velocity, command_acceleration : Out(signed)
    """

    def __init__(self, form: GeneratorForm, multiplier: str = "serial") -> None:
        self._form = form
        self._multiplier = multiplier
        super().__init__(
            {
                "tick": In(1),
                "enable": In(1),
                "position": In(signed(form.position_width)),
                "mode": In(MODE_WIDTH),
                "velocity": In(signed(WORD)),
                "acceleration": In(WORD),
                "amplitude": In(signed(AMPLITUDE_WIDTH)),
                "rate": In(WORD),
                "command_position": Out(signed(form.position_width + POSITION_FRAC_BITS)),
                "command_velocity": Out(signed(form.command_width)),
                "command_acceleration": Out(signed(form.acceleration_width)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        form = self._form
        place = Signal(signed(form.place_width))
        speed = Signal(signed(form.velocity_bits + 1))
        change = Signal(signed(form.change_width))
        toward = Signal(signed(form.most_away.bit_length() + 1), reset_less=True)
        # A sine has begun; it goes on, and this step is one of it; this step is one of a ramp.
        swings = Signal()
        swinging = Signal()
        ramp = Signal()
        bound = Signal(WORD, reset_less=True)
        # Which of the products: of the way to the middle, of the velocity, of the acceleration.
        stage = Signal(2)
        # One after the other, behind the first product.
        move = Signal()
        settle = Signal()
        follow = Signal()
        close = Signal()
        again = Signal()
        box = SerialProduct if self._multiplier == "serial" else ParallelProduct
        m.submodules.product = product = box(form.word_width, FACTOR_BITS)
        words = (toward >> form.away_shift, _shifted(speed, form.velocity), _shifted(change, form.acceleration))
        factors = (self.rate, form.velocity.factor, form.acceleration.factor)
        with m.Switch(stage):
            for number, (word, factor) in enumerate(zip(words, factors, strict=True)):
                with m.Case(number) if number < 2 else m.Default():
                    m.d.comb += [product.word.eq(word), product.factor.eq(factor)]
        m.d.comb += product.start.eq(self.tick | again)
        m.d.comb += self.command_position.eq(place >> form.amplitude_shift)

        sine = self.mode[1]
        with m.If(self.tick):
            wanted = Mux(sine, 0, self.velocity << form.velocity_shift)
            m.d.sync += [
                swings.eq(sine & self.enable),
                swinging.eq(sine & swings & self.enable),
                ramp.eq(self.mode == RAMP),
                bound.eq(self.acceleration),
                change.eq(Mux(self.enable, wanted - speed, 0)),
            ]
            with m.If(~(sine & swings)):
                m.d.sync += toward.eq(self.amplitude << form.amplitude_shift)
            with m.If(~self.enable):
                m.d.sync += [place.eq(self.position << form.fraction), speed.eq(0)]
        done = product.done
        with m.If(done):
            m.d.sync += stage.eq(Mux(stage == 2, 0, stage + 1))
        m.d.sync += [move.eq(done & (stage == 0)), settle.eq(move), follow.eq(settle), close.eq(follow)]
        m.d.sync += again.eq(settle | (done & (stage == 1)))
        # Compared while the product is made.
        above = Signal()
        below = Signal()
        m.d.sync += [above.eq(change > bound), below.eq(change < -bound)]
        with m.If(done & (stage == 0)):
            with m.If(swinging):
                m.d.sync += change.eq(product.product)
            with m.Elif(ramp & above):
                m.d.sync += change.eq(bound)
            with m.Elif(ramp & below):
                m.d.sync += change.eq(-bound)
        # One adder: the velocity and its change, then the way to the middle less the velocity; and the carry of a less.
        total = Signal(signed(max(form.change_width, len(toward)) + 1), reset_less=True)
        augend, addend = Mux(follow, toward, speed), Mux(follow, ~speed, change)
        m.d.sync += total.eq((Cat(follow, augend).as_signed() + Cat(follow, addend).as_signed()) >> 1)
        held, _ = saturate(m, total, form.most_velocity)
        with m.If(settle):
            m.d.sync += speed.eq(held)
        with m.If(follow):
            m.d.sync += place.eq(place + speed)
        held, _ = saturate(m, total, form.most_away)
        with m.If(close):
            m.d.sync += toward.eq(held)
        for number, command in enumerate((self.command_velocity, self.command_acceleration), 1):
            held, _ = saturate(m, product.product, (1 << (len(command) - 1)) - 1)
            with m.If(done & (stage == number)):
                m.d.sync += command.eq(held)
        return m
