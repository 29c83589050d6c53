"""The machine of the tracking method: one adder, one accumulator, a memory, a program, and a unit."""

from collections.abc import Iterable, Sequence
from functools import reduce
from operator import and_, or_

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleBox
from tachometry.hdl.front_end.sampling_clock import state_after, states_of
from tachometry.hdl.methods.block_unit import BlockUnit
from tachometry.hdl.methods.serial_unit import SerialUnit
from tachometry.hdl.methods.track_instruction import encoded, layout_of
from tachometry.hdl.wires.commented_memory import CommentedMemory
from tachometry.hdl.wires.ports import Box, by_name, only_if
from tachometry.spec.formats.tracking import PLACE_BITS, WIDTH
from tachometry.spec.formats.tracking_code import ADDRESS_BITS, FIRST_INPUT, INPUTS, OUTPUTS, Program
from tachometry.spec.formats.tracking_instruction import CHOSEN, EARLY, OFFSETS, Jump
from tachometry.spec.formats.tracking_sampled import EXCHANGED, OFFSET_BITS
from tachometry.spec.formats.tracking_units import BLOCK, STAGES, Start

_PLACES_BITS = PLACE_BITS - 1 - 6  # twice the places, over 64
EXCHANGE = {
    **dict(zip(EXCHANGED, (In(1), In(3), In(signed(OFFSET_BITS))), strict=True)),
    "offset_read": Out(signed(OFFSET_BITS)),
}


