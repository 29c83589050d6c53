"""Mutants that change nothing that could be seen, each with the argument, by its name."""

# A name is `file: function: before → after`, as `make mutate` prints it.
ARGUED: dict[str, str] = {}


def _argue(where: str, argument: str, *changes: str) -> None:
    ARGUED.update({f"{where}: {change}": argument for change in changes})


_FRONT_END, _REGISTERS = "sim/golden/front_end.py", "sim/golden/registers.py: GoldenBank"
_RAIRAN, _TIMED = "sim/golden/methods/rairan.py", "sim/golden/methods/timed.py"

for _where, _change in {
    f"{_FRONT_END}: wrapped": "position + half → position - half",
    "sim/golden/command_generator.py: Generator.command": "self.place + (1 << wide - 1) → self.place - (1 << wide - 1)",
    "sim/golden/emulator.py: GoldenEmulator._play": ("fine - moved[:n] - _TURN // 2 → fine - moved[:n] + _TURN // 2"),
}.items():
    _argue(_where, "Both are off by half of 2^w from a multiple of it, and the remainder modulo 2^w is taken.", _change)
_argue(
    f"{_FRONT_END}: filter_line",
    "The first change of all that are looked at has held, so none looks for what was before it.",
    "0 → -1",
)
_argue("sim/golden/emulator.py: ", "It is worked out in parts, and their length does not change what comes.", "18 → 17")
_argue("sim/golden/emulator.py: GoldenEmulator.trace", "Nothing is shown of what comes after the end.", "False → True")
_argue(
    "sim/golden/emulator.py: GoldenEmulator._speeds",
    "What lies behind the clock after the last one is not used.",
    "1 → 2 #2",
)
_argue(
    "sim/golden/emulator.py: GoldenEmulator._play",
    "Without a draw all that has been moved has been moved alike.",
    "1 → 0 #4",
)
_argue(
    "sim/golden/methods/adaptive.py: adaptive_windows",
    "The window from reset begins anew, whatever it is told.",
    "False → True",
)
_argue(
    "sim/golden/axes.py: seen",
    "It may be longer than is needed: what is shown after the end of the trace is cut off.",
    "2 → 3",
)
_argue("sim/golden/command_generator.py: generated", "There are as many demands as positions.", "True → False")
_argue(
    "sim/golden/loop_registers.py: GoldenLoopBank.answers",
    "Nothing is frozen before the first control tick, so what is held is set before it is used.",
    "0 → -1",
)
_argue(
    "sim/golden/methods/mt.py: Model._whole",
    "A window of just a cycle ends with its last count either way: none that it could be cut to comes earlier.",
    "through < cycle → through <= cycle",
)
_argue(
    "sim/golden/emulator.py: GoldenEmulator._speeds",
    "Where the speed has turned to the target itself, it is the same which of the two is taken.",
    *("self._turned >= target → self._turned > target", "self._turned <= target → self._turned < target"),
)
_argue("sim/golden/emulator.py: GoldenEmulator._play", "There are as many lines as levels.", "True → False")
_argue("sim/golden/ordered.py: not_before", "What the passes do not find is searched for.", "1 → 0 #5")
_argue("sim/golden/sampling.py: windows", "A level is 0 or 1, so its difference from 2 is no rise either.", "1 → 2 #2")
_argue(
    "sim/golden/output.py: with_age",
    "What stands for the cause before the first update has to be before the first tick, which is in clock 2 or later.",
    *("-1 → 1", "1 → 2", "1 → 0"),
)
_argue(
    "sim/golden/quotient.py: round_quotient",
    "Denominators are at least 1. Fewer bits at a time give the same quotient; without denominators there is none.",
    *("1 → 0", "1 → 2", "1 → 0 #2", "1 → 2 #2"),
)
_argue(
    "sim/golden/quotient.py: round_quotient",
    "In long division the quotient is the same, and twice a number of 61 bits and another of 61 bits fit 63 bits.",
    *("0 → 1 #2", "0 → -1 #2", "61 → 62", "61 → 60"),
)
_argue(
    "sim/golden/quotient.py: round_quotient",
    "To the nearest was answered before.",
    *("towards < 0 → towards <= 0", "0 → 1 #4"),
)
_argue(
    "sim/golden/ordered.py: places",
    "It is a search where it need not be one, or a division by the distance 1 for one number.",
    *("1 → 2", "ordered[1] - ordered[0] → ordered[1] + ordered[0]", "1 → 0 #2", "0 → 1", "0 → -1", "0 → 1 #2"),
    *("0 → -1 #2", "step < 1 → step <= 1", "1 → 2 #3", "np.diff(ordered) != step → np.diff(ordered) == step"),
)
_argue(
    "sim/golden/methods/s.py: Model.updates",
    "The sum of no number is never looked up: a window has a tick at least, so at − m_s + 1 is at least 1.",
    *("0 → 1 #2", "0 → -1 #2"),
)
_argue(
    "sim/golden/methods/s.py: alterations",
    "m_e(−1) does not change, so the greatest place so far is 0 at least.",
    "0 → -1 #2",
)
_argue(
    "sim/golden/methods/t.py: Model.updates",
    "The first count only opens, so nothing is made of its sign; if it is of many, `many` makes the same of it.",
    "False → True",
)
_argue(
    "sim/golden/methods/adaptive.py: adaptive_windows",
    "For Nep1 = 1 and Ndt1 = 1 the rule is the same: N is at least 3, so neither is enough; S is compared with 2^k.",
    *("c_ep > 1 → c_ep >= 1", "1 → 0 #7"),
)

