"""The machine of the tracking method: one adder, one accumulator, a memory, a program, and a unit."""

from collections.abc import Iterable, Sequence
from functools import reduce
from operator import and_, or_

from amaranth import Array, C, Cat, Module, Mux, Shape, Signal, Value, signed
from amaranth.lib import data, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleBox
from tachometry.hdl.front_end.sampling_clock import state_after, states_of
from tachometry.hdl.methods.small_unit import SmallUnit
from tachometry.hdl.methods.track_unit import QuickUnit
from tachometry.spec.formats.tracking import PLACE_BITS, WIDTH
from tachometry.spec.formats.tracking_code import (
    ADDRESS_BITS,
    CHOSEN,
    FIRST_INPUT,
    HOW_BITS,
    INPUTS,
    OUTPUTS,
    Instruction,
    Jump,
    Left,
    Program,
)
from tachometry.spec.formats.tracking_units import QUICK, Start

_PLACES_BITS = PLACE_BITS - 1 - 6  # twice the places, over 64


def _layout(program: Program) -> data.StructLayout:
    """Return an instruction. A jump has its target where others have how, and where the sum goes."""
    target = len(program.code.instructions).bit_length()
    store = max(ADDRESS_BITS, target - HOW_BITS)
    return data.StructLayout(
        {
            "left": Left,
            "from_unit": 1,
            "word": ADDRESS_BITS,
            **({"first": ADDRESS_BITS} if program.times.ports > 1 else {}),
            "subtract": 1,
            "by_sign": 1,
            "keep": 1,
            "writes": 1,
            "start": Start,
            "output": 3,
            "jump": Jump,
            "how": HOW_BITS,
            "store": store,
        }
    )


def _encoded(program: Program, one: Instruction, layout: data.StructLayout, at: Sequence[int]) -> int:
    """Return an instruction as the program memory holds it; `at` is where each one stands."""
    where, nothing = program.addresses, FIRST_INPUT + len(INPUTS)
    inputs = {f"${name}": FIRST_INPUT + number for number, name in enumerate(INPUTS)}
    first, word = ({**where, **inputs, "": nothing, "~": nothing}[name] for name in (one.first, one.word))
    if one.first and program.times.ports == 1:
        word = first
    how, store = program.number(one), where[one.store]
    if one.target:
        target = at[program.code.labels[one.target]]
        how, store = target & ((1 << HOW_BITS) - 1), target >> HOW_BITS
    values = {
        "left": one.left,
        "from_unit": one.word == "~",
        "word": word,
        "first": first,
        "subtract": one.subtract,
        "by_sign": one.by_sign,
        "keep": one.keep,
        "writes": bool(one.store),
        "start": one.start,
        "output": OUTPUTS.index(one.output),
        "jump": one.jump,
        "how": how,
        "store": store,
    }
    coded, place = 0, 0
    for name, field in layout.members.items():
        coded |= int(values[name]) << place
        place += Shape.cast(field).width
    return coded