class TrackMachine(Box):
    """Runs the program once for every tick; `spec.formats.tracking_code` defines each instruction.

    An instruction is fetched, and executed three clocks later: there is a register in front of the memory of words and
    one behind it. All wait while one needs the serial unit, and that is busy.

    Where a word is read at a time, cells are saved: the sum is cleared where the next instruction does not take it, and
    inputs are cleared where they are not read, as a reset of registers takes no cell. So the unit and the outputs take
    what the adder gives, and not the sum a clock later.

    Further axes have the machine in turn; their programs differ in their words alone.
    """

    def __init__(self, program: Program, *others: Program) -> None:
        self._program = program
        self._axes = (program, *others)
        self._two = program.times.ports > 1  # words are read at a time
        form = program.form
        self.unit = (BlockUnit if program.times == BLOCK else SerialUnit)(program)
        # All axes have begun once before the first begins again. Inputs are those of the tick, and hold until the next.
        # Outputs are those of this tick `program.clocks - 1` after `begin`.
        super().__init__(
            {
                **({"axis": In(range(len(self._axes)))} if others else {}),  # its words, from `begin` to the end
                "begin": In(1),
                "number": In(form.number_bits),
                "times": In(form.times_bits),
                "places": In(signed(form.placed_bits)),
                "last": In(range(form.most_last + 1)),
                "moved": In(signed(form.moved_bits)),
                "length": In(range(form.longest_tick + 1)),
                "kind": In(form.kind_bits),  # of the last count's edge
                "end": In(form.kind_bits),  # kind of the position at the end
                "down": In(1),  # the last count went backward
                **only_if(form.exchanges, **EXCHANGE),
                **dict.fromkeys(program.outputs, Out(signed(WIDTH))),
                "standstill": Out(1),  # of a tick without a count
            }
        )
        self._store_program()
        self._declare()

    def _store_program(self) -> None:
        program = self._program
        self._layout = layout = layout_of(program)
        # Nothing needs them to be in order, so a shift register with feedback takes the place of a counter.
        self._states = at = states_of(len(program.code.instructions).bit_length())
        code = dict(zip(at, enumerate(program.code.instructions), strict=False))
        places = [code.get(place) for place in range(len(at) + 1)]
        texts = [f"instruction {one[0]}: {one[1].text}" if one else "" for one in places]
        words = [encoded(program, one[1], layout, at) if one else 0 for one in places]
        self._rom = CommentedMemory(texts, shape=layout.size, depth=len(places), init=words)
        named = {place: name for name, place in program.addresses.items()}
        self._words = CommentedMemory(
            [named.get(place % (1 << ADDRESS_BITS), "") for place in range(len(self._axes) << ADDRESS_BITS)],
            shape=signed(WIDTH),
            depth=1 << ((len(self._axes) - 1).bit_length() + ADDRESS_BITS),
            init=self._contents(),
            attrs={"no_rw_check": 1},  # the program reads no word in the clock in which it is written
        )
        self._fetch = self._rom.read_port()
        self._read = self._words.read_port()
        self._write = self._words.write_port()

    def _declare(self) -> None:
        # Fetch, read, execute.
        self.first = Signal(init=1)  # the words are to be reset
        self.pc = Signal(range(len(self._states) + 1), init=self._state("reset"))
        self.place = Signal.like(self.pc)  # of the instruction that is fetched
        self.fetched = Signal()
        self.active = Signal()  # `now` is executed
        self.now = Signal(self._layout, reset_less=True)
        self.hold = Signal()  # all wait for the unit
        self.go = Signal()
        self.taken = Signal()  # a jump is
        self.ahead = Signal(self._layout, reset_less=True)  # the instruction before `fetched`, of the quick machine
        self.early = Signal()  # it jumps, as no sum decides
        self.stop = Signal()
        self.selects = Signal()  # the condition is one to store the sum, and not to jump
        self.passed = Signal()  # it is not met
        # The adder.
        self.sum_ = Signal(signed(WIDTH), reset_less=True)
        self.sign = Signal()  # that is kept
        self.left = Signal(signed(WIDTH))
        self.right = Signal(signed(WIDTH))
        self.total = Signal(signed(WIDTH))
        self.minus = Signal()
        self.carry = Signal()
        self.used = Signal(attrs={"keep": "true"})  # the sum is the first term
        self.from_unit = Signal()  # and the result of the unit is the second
        self.negative = self.sum_[-1]
        self.word = Signal(signed(WIDTH), name="word", reset_less=True)
        self.made = self.sum_  # the unit and the outputs take it
        if not self._two:
            self.negative = Signal(name="negative")
            self.made = self.total

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The serial unit: while it works, all else waits for it, or rests."""
        busy = ("unit.reads", "unit.adds", "unit.shifts")
        return (IdleBox("unit", busy),) if isinstance(self.unit, SerialUnit) else ()

    def build(self, m: Module) -> None:
        m.submodules.unit = self.unit
        m.submodules.program = self._rom
        m.submodules.words = self._words
        fetched = data.View(self._layout, self._fetch.data)
        added = self._read_words(m, fetched)
        earlier, coming, follows = self._execute(m, fetched)
        self._go_on(m)
        choice, below = coming.left, Mux(self.go, self.total[-1], self.negative)
        if self._two:
            choice, below = self.now.left, self.negative
        least_or_sum, most_or_sum = Value.cast(choice)
        m.d.comb += self.used.eq(Mux(below, least_or_sum, most_or_sum))
        # Where no word is meant one is read that is 0, and so is an input where none is; it is a first term.
        if self._two:
            left = Mux(self.used, self.sum_, 0) | self._take_words(m, coming, added)
            minus = self.now.subtract ^ (self.now.by_sign & self.sign)
            m.d.comb += self.unit.coming.eq(self.total)
        else:
            left, minus = self.sum_, self._take_word(m, coming, earlier, below)
        self._add(m, left, minus, follows)
        self._show(m)
        self._begin(m)
        self._jump(m)
        if self._program.form.exchanges:
            self._exchange(m)

    def _state(self, label: str) -> int:
        return self._states[self._program.code.labels[label]]

    def _read_words(self, m: Module, fetched: data.View) -> Value:
        """Fetch an instruction, and read the words of the one before; return the second one."""
        following: Value = self.pc
        if self._two:
            following = Mux(self.early, Cat(self.ahead.how, self.ahead.store), following)
        if self._two:  # what the block RAM gives comes late
            address = self._at(self._chosen(m, self._held(m, fetched.word)))
        else:
            address = self._held(m, self._at(self._chosen(m, fetched.word)))
        m.d.comb += [
            self.place.eq(Mux(self.taken, Cat(self.now.how, self.now.store), following)),
            self._fetch.addr.eq(self.place),
            self._fetch.en.eq(~self.hold),
            self._read.addr.eq(address),
            self._read.en.eq(~self.hold),
            self.go.eq(self.active & ~self.hold),
        ]
        if not self._two:
            return C(0, signed(WIDTH))
        second = self._words.read_port()
        m.d.comb += [second.addr.eq(self._at(self._held(m, fetched.first))), second.en.eq(~self.hold)]
        return second.data

    def _held(self, m: Module, address: Value) -> Value:
        """Return what addresses a word, a clock later."""
        held = Signal(len(address), name="held", reset_less=True)
        m.d.sync += held.eq(Mux(self.hold, held, address))
        return held

    def _execute(self, m: Module, fetched: data.View) -> tuple[data.View, data.View, Value]:
        """Move instructions on to `now`; return the two before it, and whether the latter follows."""
        coming, valid = fetched, self.fetched & ~self.early if self._two else self.fetched
        earlier = coming
        for stage in range(STAGES - 1):
            earlier = coming
            following = (
                self.ahead if self._two and not stage else Signal(self._layout, name="following", reset_less=True)
            )
            follows = Signal()
            with m.If(~self.hold):
                m.d.sync += [following.eq(coming), follows.eq(valid & ~self.taken & ~self.stop)]
            if following is self.ahead:
                m.d.comb += self.early.eq(follows & self._is_met(following.jump, EARLY))
            coming, valid = following, follows
        is_next = valid & ~self.taken & ~self.stop
        with m.If(~self.hold):
            m.d.sync += [self.now.eq(coming), self.active.eq(is_next)]
        return earlier, coming, is_next

    def _go_on(self, m: Module) -> None:
        """Go on to the next instruction, and stop at an end; the first program of each axis resets its words."""
        with m.If((self.fetched & ~self.hold) | self.begin):
            m.d.sync += self.pc.eq(state_after(self.place))
        with m.If(self.stop):
            begin = Mux(self.first & ~self._is_last(), self._state("reset"), self._state("tick"))
            m.d.sync += [self.fetched.eq(0), self.pc.eq(begin)]
            with m.If(self._is_last()):
                m.d.sync += self.first.eq(0)
        with m.If(self.begin):
            m.d.sync += self.fetched.eq(1)

    def _take_words(self, m: Module, coming: data.View, added: Value) -> Value:
        """Take both words of an instruction, or an input in the place of the second, and return that one."""
        second = Signal(signed(WIDTH), reset_less=True)
        given = Signal(signed(WIDTH))
        with m.If(coming.first[3:] == FIRST_INPUT >> 3):
            inputs = Array((*self._inputs(), C(0)))  # as many as its index selects
            m.d.comb += given.eq(inputs[coming.first[:3]])
        with m.If(~self.hold):
            m.d.sync += [self.from_unit.eq(coming.from_unit), self.word.eq(self._read.data), second.eq(added | given)]
        return second

    def _take_word(self, m: Module, coming: data.View, earlier: data.View, below: Value) -> Value:
        """Take the word or input of an instruction; return whether it is subtracted."""
        inputs = self._inputs()
        given = [Signal.like(value, reset_less=True, name=name) for name, value in zip(INPUTS, inputs, strict=True)]
        with m.If(~self.hold):
            word = reduce(or_, given, self._read.data)
            m.d.sync += [self.from_unit.eq(coming.from_unit), self.word.eq(word)]
            m.d.sync += Cat(given).eq(Cat(inputs))
        for number, one in enumerate(given):
            with m.If(~self.hold & (earlier.word != FIRST_INPUT + number)):
                m.d.sync += one.eq(0)
        kept = Mux(self.go & self.now.keep, self.total[-1], self.sign)
        following_minus = Signal()
        with m.If(~self.hold):
            m.d.sync += following_minus.eq(coming.subtract ^ (coming.by_sign & kept))
        m.d.sync += self.negative.eq(below)
        return following_minus

    def _add(self, m: Module, left: Value, minus: Value, follows: Value) -> None:
        """Add or subtract a term, and store the sum; one that the next instruction does not take is cleared."""
        flipped = (self.right ^ self.minus.replicate(WIDTH))[:WIDTH]
        m.d.comb += [
            self.left.eq(left),
            self.right.eq(self.word | Mux(self.from_unit, self.unit.result, 0)),
            self.minus.eq(minus),
            self.carry.eq(self.minus ^ (self.from_unit & self.unit.up)),
            self.total.eq((Cat(C(1, 1), self.left).as_signed() + Cat(self.carry, flipped).as_signed()) >> 1),
        ]
        keeps, writes = self.go & self.now.keep, self.go & self.now.writes
        if self._two:
            m.d.comb += self.selects.eq(self.now.writes & Value.cast(self.now.jump).any())
            keeps, writes = keeps & ~self.passed, writes & ~self.passed
            with m.If(self.go & ~self.selects):
                m.d.sync += self.sum_.eq(self.total)
        else:
            with m.If(self.go):
                m.d.sync += self.sum_.eq(self.total)
            with m.If(~self.hold & follows & ~self.used):
                m.d.sync += self.sum_.eq(0)
        with m.If(keeps):
            m.d.sync += self.sign.eq(self.total[-1])
        m.d.comb += [
            self._write.en.eq(writes),
            self._write.addr.eq(self._at(self._stored(self.now.store))),
            self._write.data.eq(self.total),
        ]

    def _show(self, m: Module) -> None:
        """Show the sum at an output."""
        shows = Signal(3)
        domain = m.d.sync if self._two else m.d.comb
        domain += shows.eq(Mux(self.go, self.now.output, 0))
        if self._program.form.waits:  # of a tick with a read: that waits
            with m.If(self.begin):
                m.d.sync += self.standstill.eq(0)
        for name, port in by_name(self, self._program.outputs).items():
            held = port
            if self._two and name == "velocity":  # it is there a clock before it is held
                held = Signal.like(port)
                m.d.comb += port.eq(Mux(shows == OUTPUTS.index(name), self.made, held))
            with m.If(shows == OUTPUTS.index(name)):
                m.d.sync += held.eq(~self.made[-1] if name == "standstill" else self.made)

    def _begin(self, m: Module) -> None:
        """Begin an operation of the unit, or wait for it."""
        unit, now = self.unit, self.now
        if not self._two:
            waits = reduce(and_, (now.start != start for start in Start if not self._program.times.of(start)))
            m.d.comb += self.hold.eq(self.active & (self.from_unit | waits) & unit.busy)
        m.d.comb += [
            unit.begin.eq(self.begin),
            unit.start.eq(Mux(self.go, now.start, Start.NONE)),
            unit.how.eq(now.how),
            unit.sum.eq(self.made),
        ]

    def _exchange(self, m: Module) -> None:
        """Write an offset as the program begins, which cannot do so yet; then show one, until the next begin."""
        first = self._program.addresses[OFFSETS[0]] >> 3
        given = by_name(self, EXCHANGE)
        entry = self._words.read_port()
        begun = Signal()
        m.d.sync += begun.eq(self.begin)
        at = Cat(given["offset_at"], C(first, ADDRESS_BITS - 3))
        m.d.comb += [entry.addr.eq(at), entry.en.eq(begun), given["offset_read"].eq(entry.data)]
        with m.If(given["offset_written"]):
            m.d.comb += [self._write.en.eq(1), self._write.addr.eq(at), self._write.data.eq(given["offset_value"])]

    def _jump(self, m: Module) -> None:
        """Jump if the condition is met."""
        if self._two:
            is_met = self._is_met(self.now.jump, tuple({*Jump} - {*EARLY}))
            m.d.comb += self.passed.eq(self.selects & ~is_met)
            is_met &= ~self.selects
        else:
            is_met = self._is_met(self.now.jump, tuple(Jump))
        m.d.comb += [
            self.taken.eq(self.go & is_met),
            self.stop.eq(self.go & (self.now.jump == Jump.END)),
        ]

    def _is_met(self, condition: Value, among: Sequence[Jump]) -> Value:
        """Return whether a condition is met that is among some."""
        empty, one = ~self.number.any(), self.number == 1
        met = {
            Jump.ALWAYS: C(1, 1),
            Jump.NEG: self.negative,
            Jump.POS: ~self.negative,
            Jump.EMPTY: empty,
            Jump.ONE: one,
        }
        return Cat(met.get(jump, C(0, 1)) if jump in among else C(0, 1) for jump in Jump).bit_select(condition, 1)

    def _contents(self) -> list[int]:
        """Return the first words of all axes."""
        return [
            word for one in self._axes for word in (*one.words.values(), *[0] * ((1 << ADDRESS_BITS) - len(one.words)))
        ]

    def _at(self, word: Value) -> Value:
        """Return the address of a word of the axis that has its turn."""
        return Cat(word, self.axis) if len(self._axes) > 1 else word

    def _is_last(self) -> Value:
        return self.axis == len(self._axes) - 1 if len(self._axes) > 1 else C(1, 1)

    def _inputs(self) -> list[Value]:
        """Return the inputs of the tick as words."""
        t, moved = self._program.form.time_bits, self._program.form.moved_shift
        places = _PLACES_BITS - self._program.form.fine_bits
        shifts = {"counts": PLACE_BITS, "places": places, "times": t, "last": t, "moved": moved, "length": t}
        ports = by_name(self, (name for name in INPUTS if name != "counts")) | {"counts": self.number}
        return [ports[name] << shifts.get(name, 0) for name in INPUTS]

    def _stored(self, word: Value) -> Value:
        """Return the address of a word that is stored, which may be that of the last count's edge, or the next."""
        kind = Mux(word[0], self.end, self.kind) if self._program.form.sampled else Cat(self.kind, word[2])
        return self._offset(word, kind)

    def _chosen(self, m: Module, word: Value) -> Value:
        """Return the address of a word that is read, which may be one that the tick chooses among the offsets."""
        if self._program.form.sampled:
            return self._stored(word)
        chosen = Signal(ADDRESS_BITS)
        back = Cat(C(1, 1), ~self.down)  # −1; 1 if it went backward
        ways = {"o@down": C(-1, 2), "o@m2": back, "o@m3": C(2, 2)}
        least = {"o@m1": 1, "o@m2": 2, "o@m3": 3}  # of n mod 4
        names = (*CHOSEN, *[""] * (8 - len(CHOSEN)))

        def of_name(choices: Iterable[Value]) -> Value:
            return Array(choices)[word[:3]]

        of_end = of_name(C(name in ("o@up", "o@down"), 1) for name in names)
        kind = Mux(of_end, self.end, self.kind) + of_name(ways.get(name, C(0, 2)) for name in names)
        none = self.number[:2] < of_name(C(least.get(name, 0), 2) for name in names)
        m.d.comb += chosen.eq(self._offset(word, Mux(none, 4, kind[:2])))
        return chosen

    @staticmethod
    def _offset(word: Value, place: Value) -> Value:
        """Return the address of a word, or that of the one at a place among the offsets, and the zero behind them."""
        special = word[3:ADDRESS_BITS].all()
        return Cat(Mux(special, place, word[:3]), word[3 : ADDRESS_BITS - 1], word[ADDRESS_BITS - 1] & ~special)