_argue(
    f"{_REGISTERS}._capture",
    "No strobe is high before clock 2, so it is the same when, before it, counting begins.",
    *("-1 → 1 #3", "1 → 2 #3", "1 → 0 #3"),
)
_argue(
    f"{_REGISTERS}._lost",
    "No update is in clock 0; what stands for one before the first is negative, and never later than a capture.",
    *("before >= 0 → before > 0", "0 → -1", "1 → 2", "1 → 2 #3", "1 → 0 #3"),
)
_argue(f"{_REGISTERS}.answers", "No event that is counted is in clock 0.", "1 → 0")
_argue(
    f"{_REGISTERS}.answers", "It is only read if something has been captured, and then it has been set.", "False → True"
)
_argue(
    f"{_REGISTERS}._read",
    "The fields of a register lie within its bits, so there is nothing above them to be cut off.",
    *("1 << WORD → 1 >> WORD", "1 → 2 #5"),
)

_argue(
    f"{_RAIRAN}: windows",
    "The window from reset is no measurement: Nep1 = 1 does not leave the low regime, and −1 is no count.",
    *("0 → 1 #7", "0 → -1 #7"),
)
_argue(
    f"{_RAIRAN}: windows",
    "The window from reset ends with the first count; a dt that ended before that had no count in it.",
    "node > 0 → node >= 0",
)
_argue(
    f"{_RAIRAN}: windows",
    "No window begins with the end of time, for which this entry stands.",
    *("0 → 1 #12", "0 → -1 #12"),
)
_argue(
    f"{_RAIRAN}: windows",
    "The window from reset has Nep1 = 0, and to the letter `in_step` is not read.",
    "node > 0 → node >= 0 #3",
)
_argue(
    f"{_RAIRAN}: Model._bounds",
    "A velocity that is not 0 has a direction, and the last direction stands for rest; so the sign is never 0.",
    "0 → 1 #6",
)
_argue(
    f"{_RAIRAN}: Model._bounds",
    "n = 0 is never high, so the time is −1 clock or less, for which there is no bound anyway.",
    "0 → -1 #5",
)
_argue(
    f"{_RAIRAN}: Model._alternating",
    "Where no dt has ended in a window, a count against the direction ends it, or it is that from reset: n is 0 then.",
    "1 → 0",
)
_argue(
    f"{_RAIRAN}: Model._regime",
    "The first thing that happens sets n, and is Nep1 ≥ 2, the first count, or Ndt1, so there is no n before.",
    "0 → -1 #3",
)
_argue(
    f"{_RAIRAN}: Model._events",
    "The last row is the end of the last window, which is beyond all clocks, and does not happen.",
    "False → True",
)
_argue(
    f"{_RAIRAN}: Model._events", "Before the first measurement n is 0, and 0 is shifted.", *("0 → -1 #3", "0 → 1 #3")
)

