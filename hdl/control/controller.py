"""Disturbance observer and controller share one multiplier, for one product after the other."""

from collections.abc import Mapping
from functools import reduce
from operator import or_

from amaranth import Cat, Module, Mux, Signal, Value, ValueLike, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleProduct
from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.control.product import ParallelProduct, SerialProduct
from tachometry.hdl.wires.ports import Box, by_name
from tachometry.spec.control.form import GAINS, GUARD_BITS, ControlForm, Term
from tachometry.spec.control.ports import GAIN_PORTS
from tachometry.spec.language.units import signed_width


def _choose(m: Module, term: Signal, values: Mapping[Term, ValueLike], found: Signal) -> None:
    """`found` is the value of a term; that of the last one stands for all others, which have none."""
    *others, last = values
    with m.Switch(term):
        for one in others:
            with m.Case(one):
                m.d.comb += found.eq(values[one])
        with m.Default():
            m.d.comb += found.eq(values[last])


class _Taken:
    """Holds the inputs that are taken with a tick, and the sum that becomes the current."""

    def __init__(self, controller: "Controller") -> None:
        self.due = Signal()
        self.enabled = Signal()
        self.velocity = Signal.like(controller.command_velocity, reset_less=True)
        self.acceleration = Signal.like(controller.command_acceleration, reset_less=True)
        # First the position error, then the sum.
        self.total = Signal(signed(controller._form.total_width), reset_less=True)


class _Steps:
    """Holds the step of a product: a word is loaded, less is taken from it, it is multiplied, and stored."""

    def __init__(self, form: ControlForm) -> None:
        self.term = Signal(Term)
        self.again = Signal()  # the next term begins
        self.load = Signal()
        self.subtract = Signal()
        self.start = Signal()
        self.stored = Signal()
        self.finish = Signal()  # the sum is held within few bits
        self.limit = Signal()  # and then within the limit
        self.word = Signal(signed(form.word_width), reset_less=True)


