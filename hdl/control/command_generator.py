"""Commands that the core makes itself: constant speeds, ramps and sines."""

from amaranth import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.control.product import ParallelProduct, SerialProduct
from tachometry.hdl.wires.ports import Box
from tachometry.spec.control.form import POSITION_FRAC_BITS
from tachometry.spec.control.generator import AMPLITUDE_WIDTH, FACTOR_BITS, MODE_WIDTH, RAMP, WORD, GeneratorForm, Scale


def _shifted(value: Signal, scale: Scale) -> Value:
    return value >> scale.shift if scale.shift >= 0 else value << -scale.shift


class _Course:
    """Holds where the generator is, and in which step of a control tick."""

    def __init__(self, form: GeneratorForm) -> None:
        self.place = Signal(signed(form.place_width))
        self.speed = Signal(signed(form.velocity_bits + 1))
        self.change = Signal(signed(form.change_width))
        self.toward = Signal(signed(form.most_away.bit_length() + 1), reset_less=True)  # the way to the middle
        # A sine has begun; it goes on, and this step is one of it; this step is one of a ramp.
        self.swings = Signal()
        self.swinging = Signal()
        self.ramp = Signal()
        self.bound = Signal(WORD, reset_less=True)
        # Which of the products: of the way to the middle, of the velocity, of the acceleration.
        self.stage = Signal(2)
        # One after the other, behind the first product.
        self.move = Signal()
        self.settle = Signal()
        self.follow = Signal()
        self.close = Signal()
        self.again = Signal()


class CommandGenerator(Box):
    """Makes a step at each control tick, as `GeneratorForm` has it. All inputs are taken with `tick`.

    The commands are those of a control tick from its clock on, for at least two clocks. The next `tick` may come
    `generator_clocks` after it.
    """

    def __init__(self, form: GeneratorForm, multiplier: str = "serial") -> None:
        self._form, self._multiplier = form, multiplier
        super().__init__(
            tick=In(1),
            enable=In(1),  # where it is low the position is commanded, at rest
            position=In(signed(form.position_width)),
            mode=In(MODE_WIDTH),
            velocity=In(signed(WORD)),
            acceleration=In(WORD),
            amplitude=In(signed(AMPLITUDE_WIDTH)),
            rate=In(WORD),
            command_position=Out(signed(form.position_width + POSITION_FRAC_BITS)),
            command_velocity=Out(signed(form.command_width)),
            command_acceleration=Out(signed(form.acceleration_width)),
        )

    def build(self, m: Module) -> None:
        at = _Course(self._form)
        product = self._multiply(m, at)
        self._take(m, at)
        self._sequence(m, at, product.done)
        self._bound(m, at, product)
        self._add(m, at)
        for number, command in enumerate((self.command_velocity, self.command_acceleration), 1):
            held, _ = saturate(m, product.product, (1 << (len(command) - 1)) - 1)
            with m.If(product.done & (at.stage == number)):
                m.d.sync += command.eq(held)

    def _multiply(self, m: Module, at: _Course) -> SerialProduct | ParallelProduct:
        """Return the multiplier, with word and factor of the stage."""
        form = self._form
        box = SerialProduct if self._multiplier == "serial" else ParallelProduct
        m.submodules.product = product = box(form.word_width, FACTOR_BITS)
        words = (
            at.toward >> form.away_shift,
            _shifted(at.speed, form.velocity),
            _shifted(at.change, form.acceleration),
        )
        factors = (self.rate, form.velocity.factor, form.acceleration.factor)
        with m.Switch(at.stage):
            for number, (word, factor) in enumerate(zip(words, factors, strict=True)):
                with m.Case(number) if number < 2 else m.Default():
                    m.d.comb += [product.word.eq(word), product.factor.eq(factor)]
        m.d.comb += product.start.eq(self.tick | at.again)
        m.d.comb += self.command_position.eq(at.place >> form.amplitude_shift)
        return product

    def _take(self, m: Module, at: _Course) -> None:
        """Take the inputs with a tick; where the generator is not enabled it follows the position."""
        form, sine = self._form, self.mode[1]
        with m.If(self.tick):
            wanted = Mux(sine, 0, self.velocity << form.velocity_shift)
            m.d.sync += [
                at.swings.eq(sine & self.enable),
                at.swinging.eq(sine & at.swings & self.enable),
                at.ramp.eq(self.mode == RAMP),
                at.bound.eq(self.acceleration),
                at.change.eq(Mux(self.enable, wanted - at.speed, 0)),
            ]
            with m.If(~(sine & at.swings)):
                m.d.sync += at.toward.eq(self.amplitude << form.amplitude_shift)
            with m.If(~self.enable):
                m.d.sync += [at.place.eq(self.position << form.fraction), at.speed.eq(0)]

    def _sequence(self, m: Module, at: _Course, done: Signal) -> None:
        """Go from product to product, and behind the first one from step to step."""
        with m.If(done):
            m.d.sync += at.stage.eq(Mux(at.stage == 2, 0, at.stage + 1))
        m.d.sync += [
            at.move.eq(done & (at.stage == 0)),
            at.settle.eq(at.move),
            at.follow.eq(at.settle),
            at.close.eq(at.follow),
        ]
        m.d.sync += at.again.eq(at.settle | (done & (at.stage == 1)))

    def _bound(self, m: Module, at: _Course, product: SerialProduct | ParallelProduct) -> None:
        """Bound the change of a ramp; of a sine it is the product. Compared while the product is made."""
        above = Signal()
        below = Signal()
        m.d.sync += [above.eq(at.change > at.bound), below.eq(at.change < -at.bound)]
        with m.If(product.done & (at.stage == 0)):
            with m.If(at.swinging):
                m.d.sync += at.change.eq(product.product)
            with m.Elif(at.ramp & above):
                m.d.sync += at.change.eq(at.bound)
            with m.Elif(at.ramp & below):
                m.d.sync += at.change.eq(-at.bound)

    def _add(self, m: Module, at: _Course) -> None:
        """Add the change to the velocity, and take the velocity from the way to the middle, with one adder."""
        form, follow = self._form, at.follow
        # The carry of a less comes from an additional bit at the end.
        total = Signal(signed(max(form.change_width, len(at.toward)) + 1), reset_less=True)
        augend, addend = Mux(follow, at.toward, at.speed), Mux(follow, ~at.speed, at.change)
        m.d.sync += total.eq((Cat(follow, augend).as_signed() + Cat(follow, addend).as_signed()) >> 1)
        held, _ = saturate(m, total, form.most_velocity)
        with m.If(at.settle):
            m.d.sync += at.speed.eq(held)
        with m.If(follow):
            m.d.sync += at.place.eq(at.place + at.speed)
        held, _ = saturate(m, total, form.most_away)
        with m.If(at.close):
            m.d.sync += at.toward.eq(held)