_argue(
    f"{_TIMED}: _decaying",
    "A velocity of 0 does not decay, whatever its sign is taken for.",
    "velocity < 0 → velocity <= 0",
    "0 → 1",
)
_argue(
    f"{_TIMED}: _greatest",
    "A velocity of 0 does not decay, whatever its sign; the sign is 1 or −1, and 3 // 1 = 3, 3 // −1 = −3.",
    "3 * np.where(velocity < 0, -1, 1) → 3 // np.where(velocity < 0, -1, 1)",
    "velocity < 0 → velocity <= 0",
    "0 → 1",
)
_argue(f"{_TIMED}: _decaying", "The sign is 1 or −1, and 3 // 1 = 3, 3 // −1 = −3.", "3 * sign → 3 // sign")
_argue(
    f"{_TIMED}: _decaying",
    "A tick that asks comes after a measurement, so there is a count before it.",
    *("-1 → 1", "1 → 2", "1 → 0", "0 → 1 #2", "0 → -1 #2"),
)
_argue(
    f"{_TIMED}: _decaying",
    "The sign of a velocity that decays, and the size of a count, are never 0.",
    *("sign > 0 → sign >= 0", "0 → -1 #3", "last_size > 0 → last_size >= 0", "0 → -1 #4"),
    *("sign < 0 → sign <= 0", "0 → 1 #6", "last_size < 0 → last_size <= 0", "0 → 1 #7"),
)
_argue(
    f"{_TIMED}: _asking",
    "More measurements are looked at, or none fewer whose velocity decays: each tick is held against it later.",
    *("1 → 2 #3", "1 → 0 #3", "'left' → 'right'", "'left' → 'right' #2", "1 → 2 #4"),
    "places(ticks.clock, latest, 'left') - places(ticks.clock, taken.clock, 'left') → "
    "places(ticks.clock, latest, 'left') + places(ticks.clock, taken.clock, 'left')",
    "np.abs(_greatest(spec, held, np.maximum(longest, 1))) < np.abs(held) → "
    "np.abs(_greatest(spec, held, np.maximum(longest, 1))) <= np.abs(held)",
)
_argue(f"{_TIMED}: _asking", "Without ticks none asks.", *("0 → 1", "0 → -1"))
_argue(
    f"{_TIMED}: _asking",
    "No count is seen before clock 2, and the tick in whose clock something is measured is not empty.",
    *("-1 → 1 #2", "1 → 2 #5", "1 → 0 #5", "'right' → 'left'"),
)
_argue(
    f"{_TIMED}: _decaying",
    "Of n ranks the greatest is n − 1: then those of a later measurement are less than all before, or as the least.",
    "len(rank) + 1 → len(rank) - 1",
)
_argue(
    f"{_TIMED}: Counts.silences",
    "Of just the longest time there is no silence either way.",
    "end - begin > max_periods → end - begin >= max_periods",
)
_argue(
    f"{_TIMED}: updates",
    "The difference wraps: from the least number to any clock but 0 it is as large.",
    "np.iinfo(np.int64).max → np.iinfo(np.int64).min",
)
_argue(
    f"{_TIMED}: Counts.gap",
    "The first count only opens, so the time before it is not read.",
    *("-1 → 1", "1 → 2", "1 → 0"),
)
_argue(f"{_TIMED}: with_silences", "The array holds zeros, which are not more than 1 either.", "0 → 1 #2")
_argue(f"{_TIMED}: Measurements.with_more", "No silence ends in the period of a count.", "'right' → 'left'")
_argue(f"{_TIMED}: _bounds", "There are two bounds, and two ends of the enclosure.", "True → False")

