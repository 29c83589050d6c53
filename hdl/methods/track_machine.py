"""The machine of the tracking method: one adder, two registers, a memory, and a program."""

from enum import IntEnum

from amaranth import Cat, Module, Mux, Shape, Signal, Value, signed
from amaranth.lib import data, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.spec.formats.tracking import LEVELS, STEP_BACK, Tracking
from tachometry.spec.formats.tracking_code import MAX_STEPS, Condition, Input, Instruction, Op, Phase
from tachometry.spec.formats.tracking_program import STATES, TABLES, Program


class Left(IntEnum):
    """The left operand of the adder."""

    AC = 0
    HALF = 1  # ac shifted right
    TWICE = 2  # ac shifted left, with the next bit of mq
    MQ = 3


class Special(IntEnum):
    """Says what an operation does beside the adder."""

    NONE = 0
    TEST = 1
    TEST_AND = 2
    TEST_OR = 3
    JUMP = 4
    LEVEL = 5
    PHASE = 6
    OUT = 7


# The lines of an instruction that are high for each operation, and its left operand.
_CONTROLS: dict[Op, dict[str, int]] = {
    Op.LOAD: {"clear": 1, "reads": 1, "to_ac": 1},
    Op.ADD: {"reads": 1, "to_ac": 1},
    Op.SUB: {"reads": 1, "subtract": 1, "to_ac": 1},
    Op.LOAD_SIGNED: {"clear": 1, "reads": 1, "by_sign": 1, "to_ac": 1},
    Op.STORE: {"write": 1},
    Op.SIGN: {"keep": 1},
    Op.KEEP: {"write": 1, "keep": 1},
    Op.MUL: {"left": Left.HALF, "clear": 1, "reads": 1, "multiply": 1, "to_ac": 1},
    Op.DIV: {"left": Left.TWICE, "clear": 1, "reads": 1, "divide": 1, "to_ac": 1},
    Op.FRACTION: {"left": Left.TWICE, "reads": 1, "divide": 1, "to_ac": 1},
    Op.DOUBLE: {"left": Left.TWICE, "to_ac": 1},
    Op.SHIFT: {"left": Left.HALF, "to_ac": 1},
    Op.FROM_MQ: {"left": Left.MQ, "to_ac": 1},
    Op.TO_MQ: {"to_mq": 1},
    Op.INPUT: {"clear": 1, "input": 1, "to_ac": 1},
    Op.ADD_INPUT: {"input": 1, "to_ac": 1},
    Op.SUB_INPUT: {"subtract": 1, "input": 1, "to_ac": 1},
    Op.POSITIVE: {"positive": 1},
    Op.NEGATIVE: {"negative": 1},
    Op.WAIT: {},
    **{Op[item.name]: {"special": item} for item in Special if item},
    Op.OUT: {"special": Special.OUT, "reads": 1},
}


_LINES = tuple("clear reads multiply divide subtract by_sign to_ac to_mq input write keep positive negative".split())


def _layout(address: int) -> data.StructLayout:
    """Return an instruction: the lines, an address, and the clocks that it still takes after its first."""
    return data.StructLayout(
        {"left": 2, **dict.fromkeys(_LINES, 1), "special": 3, "address": address, "more": MAX_STEPS.bit_length()}
    )


def _word(layout: data.StructLayout, code: Instruction) -> int:
    """Return an instruction as the program memory holds it."""
    fields = _CONTROLS[code.op]
    values = {**fields, "address": code.address, "more": code.steps - 1}
    if code.op == Op.JUMP:  # which needs no adder, and has its condition there
        values |= {"left": code.steps & 3, "by_sign": code.steps >> 2, "more": 0}
    word, place = 0, 0
    for name, field in layout.members.items():
        word |= values.get(name, 0) << place
        place += Shape.cast(field).width
    return word