class Controller(Box):
    """Forms the products of `ControlForm` one by one at each control tick, and the current from them.

    All inputs but `n` and `current_sum` are taken with `tick`; these hold until `clear`. Every run takes the same time,
    whether there has been an update or not.

    Latency: `valid` is high `LoopSpec.latency` clocks after `tick`. The next `tick` may come a clock later.
    """

    def __init__(self, form: ControlForm, multiplier: str = "serial") -> None:
        self._form, self._multiplier = form, multiplier
        current = signed(signed_width(form.current_limit))
        gains = {}
        if form.gain_bits:
            gains = dict.fromkeys(GAIN_PORTS.values(), In(form.gain_bits))
            gains["current_limit"] = In(form.current_limit.bit_length())
        super().__init__(
            tick=In(1),
            due=In(1),  # there is an update: y and w are to be changed
            held=In(signed(form.velocity_width)),
            position=In(signed(form.position_width)),
            enable=In(1),
            command_position=In(signed(form.position_width + form.position_bits)),
            command_velocity=In(signed(form.command_width)),
            command_acceleration=In(signed(form.acceleration_width)),
            n=In(range(form.longest + 1)),
            current_sum=In(signed(signed_width(form.most_sum))),  # ΣI
            clear=Out(1),  # one clock: the update has been used
            valid=Out(1),  # one clock: `current` is that of this control tick
            current=Out(current),
            saturated=Out(1),
            y=Out(signed(signed_width(form.most_y))),  # in step with `valid`
            w=Out(signed(signed_width(form.most_w))),
            **gains,
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        names = ("product.product", "product.factor", "product.left", "word")
        return (IdleProduct(*names),) if self._multiplier == "serial" else ()

    def build(self, m: Module) -> None:
        taken, steps = _Taken(self), _Steps(self._form)
        step = self._multiply(m, steps)
        self._sequence(m, steps)
        self._load(m, taken, steps)
        self._take(m, taken)
        with m.If(steps.stored):
            m.d.sync += steps.term.eq(steps.term + 1)
        self._store(m, steps, step, taken)
        with m.If(steps.finish):
            m.d.sync += steps.term.eq(0)
        self._finish(m, taken, steps)

    def _multiply(self, m: Module, steps: "_Steps") -> Value:
        """Form a product of word and coefficient; return it, or the word where there is no filter."""
        form = self._form
        box = SerialProduct if self._multiplier == "serial" else ParallelProduct
        m.submodules.product = product = box(form.word_width, form.factor_bits)
        m.d.comb += [
            steps.load.eq(self.tick | steps.again),
            product.start.eq(steps.start),
            product.word.eq(steps.word),
            product.factor.eq(self._factor(m, steps.term, steps.load)),
            steps.stored.eq(product.done),
        ]
        m.d.sync += steps.start.eq(steps.subtract)
        if Term.FILTER in form.terms:
            return product.product
        skipped = Signal()
        m.d.sync += [
            skipped.eq(steps.subtract & (steps.term == Term.FILTER)),
            steps.start.eq(steps.subtract & (steps.term != Term.FILTER)),
        ]
        m.d.comb += steps.stored.eq(product.done | skipped)
        return Mux(skipped, steps.word, product.product)

    def _sequence(self, m: Module, steps: "_Steps") -> None:
        """Go from step to step, and from term to term."""
        last = max(Term)
        m.d.sync += [
            steps.subtract.eq(steps.load),
            steps.again.eq(steps.stored & (steps.term != last)),
            steps.finish.eq(steps.stored & (steps.term == last)),
            steps.limit.eq(steps.finish),
            self.valid.eq(steps.limit),
        ]

    def _load(self, m: Module, taken: "_Taken", steps: "_Steps") -> None:
        """Load the word of a term, and a clock later take from it what is to be taken."""
        less = {term: Signal(name=f"less_{term.name.lower()}") for term in Term if term.less_y}
        m.d.sync += [chosen.eq(steps.term == term) for term, chosen in less.items()]
        y = reduce(or_, (Mux(chosen, self.y << self._shift(term), 0) for term, chosen in less.items()))
        loaded = self._word(m, steps.term, taken)
        with m.If(steps.load):
            m.d.sync += steps.word.eq(loaded)
        with m.Elif(steps.subtract):
            m.d.sync += steps.word.eq(steps.word - y)

    def _take(self, m: Module, taken: "_Taken") -> None:
        """Take the inputs with a tick; the position error wraps as positions do."""
        with m.If(self.tick):
            difference = self.command_position - (self.position << self._form.position_bits)
            m.d.sync += [
                taken.due.eq(self.due),
                taken.enabled.eq(self.enable),
                taken.velocity.eq(self.command_velocity),
                taken.acceleration.eq(self.command_acceleration),
                taken.total.eq(difference[: len(self.command_position)].as_signed()),
            ]

    def _finish(self, m: Module, taken: "_Taken", steps: "_Steps") -> None:
        """Hold the sum within as many bits as the limit has, without a carry; then only these are to be compared."""
        form = self._form
        wanted = Signal(signed(form.total_width - GUARD_BITS))
        m.d.comb += wanted.eq(taken.total >> GUARD_BITS)
        held, outside = saturate(m, wanted, (1 << form.current_limit.bit_length()) - 1)
        short = Signal.like(held, reset_less=True)
        beyond = Signal(reset_less=True)
        m.d.sync += [short.eq(held), beyond.eq(outside)]
        limited, changed = self._limited(m, short) if form.gain_bits else saturate(m, short, form.current_limit)
        m.d.comb += self.clear.eq(steps.stored & (steps.term == Term.CURRENT) & taken.due)
        with m.If(steps.limit):
            m.d.sync += [
                self.current.eq(Mux(taken.enabled, limited, 0)),
                self.saturated.eq((beyond | changed) & taken.enabled),
            ]

    def _limited(self, m: Module, value: Signal) -> tuple[Signal, Signal]:
        """Return what `saturate` gives, with the limit that is an input."""
        form = self._form
        limit = Signal(range(form.current_limit + 1), name="most")
        m.d.sync += limit.eq(Mux(self.current_limit > form.current_limit, form.current_limit, self.current_limit))
        limited = Signal.like(value, name="limited")
        changed = Signal()
        above, below = value > limit, value < -limit
        m.d.comb += [changed.eq(above | below), limited.eq(Mux(above, limit, Mux(below, -limit, value)))]
        return limited, changed

    def _factor(self, m: Module, term: Signal, load: Value) -> Value:
        """Return the coefficient of a term, valid in the clock after `load`."""
        form = self._form
        values: dict[Term, ValueLike] = {one: each.values[0] for one, each in form.terms.items()}
        if form.gain_bits:
            gains = by_name(self, GAIN_PORTS.values())
            values |= {one: gains[GAIN_PORTS[one]] << form.gain_shift for one in GAINS}
        if form.longest > 1:
            tabled = self._tabled(m, term, load)
            values |= dict.fromkeys((one for one in form.terms if one.tabled), tabled)
        factor = Signal(form.factor_bits)
        _choose(m, term, values, factor)
        return factor

    def _tabled(self, m: Module, term: Signal, load: Value) -> Value:
        """Return a coefficient that depends on n: equal tables are one."""
        form = self._form
        of_term = {one: form.terms[one].values for one in Term if one.tabled and one in form.terms}
        places = {values: place for place, values in enumerate(dict.fromkeys(of_term.values()))}
        # An entry for n = 0, which there is not, makes the address n itself.
        init = [entry for values in places for entry in (0, *values)]
        m.submodules.table = table = Memory(shape=form.factor_bits, depth=len(init), init=init)
        read = table.read_port()
        which = Signal(range(len(places)))
        _choose(m, term, {one: places[values] for one, values in of_term.items()}, which)
        m.d.comb += [read.addr.eq(Cat(self.n, which)), read.en.eq(load)]
        return read.data

    def _word(self, m: Module, term: Signal, taken: "_Taken") -> Value:
        """Return what a term multiplies, or what y is still to be taken from."""
        form = self._form
        held, _ = saturate(m, taken.total, form.most_error)
        error = Signal.like(held, reset_less=True)
        m.d.sync += error.eq(held)
        fine = form.extra_bits
        words = {
            "held": self.held << fine,
            "w": self.w,
            "current_sum": self.current_sum,
            "error": error,
            "velocity": taken.velocity << (fine - form.command_bits),
            "acceleration": taken.acceleration,
        }
        word = Signal(signed(form.word_width), name="loaded")
        _choose(m, term, {one: words[one.word] << self._shift(one) for one in Term}, word)
        return word

    def _shift(self, term: Term) -> int:
        return self._form.terms[term].shift if term in self._form.terms else 0

    def _store(self, m: Module, steps: "_Steps", step: Value, taken: "_Taken") -> None:
        """Add a product to what it belongs to."""
        term, stored, due, total = steps.term, steps.stored, taken.due, taken.total
        (into_y,), into_w, (plus_w,) = Term.into("y"), Term.into("w", "-w"), Term.into("w")
        # Where it goes is in registers: the term has been the same for some clocks.
        to_y = Signal()
        to_w = Signal()
        minus = Signal()
        first = Signal()
        m.d.sync += [
            to_y.eq(term == into_y),
            to_w.eq(term <= max(into_w)),
            minus.eq(term != plus_w),
            first.eq(term == min(Term.into("total"))),
        ]
        with m.If(stored & due & to_y):
            m.d.sync += self.y.eq(self.y + step)
        with m.If(stored & due & to_w):
            # With one adder: w − step is w + ~step + 1, and the 1 comes from an additional bit at its end.
            term_of_w = Cat(minus, step ^ minus.replicate(len(step))).as_signed()
            m.d.sync += self.w.eq((Cat(1, self.w).as_signed() + term_of_w) >> 1)
        with m.If(stored & ~to_w):
            # The first one rounds the sum.
            m.d.sync += total.eq(Mux(first, 1 << (GUARD_BITS - 1), total) + step)