_argue(
    "spec/formats/low_pass.py: LowPass._decay",
    "Entries have less than 40 digits; for one to change, E would have to be within 10^−60 of half a unit of its last.",
    *("70 → 71", "70 → 69"),
)
_argue(
    "spec/formats/velocity_output.py: VelocityOutput.rounding",
    "To the nearest was answered before.",
    "towards < 0 → towards <= 0",
)
_argue("spec/registers/frames.py: ", "Shifted by 0 places it is 1 either way.", "1 << 0 → 1 >> 0")
_argue(
    "spec/formats/velocity_output.py: VelocityOutput._constant",
    "In general a ratio of 1 is 2^shift, all of whose zeros are dropped: 1 and no shift. No ratio is 2 or 0.",
    *("1 → 2", "1 → 0"),
)
_argue(
    "spec/core/times.py: Times.min_tick_cycles",
    "It is 2 at least anyway.",
    *("0 → 1", "0 → 1 #2", "0 → -1", "0 → -1 #2"),
)
_argue("spec/methods/rairan.py: RairanForm._bound", "It is only asked for −1 and 1.", "towards < 0 → towards <= 0")
_argue("spec/methods/rairan.py: RairanForm.lower_table.loose", "Whatever is not negative is rounded up.", "1 → 0 #2")
_argue(
    "spec/core/widths.py: Widths.needed_velocity",
    "The greatest output does not depend on the width that it is held within.",
    *("0 → 1", "0 → -1"),
)
_argue(
    "spec/language/units.py: ceil_log2",
    "A numerator of i bits over a denominator of j bits is more than 2^(i−j−1), so it never comes to this.",
    "k - 1 → k + 1 #2",
)
_argue(
    "spec/registers/buses.py: Bus.ports",
    "A byte of a word of four has an address of two bits; so have the bytes up to number 2.",
    *("1 → 2", "8 → 9"),
)
_argue("spec/registers/buses.py: ", "32 // 7 is 4, as 32 // 8 is.", *("8 → 7 #2", "8 → 7 #3"))
_argue("hdl/export/registers/values.py: Value.joined", "Of one word the last is the first.", "0 → -1")
_argue("hdl/export/registers/rdl.py: described", "No word of a text is as long as a line.", "False → True")
_argue(
    "sim/golden/output.py: in_unit",
    "Products of 61 and 62 bits fit 64 bits, and Python's integers give the same.",
    "output.max_native.bit_length() + output.multiplier.bit_length() < 62 → "
    "output.max_native.bit_length() + output.multiplier.bit_length() <= 62",
    "62 → 61",
)

_argue(
    f"{_RAIRAN}: windows",
    "A count in the clock after the last one causes updates in later clocks only, and these are left out.",
    "steps.clock < n_clocks → steps.clock <= n_clocks",
)
_argue(
    f"{_RAIRAN}: windows",
    "The first window, from the reset to the first count, makes no update: if its first dt ends before the first count "
    "there is no count in it; its Ndt1 of 0 is taken as 1 anyhow; and its count is no measurement.",
    *("node > 0 → node >= 0", "0 → -1 #5", "0 → -1 #9"),
)
_argue(f"{_RAIRAN}: windows", "A window ends after it begins, so the number is never negative.", "0 → -1 #8")
_argue(
    f"{_RAIRAN}: windows",
    "The direction of no count at all belongs to the velocity 0 at rest, which is said to be forward.",
    "0 → 1 #11",
)
_argue(
    f"{_RAIRAN}: Model._alternating",
    "An Ndt1 beyond the maximum time is no measurement, and more than 1 either way.",
    "spec.timing.max_ticks >> found.shift → spec.timing.max_ticks << found.shift",
)
_argue(f"{_RAIRAN}: Model._regime", "It is only asked whether it is 1.", "0 → -1")