class TrackMachine(wiring.Component):
    """Runs the program once for every tick; `spec.formats.tracking_code` says what each operation does.

    While an instruction is executed, the word of the next one has been read, that of the one behind is being read, and
    a fourth one is fetched.

    Parameters
    ----------
    program : Program

    Members
    -------
    begin : In(1)
    counted, beyond, quiet : In(1)
        Conditions of the tick; as all inputs they hold until the next.
    number, times, places, moved, length : In
    tracks : Out(1)
        There is a speed.
    out : Out(1)
        The outputs are valid in this clock.
    velocity, acceleration, p : Out(signed)
    """

    def __init__(self, program: Program, *, moved_width: int) -> None:
        self._program = program
        form: Tracking = program.form
        width = signed(form.width)
        super().__init__(
            {
                **dict.fromkeys(("begin", "counted", "beyond", "quiet"), In(1)),
                "number": In(form.number_bits),
                "times": In(form.times_bits),
                "places": In(signed(form.places_bits)),
                "moved": In(signed(moved_width)),
                "length": In(range(form.longest_tick + 1)),
                "tracks": Out(1),
                "out": Out(1),
                **dict.fromkeys(("velocity", "acceleration", "p"), Out(width)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        form, code = self._program.form, self._program.instructions
        width = signed(form.width)
        address_width = max(len(code).bit_length(), (TABLES * 2 - 1).bit_length())
        layout = _layout(address_width)
        # Memories as deep as their addresses reach.
        m.submodules.program = program = Memory(
            shape=layout.size, depth=1 << address_width, init=[_word(layout, item) for item in code]
        )
        known = self._program.memory
        m.submodules.words = words = Memory(shape=width, depth=1 << (len(known) - 1).bit_length(), init=known)
        fetch = program.read_port()
        read = words.read_port()
        write = words.write_port()

        # Four stages: fetch an instruction, read its word, hold both, execute it.
        pc = Signal(address_width)
        fetched = Signal()
        held = Signal()
        active = Signal()
        fetching = data.View(layout, fetch.data)
        following = Signal(layout, reset_less=True)
        now = Signal(layout, reset_less=True)
        done = Signal()
        taken = Signal()
        stop = Signal()
        place = Signal(address_width)
        m.d.comb += [
            done.eq(~active | ~now.more.any()),
            place.eq(Mux(taken, now.address, pc)),
            fetch.addr.eq(place),
            fetch.en.eq(done | self.begin),
            read.en.eq(done & ~write.en),  # the program never reads while it writes
        ]
        valid = ~taken & ~stop
        with m.If(done):
            m.d.sync += [following.eq(fetching), now.eq(following)]
            m.d.sync += [held.eq(fetched & valid), active.eq(held & valid)]
        with m.Else():
            m.d.sync += now.more.eq(now.more - 1)
        with m.If(stop | (~fetched & ~self.begin)):  # at rest it is at the first instruction
            m.d.sync += pc.eq(0)
        with m.Elif(done):
            m.d.sync += pc.eq(place + 1)
        with m.If(stop):
            m.d.sync += fetched.eq(0)
        with m.If(self.begin):
            m.d.sync += [fetched.eq(1), held.eq(0), active.eq(0)]

        level = Signal(range(LEVELS))
        tables = fetching.address[TABLES.bit_length() - 1]
        m.d.comb += read.addr.eq(
            fetching.address[: len(read.addr)] | (Mux(tables, level, 0) if self._program.tables else 0)
        )
        # The right operand, which an operation without one finds to be 0.
        x = Signal(width, reset_less=True)
        with m.If(done):
            m.d.sync += x.eq(Mux(following.input, self._input(following.address), read.data))
            with m.If(~(following.reads | following.input)):
                m.d.sync += x.eq(0)

        ac = Signal(width, reset_less=True)
        mq = Signal(form.width, reset_less=True)
        negative = ac[-1]
        flag = Signal()
        sign = Signal()
        left = Signal(width)
        right = Signal(width)
        total = Signal(width)
        minus = Signal()
        carry = Signal()
        # Nested as it is, it takes two cells a bit.
        low, high = now.left[0], now.left[1]
        shifted, kept = Mux(low, mq.as_signed(), Cat(mq[-1], ac)[: form.width].as_signed()), Mux(low, ac >> 1, ac)
        m.d.comb += left.eq(Mux(high, shifted, kept))
        m.d.comb += [
            minus.eq(now.subtract | (now.by_sign & sign) | (now.divide & ~negative)),
            right.eq(Mux(now.multiply & ~mq[0], 0, x) ^ minus.replicate(form.width)),
            # The last bit that leaves a product rounds it. The carry comes from an additional bit at the adder's end.
            carry.eq(Mux(now.multiply, done & ac[0], minus)),
            total.eq((Cat(1, left).as_signed() + Cat(carry, right).as_signed()) >> 1),
        ]
        work = Signal()
        m.d.comb += work.eq(active)
        # An operation that begins with 0 finds it in ac, where nothing is left that is needed then.
        clear = Signal()
        m.d.comb += clear.eq(
            (done & following.clear & ~taken) | (work & now.positive & negative) | (work & now.negative & ~negative)
        )
        with m.If(clear):
            m.d.sync += ac.eq(0)
        with m.Elif(work & now.to_ac):
            m.d.sync += ac.eq(total)
        with m.If(work & (now.multiply | now.divide | now.to_mq)):
            m.d.sync += mq.eq(Mux(now.multiply, mq >> 1, Mux(now.divide, Cat(~total[-1], mq), ac)))
        m.d.comb += [
            write.addr.eq(now.address[: (STATES - 1).bit_length()]),
            write.data.eq(ac),
            write.en.eq(work & now.write),
        ]
        with m.If(work & now.keep):
            m.d.sync += sign.eq(negative)
        phase = Signal(Phase)
        special = Mux(work, now.special, Special.NONE)
        with m.If(special == Special.TEST):
            m.d.sync += flag.eq(~negative)
        with m.Elif(special == Special.TEST_AND):
            m.d.sync += flag.eq(flag & ~negative)
        with m.Elif(special == Special.TEST_OR):
            m.d.sync += flag.eq(flag | ~negative)
        with m.Elif(special == Special.JUMP):
            m.d.comb += taken.eq(self._holds(Cat(now.left, now.by_sign), negative, flag, phase))
        with m.Elif(special == Special.LEVEL):
            m.d.sync += level.eq(self._next_level(now.address, level))
        with m.Elif(special == Special.PHASE):
            m.d.sync += phase.eq(now.address)
        with m.Elif(special == Special.OUT):
            m.d.comb += stop.eq(1)
        m.d.comb += [
            self.tracks.eq(phase == Phase.TRACKS),
            self.out.eq(stop),
            self.velocity.eq(mq),
            self.acceleration.eq(ac),
            self.p.eq(x),
        ]
        return m

    def _holds(self, condition: Value, negative: Value, flag: Value, phase: Value) -> Value:
        """Tell whether a condition is met."""
        met = {
            Condition.ALWAYS: 1,
            Condition.NEGATIVE: negative,
            Condition.FLAG: flag,
            Condition.COUNTED: self.counted,
            Condition.BEYOND: self.beyond,
            Condition.RESTS: phase == Phase.REST,
            Condition.BEGUN: phase == Phase.BEGUN,
            Condition.QUIET: self.quiet,
        }
        return Cat(met[item] for item in Condition).bit_select(condition, 1)

    @staticmethod
    def _next_level(change: Value, level: Signal) -> Value:
        back = Mux(level >= STEP_BACK, level - STEP_BACK, 0)
        following = Mux(level == LEVELS - 1, level, level + 1)
        return Mux(change[1], following, Mux(change[0], back, 0))

    def _input(self, which: Value) -> Value:
        """Return what is loaded into ac."""
        form = self._program.form
        inputs: dict[Input, Value] = {
            Input.TIMES: self.times,
            Input.NUMBER: self.number << form.mean_bits,
            Input.PLACES: self.places << (form.frac_bits - 1),
            Input.MOVED: self.moved << form.frac_bits,
            Input.LENGTH: self.length,
            Input.LENGTH_SHIFTED: self.length << form.gap_shift,
        }
        found: Value = Value.cast(0)
        for item, value in inputs.items():
            if item >= Input.LENGTH and not form.external:
                continue
            if value.shape().signed:
                value = Cat(value, value[-1].replicate(form.width))[: form.width]
            found = found | Mux(which[:3] == item, value, 0)
        return found
