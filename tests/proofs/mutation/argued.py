"""Survivors that are equivalent to the core by an argument made by hand, where the proof does not reach.

The keys are the core, the line of the HDL, and what the mutant changes in the cell that Yosys made of that line, with
the cell where the line has several of a kind; some multiplexers that Yosys makes have no line. B is the value that a
reset gives, and S is whether there is a reset.
"""

from pathlib import Path

from proofs.mutation.netlist import Mutant

ROOT = Path(__file__).parents[3]
_NO_COUNT = (
    "it is read as the sign of a distance, after a count has set it, and where the velocity decays: until then the "
    "velocity is 0, and the speed that the time allows is no less"
)

_GOES_ON = (
    "the division of a bound only goes on for longer, and the bound is taken when that of the velocity has come to its "
    "end"
)
_LEFT = 'self._left = Signal(signed((self._steps - 1).bit_length() + 1), name="left", reset_less=True)'
_SLACK = (
    "it changes the lowest two bits of a product, by less than what 1/m_s may be off: with every N and every m_s of "
    "this core the quotient is the same, see test_argued.py"
)
_TWICE = "twice = (high ^ low) & ~(low ^ below)"
_ODD = "product = Cat(Mux(twice, 0, 1), Mux(twice, 1, self.q[1]) ^ (high & ~twice), product[2:])"
_REGULAR = "regular = self.tick & ~self.alteration  # b is the number of this tick"
_LATER = "b is taken in the clocks behind the tick, in which the pulse number stays, and is read in the next one"
_BEFORE = (
    "before the first control tick there is one update at most, whose velocity is replaced by another before it is "
    "used; and of no control tick there is no coefficient but 0"
)
_TWO_A_TICK = (
    "it is inverted like that in every clock, and is read and set again an even number of clocks after a control tick "
    "has set it"
)
_DEMANDED = "a tick sets it before a product is done"
_WHOLE = "without a filter y is the velocity: there is nothing below an LSB of it"

ARGUED = {
    ("s, divided", _ODD, "$56.Y[0] const1"): _SLACK,
    ("s, divided", _TWICE, "$49.A[0] const1"): _SLACK,
    ("s, divided", _TWICE, "$50.A[0] const0"): _SLACK,
    ("s, divided, wide", _TWICE, "$65.A[0] const1"): _SLACK,
    ("s, divided, wide", "upper = Signal(signed(n_upper + 2), reset_less=True)", "upper[12] const1"): (
        "of five digits, each of which moves the sum down by two bits, it never comes down to the two that are shown"
    ),
    ("s, divided", _REGULAR, "$9.A[0] inv"): _LATER,
    ("s, divided, wide", _REGULAR, "$9.A[0] inv"): _LATER,
    ("loop, serial", "waits = Signal()", "B[0] inv"): _BEFORE,
    ("loop, serial", "m.d.comb += self.due.eq(waits | (self.n == self._longest))", "$14.A[0] inv"): (
        "it stands for 6 control ticks instead of 7: S has an update in every 5 of them, so that one waits there"
    ),
    ("loop, serial", "step = Mux(skipped, word, product.product)", "$318.A[8] inv"): (
        "that is what y takes, and without a filter y never takes a product"
    ),
    ("loop, serial", '"y": Out(signed(signed_width(form.most_y))),', "y[4] const0"): _WHOLE,
    ("loop, serial", '"current_sum": Out(signed(form.most_sum.bit_length() + 1)),', "current_sum[11] cnot1"): (
        _TWO_A_TICK
    ),
    ("loop, parallel", '"current_sum": Out(signed(form.most_sum.bit_length() + 1)),', "current_sum[12] cnot1"): (
        _TWO_A_TICK
    ),
    ("loop, parallel", '"n": Out(range(form.longest + 1)),', "n[0] cnot1"): _TWO_A_TICK,
    ("loop, parallel", "ticked = Signal()  # before the first control tick there is no current", "ticked[0] const1"): (
        _BEFORE
    ),
    ("loop, unfiltered", "waits = Signal()", "S[0] const0"): _BEFORE,
    ("loop, unfiltered", "product = Signal.like(self.product, reset_less=True)", "D[19] inv"): (
        "that is the highest bit of the sum, to which four products are added; and no bit of w"
    ),
    ("loop, command generator", "swinging = Signal()", "B[0] inv"): _DEMANDED,
    ("loop, command generator", "ramp = Signal()", "B[0] const1"): _DEMANDED,
    ("loop, command generator", "with m.If(done & (stage == number)):", "$971.A[0] inv"): (
        "the velocity is taken a clock earlier: word and factor are there a clock before the product begins, so it is "
        "right by then"
    ),
    ("t, in clocks", '"running": Out(1),', "divider_velocity_lower.running[0] const1"): _GOES_ON,
    ("t, in clocks", '"running": Out(1),', "divider_velocity_upper.running[0] const1"): _GOES_ON,
    ("t, in clocks", '"running": Out(1),', "$procmux$57.A[0] const1"): _GOES_ON,
    ("t, in clocks", _LEFT, "left[2] const1"): _GOES_ON,
    ("t, in clocks", _LEFT, "divider_velocity_upper.left[3] const0"): _GOES_ON,
    ("t, in clocks", "left.eq(left - 1),", "$40.Y[2] const1"): _GOES_ON,
    ("t, in clocks", "left.eq(left - 1),", "divider_velocity_upper.$40.B[0] inv"): _GOES_ON,
    ("t, in clocks", '"running": Out(1),', "divider_velocity_upper.$procmux$33.B[0] const1"): _GOES_ON,
    ("mt, in clocks", '"running": Out(1),', "divider_velocity_upper.running[0] const1"): _GOES_ON,
    ("mt, in clocks", _LEFT, "left[1] const1"): _GOES_ON,
    ("mt, in clocks", '"was_negative": Out(1),', "B[0] const1"): _NO_COUNT,
    ("mt, in clocks", '"was_negative": Out(1),', "S[0] const0"): _NO_COUNT,
    ("mt, in clocks", "copy = Signal(len(divider.quotient), init=1 << (len(divider.quotient) - 1))", "B[8] const0"): (
        "it is the sign of the copy after a reset: until a measurement replaces the copy, what decays is 0, and a "
        "quotient passes this bound with its first digit as it passes 0, so nothing is shown, and the copy stays"
    ),
}


def argued(core: str, mutant: Mutant) -> bool:
    """Tell whether an argument covers a mutant of a core."""
    place = f".{mutant.place}"
    lines = [_line(*source.split(":")) for source in mutant.lines if source.startswith("hdl/")] or [""]
    return any(key[0] == core and key[1] in lines and place.endswith(f".{key[2]}") for key in ARGUED)


def _line(file: str, number: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8").splitlines()[int(number.split(".")[0]) - 1].strip()