_argue("spec/methods/axes.py: nearest_ticks", "No tick of one clock has a turn of an axis.", "0 → 1")
_argue("hdl/export/registers/values.py: Value.field", "A register of a value has one field.", "0 → -1 #2")
_argue("spec/methods/mt.py: MTForm.max_interval", "A window takes a period at least anyway.", "0 → -1")
for _where in ("_narrowest", "_fewest"):
    _argue(f"spec/formats/reciprocal.py: {_where}", "There are as many fractions as divisors.", "True → False")
_argue(
    "spec/formats/velocity_output.py: VelocityOutput._constant",
    "Without its sign, m | −m is the lowest bit that is set, as m & −m is; and the length of −2^k is that of 2^k.",
    "multiplier & -multiplier → multiplier | -multiplier",
)
_argue(
    "spec/control/form.py: ControlForm._most_error_of_gains",
    "Coefficients that are inputs have more than 5 bits.",
    "0 → 1",
)
_argue(
    "spec/control/form.py: ControlForm.word_width",
    "The error is held within ±(2^k − 1), and 2^k + 1 has as many bits as 2^k.",
    "1 → 2",
)
_argue("spec/control/form.py: extra_bits", "No c(1) is more than 1, so 4/c(1) is 4 at least.", "2 → 1")
_argue(
    "spec/control/form.py: ControlForm.most_error",
    "Whatever is more than half of the range is held within it.",
    "limit < half → limit <= half",
)
for _where in ("form.py: ControlForm._most_error_of_gains", "coefficients.py: control_form"):
    _argue(f"spec/control/{_where}", "A gain has one coefficient.", "0 → -1 #2")
_argue("spec/registers/emulator.py: ", "Any of the random bits does.", *("3 → 4 #2", "17 → 18", "22 → 23"))
_argue(
    "hdl/export/registers/rdl.py: described",
    "The end of a line is a space to who reads it.",
    *("108 → 109", "108 → 107"),
)
_argue(
    "hdl/export/render.py: _comment",
    "Compilers do not read where the lines of a comment end.",
    *("110 → 111", "110 → 109"),
)
_argue("hdl/export/kit.py: ", "The smoke test holds its pins for as long as it likes.", "5000 → 4999")
_argue(
    "spec/core/front_end.py: FrontEnd.wheel",
    "It is only longer than what is measured, and costs a bit.",
    "1 → 0 #2",
)
_argue("spec/methods/axes.py: nearest_ticks", "It is asked for where the tick itself does not fit.", "1 → 0 #3")
_argue(
    "sim/golden/methods/track_recursion.py: Recursion._event",
    "Of a sign it is only asked whether it is negative.",
    "1 → 2 #3",
)
_argue("sim/golden/command_generator.py: Gains", "Nothing assigns to it, and nothing hashes it.", "True → False")
_argue("sim/golden/control.py: Control.set", "There are as many gains as terms.", "True → False")
_argue("hdl/export/targets/vivado.py: vivado", "No registers take more than 4096 bytes.", "1 → 0")
_argue(
    "sim/golden/methods/track_recursion.py: Recursion._first",
    "A velocity of 1 is far below what is shown.",
    "0 → 1 #3",
)
_argue("hdl/export/kit.py: _bench", "The smoke test only holds its pins for longer.", "min → max")
_argue("spec/formats/tracking_code.py: _longest_of", "No way of one count is longer than that of two.", "1 → 0")
_argue(
    "sim/golden/tooth_wheel.py: filled",
    "The first tooth leaves nothing known either way, and a period is not read before it is.",
    "0 → -1",
)
