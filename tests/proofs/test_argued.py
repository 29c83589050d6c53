"""Arguments of proofs/mutation/argued.py that can be computed.

What is arithmetic is computed for all numbers of the core, and what is about the program of `track` for all ways
through it.
"""

from collections.abc import Callable

import pytest
from proofs.mutation.cases import CASES
from proofs.mutation.track_lemmas import begins

from tachometry.spec import STachometer, TrackTachometer
from tachometry.spec.formats.reciprocal import DividedReciprocal
from tachometry.spec.formats.tracking_code import Condition, Input, Instruction, Level, Op, Phase
from tachometry.spec.formats.tracking_program import TABLES

Bits = Callable[[int, int, int, int], tuple[int, int]]  # the two lowest of a product, from a digit and bit 1 of q


def twice(below: int, low: int, high: int) -> int:
    return (high ^ low) & (1 ^ low ^ below)


def right(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    doubled = twice(below, low, high)
    return 1 - doubled, (1 if doubled else q) ^ (high & (1 - doubled))


def sign_alone(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    """Return `$56.Y[0] const1`."""
    return right(below, low, high, q)[0], (1 if twice(below, low, high) else q) ^ high


def never_one(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    """Return `$49.A[0] const1` and `$50.A[0] const0`."""
    return right(below, low, high, q)[0], q ^ (high & (1 - twice(below, low, high)))


def of_low_alone(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    """Return `$65.A[0] const1`: `high` counts as 1 where bit 0 is told."""
    return 1 - twice(below, low, 1), right(below, low, high, q)[1]


def differing(name: str, bits: Bits) -> int:
    """Return for how many N and m_s of a core the quotient is another one with these bits."""
    spec = next(case for case in CASES if case.name == name).spec
    assert isinstance(spec, STachometer)
    form = spec.form.reciprocal
    assert isinstance(form, DividedReciprocal)
    wrong = 0
    for m in range(1, form.max_m + 1):
        q = form.value(m)
        for n in range(-spec.form.max_numerator, spec.form.max_numerator + 1):
            total = form.rounding()
            for place in range(form.digits):
                below, low, high = (((n << 1) >> (2 * place + bit)) & 1 for bit in range(3))
                product = (below + low - 2 * high) * q
                if product:
                    lowest, next_bit = bits(below, low, high, q >> 1 & 1)
                    product = product >> 2 << 2 | next_bit << 1 | lowest
                total += product << 2 * place
            wrong += total >> form.scale_bits != (n * q + form.rounding()) >> form.scale_bits
    return wrong


@pytest.mark.parametrize(
    ("name", "bits"),
    [
        ("s, divided", right),
        ("s, divided, wide", right),
        ("s, divided", sign_alone),
        ("s, divided", never_one),
        ("s, divided, wide", of_low_alone),
    ],
)
def test_the_quotient_is_the_same(name: str, bits: Bits) -> None:
    assert differing(name, bits) == 0


@pytest.mark.parametrize(("name", "bits"), [("s, divided, wide", sign_alone), ("s, divided, wide", never_one)])
def test_it_is_not_where_the_slack_is_less(name: str, bits: Bits) -> None:
    assert differing(name, bits) > 0


OPS_OF_MQ = {Op.TO_MQ, Op.MUL, Op.DIV, Op.FRACTION, Op.DOUBLE, Op.FROM_MQ, Op.OUT}
Way = list[tuple[int, Instruction, bool]]  # where it begins, what it is, whether it jumps


def ways(code: tuple[Instruction, ...]) -> list[Way]:
    """Return all ways through a program."""
    clocks, found = begins(code), []
    open_ways: list[tuple[int, Way]] = [(0, [])]
    while open_ways:
        place, way = open_ways.pop()
        item = code[place]
        if item.op == Op.OUT:
            found.append([*way, (clocks[place], item, False)])
            continue
        if item.op == Op.JUMP:
            open_ways.append((item.address, [*way, (clocks[place], item, True)]))
        if item.op != Op.JUMP or item.steps != Condition.ALWAYS:
            open_ways.append((place + 1, [*way, (clocks[place], item, False)]))
    return found


def answers(way: Way) -> dict[Condition, bool]:
    """Return what the conditions that it asks for are."""
    return {Condition(item.steps): jumps for _, item, jumps in way if item.op == Op.JUMP}


@pytest.mark.parametrize("core", ["age", "external tick", "index"])
def test_the_program_of_track(core: str) -> None:
    """When it reads its inputs, and what has been asked and set before it asks, on all ways.

    An input that is inverted in every clock is right where an instruction reads it that begins in an odd clock.
    """
    spec = next(case for case in CASES if case.name == f"track, {core}").spec
    assert isinstance(spec, TrackTachometer)
    program = spec.program
    found = ways(program.instructions)
    assert len(found) > 10
    reading = (Op.LOAD, Op.ADD, Op.SUB, Op.MUL, Op.LOAD_SIGNED)
    for way in found:
        known = answers(way)
        tracks = known.get(Condition.RESTS) is False and known.get(Condition.BEGUN) is False
        asked = [k for k, (_, item, _) in enumerate(way) if item.op == Op.JUMP and item.steps == Condition.BEGUN]
        assert all(answers(way[:k])[Condition.RESTS] is False for k in asked)  # BEGUN is asked where it is not rest
        more = False  # whether there is more than one count, once that was asked
        for k, (begin, item, _) in enumerate(way):
            behind = [one for _, one, _ in way[:k]]
            inputs = item.op in (Op.INPUT, Op.ADD_INPUT, Op.SUB_INPUT)
            if inputs and item.address == Input.NUMBER and begin % 2 == 0:
                assert [one.op for _, one, _ in way[k + 1 : k + 3]] == [Op.SUB, Op.JUMP]
                more = not way[k + 2][2]
                less = program.memory[way[k + 1][1].address]
                assert less == 2 << program.form.mean_bits
            if inputs and item.address == Input.PLACES and begin % 2 == 0:
                assert known[Condition.RESTS]
                assert not more
            if item.op == Op.JUMP and item.steps == Condition.FLAG:
                assert any(one.op == Op.TEST for one in behind)
                assert known[Condition.COUNTED]
            if item.op == Op.TEST_OR or (item.op in reading and item.address >= TABLES):
                assert tracks
            if item.op == Op.PHASE and item.address == Phase.TRACKS:
                assert [one.address for one in behind if one.op == Op.LEVEL][-1:] == [Level.FIRST]
            assert item.op != Op.MUL or item.steps < program.form.width
            if item.op == Op.JUMP and way[k][2]:
                place = next(place for place, one in enumerate(program.instructions) if one is item)
                skipped = {one.op for one in program.instructions[place + 1 : place + 3]}
                assert not {Op.POSITIVE, Op.NEGATIVE} & skipped
                after = [one.op for _, one, _ in way[k + 1 :] if one.op in OPS_OF_MQ]
                assert not OPS_OF_MQ & skipped or after[0] == Op.TO_MQ  # which sets it, and does not use it
            assert item.op != Op.OUT or begin % 2 == 0
