"""The self-test: it notices every wrong bit."""

from collections.abc import Callable
from functools import cache
from itertools import count
from typing import Any

import pytest
from support.demo import compiled, demo_map, manifest_of

from tachometry.boards.host.demo import DemoBoard
from tachometry.boards.host.link import NoAnswer
from tachometry.boards.monitor import selftest
from tachometry.boards.monitor.selftest import Result
from tachometry.spec.registers.frames import TELEMETRY_HEADER

STEP = 6000  # clocks of a look at the port


class Line:
    """The compiled board at a line that can lose what it sends."""

    def __init__(self) -> None:
        self.board, self.sent = compiled(), b""
        self.damage: Callable[[bytes], bytes] = lambda data: data

    def write(self, data: bytes, /) -> None:
        self.sent += data

    def read(self, size: int = 1, /) -> bytes:
        found, self.sent = self.board.run(STEP, self.sent)
        return self.damage(found)


@cache
def seen() -> dict[str, tuple[Any, ...]]:
    """Return what each step is given to compare, by the names of the steps; damaged telemetry is no difference."""
    found: dict[str, tuple[Any, ...]] = {}
    line, pieces = Line(), count(1)

    def damage(data: bytes) -> bytes:
        return data[1:] if next(pieces) % 7 == 0 and data[:1] and data[0] >> 4 == TELEMETRY_HEADER >> 4 else data

    line.damage = damage
    board = DemoBoard(line, manifest_of(demo_map()))
    right = selftest._compared

    def compared(*given: Any) -> Result:
        found[given[1]] = given
        return right(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(selftest, "_compared", compared)
        results = selftest.selftest(board, demo_map())
    assert [result.name for result in results] == [step.name for step in selftest.steps(demo_map())] == [*found]
    assert all(result.passed for result in results), results
    assert board.link.receiver.counts.lost > 0
    assert min(result.frames for result in results) >= 15
    return found


def changed(step: str, frame: int, word: int, bit: int) -> Result:
    registers, name, changes, cleared, words, counted, period = seen()[step]
    wrong = [list(one) for one in words]
    wrong[frame][word] ^= 1 << bit
    found: Result = selftest._compared(registers, name, changes, cleared, [*map(tuple, wrong)], counted, period)
    return found


CAPTURED = [register.name for register in demo_map() if register.captured]


def check_wrong_bits() -> None:
    """Of any register but the time, in one frame or another."""
    for word, name in enumerate(CAPTURED):
        if name != "TIME":
            assert not changed("a bad encoder", 1 + word % 3, word, word % 3).passed, name


def check_errors() -> None:
    """The counter of illegal transitions."""
    registers, name, changes, cleared, words, counted, period = seen()["illegal edges"]
    assert counted[0] == 3
    for wrong in (2, 4):
        assert not selftest._compared(registers, name, changes, cleared, words, (wrong, counted[1]), period).passed


def check_changes() -> None:
    """A board that does not do what it is told."""
    registers, name, changes, cleared, words, counted, period = seen()["reversals"]
    assert len(changes) == 3
    assert not selftest._compared(registers, name, changes[:2], cleared, words, counted, period).passed


CHECKS = [check_wrong_bits, check_errors, check_changes]


@pytest.mark.parametrize("check", CHECKS)
def test_what_is_wrong_is_noticed(check: Callable[[], None]) -> None:
    check()


def test_a_board_that_shows_another_speed_fails() -> None:
    """The words of one step are not those of another."""
    fast, slow = seen()["speed +1 of the highest"], seen()["speed -0.5 of the highest"]
    registers, name, changes, cleared, _, counted, period = fast
    assert not selftest._compared(registers, name, changes, cleared, slow[4], counted, period).passed


def test_frames_that_are_lost_are_no_difference() -> None:
    for registers, name, changes, cleared, words, counted, period in seen().values():
        kept = [one for number, one in enumerate(words) if number % 5]
        assert selftest._compared(registers, name, changes, cleared, kept, counted, period).passed


def test_nothing_to_compare_is_no_success() -> None:
    assert not Result("step", 0, 0).passed


def test_a_board_that_falls_silent_ends_it() -> None:
    line = Line()
    board = DemoBoard(line, manifest_of(demo_map()), timeout=0.001)
    line.damage = lambda data: b""
    with pytest.raises(NoAnswer):
        selftest.selftest(board, demo_map())