class TrackMachine(wiring.Component):
    """Runs the program once for every tick; `spec.formats.tracking_code` says what each instruction does.

    While an instruction is executed, the word of the next one is read, and the one behind that is fetched; with more
    stages, there is a register in front of the memory of words and one behind it. All wait while one needs the unit,
    and that is busy.

    Where a word is read at a time, cells are saved: the sum is cleared where the next instruction does not take it, and
    inputs are cleared where they are not read, as a reset of registers takes no cell. So the unit and the outputs take
    what the adder gives, and not the sum a clock later.

    Parameters
    ----------
    program : Program
    others : Program
        Of further axes, which have the machine in turn; they differ in their words alone.

    Members
    -------
    axis : In(range(axes))
        Only with other axes: whose words they are, from `begin` to the end. All have begun once before the first
        begins again.
    begin : In(1)
    number, times, places, last, moved, length : In
        What the tick had; they hold until the next, as all inputs do.
    kind, end, down : In
        Of the last count's edge; of the position at the end; whether the count went backward.
    velocity, position_fine, quality, acceleration : Out(signed)
    stalled : Out(1)
        Of a tick without a count. All are those of this tick `program.clocks - 1` after `begin`.
    """

    def __init__(self, program: Program, *others: Program) -> None:
        self._program = program
        self._axes = (program, *others)
        form = program.form
        self.unit = (QuickUnit if program.times == QUICK else SmallUnit)(program)
        super().__init__(
            {
                **({"axis": In(range(len(self._axes)))} if others else {}),
                "begin": In(1),
                "number": In(form.number_bits),
                "times": In(form.times_bits),
                "places": In(signed(form.places_bits)),
                "last": In(range(form.longest_tick)),
                "moved": In(signed(form.moved_bits)),
                "length": In(range(form.longest_tick + 1)),
                "kind": In(2),
                "end": In(2),
                "down": In(1),
                **dict.fromkeys(OUTPUTS[1:], Out(signed(WIDTH))),
                "stalled": Out(1),
            }
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The small unit: while it works, all else waits for it, or rests."""
        busy = ("unit.reads", "unit.adds", "unit.shifts")
        return (IdleBox("unit", busy),) if isinstance(self.unit, SmallUnit) else ()

    def elaborate(self, platform: object) -> Module:
        m = Module()
        program, code = self._program, self._program.code.instructions
        m.submodules.unit = unit = self.unit
        layout = _layout(program)
        # Nothing needs them to be in order, so a shift register with feedback takes the place of a counter.
        at = states_of(len(code).bit_length())
        held_at = {place: _encoded(program, one, layout, at) for place, one in zip(at, code, strict=False)}
        depth = len(at) + 1
        m.submodules.program = rom = Memory(
            shape=layout.size, depth=depth, init=[held_at.get(place, 0) for place in range(depth)]
        )
        m.submodules.words = words = Memory(
            shape=signed(WIDTH),
            depth=1 << ((len(self._axes) - 1).bit_length() + ADDRESS_BITS),
            init=self._contents(),
            attrs={"no_rw_check": 1},  # the program reads no word in the clock in which it is written
        )
        fetch = rom.read_port()
        read = words.read_port()
        write = words.write_port()
        # Fetch, read, execute.
        reset, tick = (at[program.code.labels[name]] for name in ("reset", "tick"))
        first = Signal(init=1)  # the words are to be reset
        pc = Signal(range(depth), init=reset)
        fetched = Signal()
        active = Signal()
        taken = Signal()
        stop = Signal()
        hold = Signal()
        go = Signal()
        now = Signal(layout, reset_less=True)
        place = Signal.like(pc)
        coming, valid = data.View(layout, fetch.data), fetched
        address, word = self._at(self._chosen(m, coming.word)), read.data
        two = program.times.ports > 1
        if not two:
            held = Signal.like(Value.cast(address), reset_less=True)
            word = Signal(signed(WIDTH), reset_less=True)
            m.d.sync += held.eq(Mux(hold, held, address))
            address = held
        m.d.comb += [
            place.eq(Mux(taken, Cat(now.how, now.store), pc)),
            fetch.addr.eq(place),
            fetch.en.eq(~hold),
            read.addr.eq(address),
            read.en.eq(~hold),
            go.eq(active & ~hold),
        ]
        added = C(0, signed(WIDTH))
        if two:
            second = words.read_port()
            m.d.comb += [second.addr.eq(self._at(coming.first)), second.en.eq(~hold)]
            added = second.data
        earlier = coming
        for _ in range(program.times.stages - 1):
            earlier = coming
            following = Signal(layout, reset_less=True)
            follows = Signal()
            with m.If(~hold):
                m.d.sync += [following.eq(coming), follows.eq(valid & ~taken & ~stop)]
            coming, valid = following, follows
        follows = valid & ~taken & ~stop
        with m.If(~hold):
            m.d.sync += [now.eq(coming), active.eq(follows)]
        with m.If((fetched & ~hold) | self.begin):
            m.d.sync += pc.eq(state_after(place))
        with m.If(stop):
            m.d.sync += [fetched.eq(0), pc.eq(Mux(first & ~self._is_last(), reset, tick))]
            with m.If(self._is_last()):
                m.d.sync += first.eq(0)
        with m.If(self.begin):
            m.d.sync += fetched.eq(1)
        # The adder.
        sum_ = Signal(signed(WIDTH), reset_less=True)
        negative = sum_[-1] if two else Signal(name="negative")
        sign = Signal()
        left = Signal(signed(WIDTH))
        right = Signal(signed(WIDTH))
        total = Signal(signed(WIDTH))
        minus = Signal()
        carry = Signal()
        choice, below = (now.left, negative) if two else (coming.left, Mux(go, total[-1], negative))
        least_or_sum, most_or_sum = Value.cast(choice)
        used = Signal(attrs={"keep": "true"})
        m.d.comb += used.eq(Mux(below, least_or_sum, most_or_sum))
        # Where no word is meant one is read that is 0, and so is an input where none is; it is a first term.
        from_unit = Signal()
        inputs = self._inputs()
        if two:
            given = Signal(signed(WIDTH), reset_less=True)
            with m.If(~hold):
                m.d.sync += [from_unit.eq(coming.from_unit), given.eq(0)]
                with m.If(coming.first[3:] == FIRST_INPUT >> 3):
                    m.d.sync += given.eq(Array((*inputs, C(0)))[coming.first[:3]])  # as many as its index tells
        else:
            given = [Signal.like(value, reset_less=True, name=name) for name, value in zip(INPUTS, inputs, strict=True)]
            with m.If(~hold):
                m.d.sync += [from_unit.eq(coming.from_unit), word.eq(reduce(or_, given, read.data))]
                m.d.sync += Cat(given).eq(Cat(inputs))
            for number, one in enumerate(given):
                with m.If(~hold & (earlier.word != FIRST_INPUT + number)):
                    m.d.sync += one.eq(0)
            kept = Mux(go & now.keep, total[-1], sign)
            following_minus = Signal()
            with m.If(~hold):
                m.d.sync += following_minus.eq(coming.subtract ^ (coming.by_sign & kept))
            m.d.sync += negative.eq(below)
        flipped = (right ^ minus.replicate(WIDTH))[:WIDTH]
        m.d.comb += [
            left.eq(Mux(used, sum_, 0) | given | added if two else sum_),
            right.eq(word | Mux(from_unit, unit.result, 0)),
            minus.eq(now.subtract ^ (now.by_sign & sign) if two else following_minus),
            carry.eq(minus ^ (from_unit & unit.up)),
            total.eq((Cat(C(1, 1), left).as_signed() + Cat(carry, flipped).as_signed()) >> 1),
        ]
        with m.If(go):
            m.d.sync += sum_.eq(total)
        if not two:
            with m.If(~hold & follows & ~used):
                m.d.sync += sum_.eq(0)
        with m.If(go & now.keep):
            m.d.sync += sign.eq(total[-1])
        m.d.comb += [
            write.en.eq(go & now.writes),
            write.addr.eq(self._at(self._stored(now.store))),
            write.data.eq(total),
        ]
        shows = Signal(3)
        domain = m.d.sync if two else m.d.comb
        domain += shows.eq(Mux(go, now.output, 0))
        made = sum_ if two else total
        for number, name in enumerate(OUTPUTS):
            if name:
                with m.If(shows == number):
                    m.d.sync += getattr(self, name).eq(~made[-1] if name == "stalled" else made)
        # The unit.
        uses = from_unit | reduce(and_, (now.start != start for start in Start if not program.times.of(start)))
        m.d.comb += [
            hold.eq(active & uses & unit.busy),
            unit.begin.eq(self.begin),
            unit.start.eq(Mux(go, now.start, Start.NONE)),
            unit.how.eq(now.how),
            unit.sum.eq(made),
        ]
        # Jumps.
        empty, one = ~self.number.any(), self.number == 1
        met = {Jump.ALWAYS: C(1, 1), Jump.NEG: negative, Jump.POS: ~negative, Jump.EMPTY: empty, Jump.ONE: one}
        m.d.comb += [
            taken.eq(go & Cat(met.get(jump, C(0, 1)) for jump in Jump).bit_select(now.jump, 1)),
            stop.eq(go & (now.jump == Jump.END)),
        ]
        return m

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
        t = self._program.form.time_bits
        shifts = {"counts": PLACE_BITS, "places": _PLACES_BITS, "times": t, "last": t, "moved": PLACE_BITS, "length": t}
        return [getattr(self, "number" if name == "counts" else name) << shifts.get(name, 0) for name in INPUTS]

    def _stored(self, word: Value) -> Value:
        """Return the address of a word that is stored, which may be the offset of the last count's edge."""
        return self._offset(word, Cat(self.kind, word[2]))

    def _chosen(self, m: Module, word: Value) -> Value:
        """Return the address of a word that is read, which may be one that the tick chooses among the offsets."""
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
