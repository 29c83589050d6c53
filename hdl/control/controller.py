"""Disturbance observer and controller: one multiplier, and a product after the other."""

from amaranth import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.control.product import ParallelProduct, SerialProduct
from tachometry.spec.control.form import GUARD_BITS, POSITION_FRAC_BITS, TABLED, ControlForm, Term
from tachometry.spec.units import signed_width


class Controller(wiring.Component):
    """Forms the products of `ControlForm` one by one at each control tick, and the current from them.

    All inputs but `n` and `total` are taken with `tick`; these hold until `clear`. Every run takes the same time,
    whether there has been an update or not.

    Latency: `valid` is high `LoopSpec.latency` clocks after `tick`. The next `tick` may come a clock later.

    Parameters
    ----------
    form : ControlForm
    multiplier : str
        `serial` or `parallel`.

    Members
    -------
    tick : In(1)
    due : In(1)
        There is an update: y and w are to be changed.
    held, position : In(signed)
    enable : In(1)
    command_position, command_velocity, command_acceleration : In(signed)
    n : In(range(longest + 1))
    total : In(signed)
        ΣI.
    clear : Out(1)
        One clock: the update has been used.
    valid : Out(1)
        One clock: `current` is that of this control tick.
    current : Out(signed)
    saturated : Out(1)
    y, w : Out(signed)
        In step with `valid`.
    """

    def __init__(self, form: ControlForm, multiplier: str = "serial") -> None:
        self._form = form
        self._multiplier = multiplier
        current = signed(signed_width(form.current_limit))
        super().__init__(
            {
                "tick": In(1),
                "due": In(1),
                "held": In(signed(form.velocity_width)),
                "position": In(signed(form.position_width)),
                "enable": In(1),
                "command_position": In(signed(form.position_width + POSITION_FRAC_BITS)),
                "command_velocity": In(signed(form.command_width)),
                "command_acceleration": In(signed(form.acceleration_width)),
                "n": In(range(form.longest + 1)),
                "total": In(signed(signed_width(form.most_sum))),
                "clear": Out(1),
                "valid": Out(1),
                "current": Out(current),
                "saturated": Out(1),
                "y": Out(signed(signed_width(form.most_y))),
                "w": Out(signed(signed_width(form.most_w))),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        form = self._form
        # What is taken with a tick.
        due = Signal()
        enabled = Signal()
        velocity = Signal.like(self.command_velocity, reset_less=True)
        acceleration = Signal.like(self.command_acceleration, reset_less=True)
        # First the position error, which wraps as positions do, then the sum that becomes the current.
        total = Signal(signed(form.total_width), reset_less=True)

        term = Signal(Term)
        load = Signal()
        again = Signal()
        start = Signal()
        stored = Signal()
        finish = Signal()
        word = Signal(signed(form.word_width), reset_less=True)
        box = SerialProduct if self._multiplier == "serial" else ParallelProduct
        m.submodules.product = product = box(form.word_width, form.factor_bits)
        unfiltered = Term.FILTER not in form.terms
        m.d.comb += [
            load.eq(self.tick | again),
            product.start.eq(start),
            product.word.eq(word),
            product.factor.eq(self._factor(m, term, load)),
            stored.eq(product.done),
        ]
        step: Value = product.product
        if unfiltered:
            skipped = Signal()
            m.d.sync += skipped.eq(self.tick)
            m.d.comb += stored.eq(product.done | skipped)
            step = Mux(skipped, word, product.product)
            m.d.sync += start.eq(again)
        else:
            m.d.sync += start.eq(load)
        m.d.sync += [again.eq(stored & (term != Term.DISTURBANCE)), finish.eq(stored & (term == Term.DISTURBANCE))]
        with m.If(load):
            m.d.sync += word.eq(self._word(m, term, total, velocity, acceleration))
        with m.If(self.tick):
            difference = self.command_position - (self.position << POSITION_FRAC_BITS)
            m.d.sync += [
                due.eq(self.due),
                enabled.eq(self.enable),
                velocity.eq(self.command_velocity),
                acceleration.eq(self.command_acceleration),
                total.eq(difference[: len(self.command_position)].as_signed()),
            ]
        with m.If(stored):
            m.d.sync += term.eq(term + 1)
            self._store(m, term, step, due, total)
        with m.If(finish):
            m.d.sync += term.eq(0)

        wanted = Signal(signed(form.total_width - GUARD_BITS))
        m.d.comb += wanted.eq(total >> GUARD_BITS)
        # First within as many bits as the limit has, without a carry; then there are only these to be compared.
        short, beyond = saturate(m, wanted, (1 << form.current_limit.bit_length()) - 1)
        held, changed = saturate(m, short, form.current_limit)
        m.d.comb += self.clear.eq(stored & (term == Term.CURRENT) & due)
        m.d.sync += self.valid.eq(finish)
        with m.If(finish):
            m.d.sync += [self.current.eq(Mux(enabled, held, 0)), self.saturated.eq((beyond | changed) & enabled)]
        return m

    def _factor(self, m: Module, term: Signal, load: Value) -> Value:
        """The coefficient of a term, valid in the clock after `load`."""
        form = self._form
        factor = Signal(form.factor_bits)
        fixed = {one: found.values for one, found in form.terms.items() if len(found.values) == 1}
        with m.Switch(term):
            for one, (value,) in fixed.items():
                with m.Case(one):
                    m.d.comb += factor.eq(value)
            if form.longest > 1:
                with m.Default():
                    m.d.comb += factor.eq(self._tabled(m, term, load))
        return factor

    def _tabled(self, m: Module, term: Signal, load: Value) -> Value:
        """A coefficient that depends on n: equal tables are one."""
        form = self._form
        places: dict[tuple[int, ...], int] = {}
        of_term = {one: form.terms[one].values for one in TABLED if one in form.terms}
        for values in of_term.values():
            places.setdefault(values, len(places))
        # An entry for n = 0, which there is not, makes the address n itself.
        init = [entry for values in places for entry in (0, *values)]
        m.submodules.table = table = Memory(shape=form.factor_bits, depth=len(init), init=init)
        read = table.read_port()
        which = Signal(range(len(places)))
        with m.Switch(term):
            for one, values in of_term.items():
                with m.Case(one):
                    m.d.comb += which.eq(places[values])
        m.d.comb += [read.addr.eq(Cat(self.n, which)), read.en.eq(load)]
        return read.data

    def _word(self, m: Module, term: Signal, total: Signal, velocity: Signal, acceleration: Signal) -> Value:
        """What a term multiplies: a difference."""
        form = self._form
        error, _ = saturate(m, total, form.most_error)
        y, fine = self.y, form.extra_bits
        words: dict[Term, tuple[Value, Value | None]] = {
            Term.FILTER: (self.held << fine, y),
            Term.OBSERVER: (self.w, None),
            Term.CURRENT: (self.total, None),
            Term.POSITION: (error, None),
            Term.VELOCITY: (velocity << (fine - form.command_bits), y),
            Term.ACCELERATION: (acceleration, None),
            Term.DISTURBANCE: (self.w, None),
        }
        more = Signal(signed(form.word_width))
        less = Signal(signed(form.word_width))
        with m.Switch(term):
            for one, (first, second) in words.items():
                shift = form.terms[one].shift if one in form.terms else 0
                with m.Case(one):
                    m.d.comb += more.eq(first << shift)
                    if second is not None:
                        m.d.comb += less.eq(second << shift)
        return more - less

    def _store(self, m: Module, term: Signal, step: Value, due: Signal, total: Signal) -> None:
        """Add a product to what it belongs to."""
        # With one adder: w − step is w + ~step + 1, and the 1 comes from an additional bit at its end.
        less = term != Term.CURRENT
        w = (Cat(1, self.w).as_signed() + Cat(less, step ^ less.replicate(len(step))).as_signed()) >> 1
        with m.Switch(term):
            with m.Case(Term.FILTER), m.If(due):
                m.d.sync += [self.y.eq(self.y + step), self.w.eq(w)]
            with m.Case(Term.OBSERVER, Term.CURRENT), m.If(due):
                m.d.sync += self.w.eq(w)
            with m.Default():
                # The first one rounds the sum.
                m.d.sync += total.eq(Mux(term == Term.POSITION, 1 << (GUARD_BITS - 1), total) + step)
