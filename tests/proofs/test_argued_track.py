"""Tests of what arguments in proofs/mutation/argued.json say of the program and the windows of tracking."""

from collections.abc import Callable, Iterator

from proofs.mutation.cases import CASES

from tachometry.sim.golden.methods.track_recursion import log2
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking_code import Instruction, Jump, Program

SERIAL = next(case.spec for case in CASES if isinstance(case.spec, TrackTachometer) and not case.spec.external_tick)
BLOCK = next(case.spec for case in CASES if isinstance(case.spec, TrackTachometer) and case.spec.external_tick)
PROGRAM = BLOCK.program


def ways(program: Program = PROGRAM) -> Iterator[tuple[Instruction, int, bool, int]]:
    """Yield each instruction on every way with counts of the tick, 0 to 2, whether the unit was begun, and clocks."""
    code, times = program.code, program.times
    for counts in range(3):
        known = {Jump.ALWAYS: True, Jump.END: True, Jump.EMPTY: counts == 0, Jump.ONE: counts == 1}
        open_ = [(code.labels[label], 0, False, 0) for label in ("tick", "reset")]
        seen = set(open_)
        while open_:
            place, busy, begun, clock = open_.pop()
            one = code.instructions[place]
            yield one, counts, begun, clock
            if one.jump == Jump.END:
                continue
            begins = times.of(one.start)
            wait = busy if begins or one.word == "~" else 0
            busy = begins - 1 if begins else max(busy - wait - 1, 0)
            begun, clock = begun or begins > 0, clock + wait + 1
            following = [] if known.get(one.jump) else [(place + 1, busy, begun, clock)]
            if one.target and known.get(one.jump, True):
                following.append((code.labels[one.target], max(busy - times.stages, 0), begun, clock + times.stages))
            open_ += [way for way in following if way not in seen]
            seen.update(following)


def test_a_result_is_taken_where_one_was_begun() -> None:
    for program in (PROGRAM, SERIAL.program):
        assert all(begun for one, _, begun, _ in ways(program) if one.word == "~")


def test_inputs_are_taken_an_even_number_of_clocks_after_the_tick() -> None:
    """A clock before an instruction is executed, and the first is two clocks after the tick."""
    clocks = {2 + clock - 1 for one, counts, _, clock in ways() if one.first == "$places" and counts == 2}
    assert clocks
    assert not any(clock % 2 for clock in clocks)
    assert BLOCK.latency.datapath % 2  # the position is taken a clock before the update


def test_instructions_that_are_not_there() -> None:
    code, addresses = PROGRAM.code.instructions, PROGRAM.addresses
    assert max(one.jump for one in code) < 7
    assert not {addresses[one.store] for one in code if one.store} & {*range(104, 112)}


def counted(mutant: Callable[[int], int]) -> tuple[int, int]:
    """Return the clock in which an external tick may end first, and the one in which it ends without one."""
    start, first = BLOCK.form.longest_tick - 2, BLOCK.times.min_tick_cycles - 2
    end, part = 1 << start.bit_length() + 1, 1 << first.bit_length()
    left, may_end = start, list[int]()
    for clock in range(end):
        if left >= end // 2:
            return may_end[0], clock
        if left % part == (start - first) % part:
            may_end.append(clock)
        left = mutant((left - 1) % end)
    raise AssertionError("no end")


def test_clocks_of_a_tick_are_counted() -> None:
    right = counted(lambda left: left)
    assert right == (BLOCK.times.min_tick_cycles - 2, BLOCK.form.longest_tick - 1)
    assert counted(lambda left: left ^ (~left >> 2 & 1) << 4) == right
    assert counted(lambda left: left ^ (~left & 1) << 4) != right


def test_the_lowest_bit_of_the_last_counts_time_is_not_seen() -> None:
    """It is added to ticks of silence, of which a logarithm is taken and which are held against times."""
    program, form = SERIAL.program, SERIAL.form
    stores = {one.store for one in program.code.instructions if one.first == "$last"}
    assert stores == {"quiet"}

    def seen(quiet: int) -> tuple[int, bool, bool]:
        constants = program.constants
        return log2(quiet + constants["lead"]), quiet < constants["max_time"], quiet < constants["forget"]

    for last in range(0, form.longest_tick, 2):
        for clocks in range(form.tick_cycles, form.tick_cycles + program.constants["forget"], form.tick_cycles):
            quiet = (clocks + last) << form.time_bits
            assert seen(quiet) == seen(quiet + (1 << form.time_bits))


def test_a_quality_has_18_bits_and_an_age_one() -> None:
    """An update follows each tick before the next."""
    program = SERIAL.program
    least = {(one.left.name, one.word) for one in program.code.instructions if one.store == "least"}
    assert least == {("ZERO", "one"), ("ZERO", ""), ("ZERO", "~")}  # the last one is a power
    assert program.constants["most_quality"] < 1 << 18
    assert SERIAL.latency.datapath < SERIAL.times.shortest_tick - 1
