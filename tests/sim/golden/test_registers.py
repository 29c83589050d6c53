"""The golden bank on a shaft that turns backwards by a count in every tick: what it answers can be told by hand.

A tick has ten clocks. The level that makes count k is sampled in clock 10·k + 4, so that window k contains it. The
tick is in clock 10·k + 11, and its update a clock later.
"""

import numpy as np
import pytest

from tachometry.sim.golden.registers import Access, GoldenBank, written
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import of_texts
from tachometry.spec.language.field import Field
from tachometry.spec.registers.map import RegisterMap

CORE = {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "40clk", "frac-bits": "4", "max-speed": "1e6rad/s"}
COUNTS = 400
LAST_WORD = (1 << 32) - 1


def pins(n_counts: int = COUNTS, z: tuple[int, ...] = (), n_clocks: int = 10 * COUNTS + 20) -> PinTrace:
    """Return lines that turn backwards, and an index line that changes in clocks 5 after a count."""
    quarter = np.minimum(np.arange(2 * n_clocks // 10), 2 * n_counts)
    clock = np.append(0, 4 + 5 * np.arange(len(quarter) - 1))
    level = quadrature(-((quarter + 1) // 2))
    index = np.isin(quarter, z).cumsum() % 2
    a, b = level & np.uint8(1), level >> np.uint8(1)
    return PinTrace(clock, a, b, n_clocks, index.astype(np.uint8))


class Bank:
    """A bank, asked by the names of registers."""

    def __init__(self, trace: PinTrace, method: str = "m", **texts: str) -> None:
        spec = of_texts(method, CORE | {name.replace("_", "-"): text for name, text in texts.items()})
        self.map = RegisterMap(spec)
        self.bank = GoldenBank(self.map, trace)

    def ask(self, *asked: tuple[int, str, int | None], captures: tuple[int, ...] = ()) -> list[int | None]:
        """Return what accesses read; each is its clock, the register, and what is written or None."""
        accesses = [Access(clock, self.map[name].offset // 4, data) for clock, name, data in asked]
        answers = self.bank.answers(accesses, captures)
        assert not any(error for _, error in answers)
        return [data for data, _ in answers]

    def at(self, clock: int, *names: str) -> list[int | None]:
        """Return what registers show of one clock, in which the input captures."""
        return self.ask((0, "CONTROL", 2), *((clock + 1, name, None) for name in names), captures=(clock,))[1:]

    def flag(self, word: int | None, name: str) -> int:
        """Return a flag of STATUS, or a counter, in what was read."""
        assert word is not None
        register = "COUNTERS" if name in self.map.counted else "STATUS"
        (field,) = (field for field in self.map[register].fields if field.name == name)
        return word >> field.low & (1 << field.width) - 1


def twos(value: int) -> int:
    return value & LAST_WORD


def test_a_capture_shows_the_latest_tick_and_the_latest_update() -> None:
    bank = Bank(pins(), position_width="48", age="yes", bounds="yes")
    names = ("VELOCITY", "PULSE_COUNT", "POSITION_LOW", "POSITION_HIGH", "AGE", "VELOCITY_LOWER", "VELOCITY_UPPER")
    for k in (1, 7, 30):
        whole = [twos(-16), twos(-1), twos(-1 - k), LAST_WORD]
        # The update of tick k comes a clock after it; until then that of the tick before is the latest.
        assert bank.at(10 * k + 11, *names) == [*whole, 1, twos(-32), 0]
        assert bank.at(10 * k + 12, *names) == [*whole, 0, twos(-32), 0]
        assert bank.at(10 * k + 20, *names) == [*whole, 0, twos(-32), 0]
        assert bank.at(10 * k + 10, "POSITION_LOW", "AGE") == [twos(-k), 0]


def test_values_of_two_words() -> None:
    """A position of 48 bits that is not negative has a high word of its own."""
    bank = Bank(pins(0), position_width="48")
    assert bank.at(100, "POSITION_LOW", "POSITION_HIGH") == [0, 0]
    bank = Bank(pins(), velocity_width="40", max_speed="1e3rad/s")
    assert bank.at(100, "VELOCITY_LOW", "VELOCITY_HIGH") == [twos(-16), LAST_WORD]


def test_the_age_is_that_of_the_update_and_stays_at_the_maximum_time() -> None:
    """Rairán has no update after that of rest, which comes with the maximum time, eight ticks."""
    bank = Bank(pins(1), "rairan", age="yes", max_time="80clk")
    rests = 4 + 2 + 80 + 4  # from the level to the count, its maximum time, and to the update
    assert [bank.at(rests + 10 * k + 5, "AGE")[0] for k in (0, 1, 2, 6, 7, 8, 9, 30)] == [0, 1, 2, 6, 7, 8, 8, 8]
    still = Bank(pins(0, n_clocks=900), "s", age="yes", max_time="800clk")
    assert [still.at(10 * k + 20, "AGE")[0] for k in (0, 3, 70, 78)] == [1, 4, 71, 79]  # from reset


def test_before_the_first_update_only_the_velocity_is_defined() -> None:
    """The first update is in clock 12; a value of a tick is 0 before the first tick, and defined all the same."""
    bank = Bank(pins(), bounds="yes", age="yes", average="2")
    names = ("VELOCITY", "VELOCITY_LOWER", "VELOCITY_UPPER", "PULSE_COUNT", "AGE")
    first = 11 + bank.map.spec.latency.datapath
    assert bank.at(10, *names) == [0, None, None, 0, 0]
    assert bank.at(first - 1, *names) == [0, None, None, twos(-1), 1]
    assert bank.at(first, *names) == [twos(-8), twos(-16), 0, twos(-1), 0]
    assert bank.ask((first + 3, "VELOCITY_LOWER", None)) == [0]  # nothing has been captured
    still = Bank(pins(0, n_clocks=30), "t", bounds="yes")
    assert still.at(28, "VELOCITY_UPPER", "PULSE_COUNT") == [None, 0]
    one = Bank(pins(1, n_clocks=30), bounds="yes")
    assert one.at(20, "VELOCITY_UPPER") == [0]
    alone = Bank(pins(1, n_clocks=20), bounds="yes")
    assert alone.at(11, "VELOCITY_UPPER") == [None]
    assert alone.at(12, "VELOCITY_UPPER") == [0]


def test_flags_of_events_are_of_the_time_since_the_capture_before() -> None:
    """Updates are in clocks 12, 22, …; the index rises in clock 29 of the pins, and its strobe comes four later."""
    bank = Bank(pins(z=(6, 8)), index="yes", index_at="edge", average="2")  # whose interval is no flag
    clocks = [10, 11, 12, 13, 21, 22, 23, 32, 33, 34, 45]
    asked = [(clock, "VELOCITY" if not part else "STATUS", None) for clock in clocks for part in (0, 1)]
    words = bank.ask(*asked)[1::2]
    rise = int(pins(z=(6, 8)).clock[6]) + 4
    assert rise == 33
    assert [bank.flag(word, "updated") for word in words] == [0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1]
    assert [bank.flag(word, "indexed") for word in words] == [0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0]
    assert bank.at(rise, "INDEX_POSITION") == [twos(-3)]
    assert bank.at(rise - 1, "INDEX_POSITION") == [0]


def test_updates_are_lost_that_no_capture_has_shown() -> None:
    """An update is lost when the next one comes before a capture."""
    bank = Bank(pins())

    def lost(clock: int, captures: tuple[int, ...] = (), cleared: int | None = None) -> int:
        clear = [] if cleared is None else [(cleared, "CONTROL", 1)]
        return bank.flag(bank.ask(*clear, (clock, "COUNTERS", None), captures=captures)[-1], "lost_updates")

    assert [lost(clock) for clock in (11, 12, 21, 22, 31, 32, 42, 102)] == [0, 0, 0, 1, 1, 2, 3, 9]
    # A capture in the clock of an update shows it; in the clock before, it shows the one before.
    assert [lost(102, (clock,)) for clock in (11, 12, 21, 22, 31, 32)] == [9, 8, 8, 8, 8, 8]
    assert lost(102, (12, 22, 32, 42)) == 5
    assert lost(102, (12, 13, 14)) == 8
    # Cleared in the clock in which one is lost, or later.
    assert [lost(102, cleared=clock) for clock in (11, 21, 22, 31, 32, 92, 101)] == [9, 9, 8, 8, 7, 1, 1]
    assert [lost(10 * n + 2) for n in (255, 256, 257, 258, 400)] == [254, 255, 255, 255, 255]


def test_errors_of_both_lines_are_counted_and_stay_at_255() -> None:
    n_clocks = 4000
    both = (np.arange(n_clocks) // 5 % 2).astype(np.uint8)
    bank = Bank(PinTrace(np.arange(n_clocks), both, both, n_clocks))
    # The first change is sampled in clock 5, and decoded two clocks later.
    counts = [bank.flag(bank.ask((clock, "COUNTERS", None))[0], "decode_errors") for clock in (6, 7, 11, 12, 17, 3999)]
    assert counts == [0, 1, 1, 2, 3, 255]
    cleared = bank.ask((12, "CONTROL", 1), (13, "COUNTERS", None), (17, "COUNTERS", None))
    assert [bank.flag(word, "decode_errors") for word in cleared[1:]] == [0, 1]


@pytest.mark.parametrize("name", ["overflows", "tick_errors"])
def test_other_errors(name: str) -> None:
    """More than a count in each tick; and external ticks that never come, of 20 clocks at most."""
    n_clocks = 200
    level = quadrature(np.arange(n_clocks // 2))
    trace = PinTrace(2 * np.arange(len(level)), level & np.uint8(1), level >> np.uint8(1), n_clocks)
    if name == "overflows":
        # 2π·1 MHz/(32·10) is one count a tick.
        bank, clocks = Bank(trace, max_speed="19634rad/s"), [10, 11, 20, 21, 101]
        wanted = [0, 1, 1, 2, 10]
    else:
        trace = trace.with_tick_in(np.empty(0, dtype=np.int64))
        bank, clocks, wanted = Bank(trace, external_tick="yes"), [20, 21, 40, 41, 101], [0, 1, 1, 2, 5]
    assert [bank.flag(bank.ask((clock, "COUNTERS", None))[0], name) for clock in clocks] == wanted


def test_swallowed_edges_are_two_for_each_glitch_since_they_were_cleared() -> None:
    """A glitch of a clock every five, which goes back in clocks 11, 16, …, and is counted three clocks later."""
    n_clocks = 200_000
    high = np.arange(10, n_clocks, 5)
    a = np.zeros(n_clocks, dtype=np.uint8)
    a[high] = 1
    bank = Bank(PinTrace(np.arange(n_clocks), a, np.zeros_like(a), n_clocks), filter="3")
    for clock, wanted in ((13, 0), (14, 2), (18, 2), (19, 4), (114, 42), (150_000, 59_996), (199_000, 65_534)):
        assert bank.at(clock, "FILTERED_EDGES") == [wanted], clock
    assert bank.at(11 + 5 * 32_766 + 2, "FILTERED_EDGES") == [65_532]
    assert bank.at(11 + 5 * 32_766 + 3, "FILTERED_EDGES") == [65_534]
    # The counter is set to 0 in the clock after the write.
    for cleared, wanted in ((14, 2), (13, 2), (12, 4), (18, 0), (19, 0)):
        found = bank.ask((cleared, "CONTROL", 1), (24, "FILTERED_EDGES", None), captures=(23,))
        assert found[1] == wanted, cleared


def test_reading_the_velocity_captures_unless_it_is_held() -> None:
    bank = Bank(pins())
    position = "POSITION"
    assert bank.ask((50, position, None)) == [0]
    assert bank.ask((50, "VELOCITY", None), (90, position, None)) == [twos(-16), twos(-4)]
    assert bank.ask((50, "CONTROL", 2), (60, "VELOCITY", None), (61, position, None)) == [0, 0, 0]
    assert bank.ask((50, "CONTROL", 2), (60, position, None), captures=(55,))[1] == twos(-5)
    assert bank.ask((50, "CONTROL", 2), (55, "CONTROL", None), (57, "CONTROL", 0), (58, "CONTROL", None))[1::2] == [
        2,
        0,
    ]
    # A capture in the clock of the access comes first; one after it is not seen.
    assert bank.ask((61, position, None), captures=(61,)) == [twos(-6)]
    assert bank.ask((61, position, None), captures=(62,)) == [0]
    assert bank.ask((65, position, None), (75, position, None), captures=(71, 61)) == [twos(-6), twos(-7)]
    assert bank.ask((50, "VELOCITY", None), (80, position, None), captures=(61, 71)) == [twos(-16), twos(-7)]


def test_accesses_that_are_errors() -> None:
    bank = Bank(pins()).bank
    words = len(Bank(pins()).map.registers)
    asked = [Access(5, words - 1), Access(6, words), Access(7, words, 1), Access(8, 4, 1), Access(9, 2, 0)]
    assert bank.answers(asked) == [(0, False), (0, True), (0, True), (0, True), (0, False)]


def test_constants() -> None:
    bank = Bank(pins())
    assert bank.ask((5, "IDENTIFICATION", None), (6, "CONFIGURATION", None)) == [
        int.from_bytes(b"TACH", "big"),
        bank.map.configuration,
    ]


def test_two_that_capture_in_one_clock_are_one_capture() -> None:
    bank = Bank(pins())
    status = bank.ask((0, "CONTROL", 2), (81, "STATUS", None), captures=(61, 80, 80))[1]
    assert bank.flag(status, "updated") == 1


@pytest.mark.parametrize(("data", "taken"), [(0x4000_0000, 127), (0x7FFF_FFFF, 127), (0x8000_0000, -128), (5, 5)])
def test_what_is_written_is_held_within_the_range_of_its_field(data: int, taken: int) -> None:
    field = Field("value", 32, bits=8, signed=True, least=-128, most=127, writable=True, port="x")
    assert written(field, data, 0) == taken
