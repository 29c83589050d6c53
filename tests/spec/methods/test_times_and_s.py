"""Times and widths of T, M/T and S, by small numbers that can be told by hand."""

from fractions import Fraction
from typing import Any

import pytest

from tachometry.spec import Encoder, MTTachometer, Speed, STachometer, Timing, TTachometer
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal
from tachometry.spec.formats.reciprocal import DividedReciprocal, NarrowReciprocal, Reciprocal


def timing(tick: int, max_ticks: int) -> Timing:
    return Timing(1_000_000, tick, max_ticks)


def t(tick: int = 20, max_ticks: int = 10, **options: Any) -> TTachometer:
    return TTachometer(encoder=Encoder(8), timing=timing(tick, max_ticks), **({"frac_bits": 4} | options))


def mt(tick: int = 20, max_ticks: int = 10, **options: Any) -> MTTachometer:
    return MTTachometer(encoder=Encoder(8), timing=timing(tick, max_ticks), **({"frac_bits": 4} | options))


def s(tick: int = 20, max_ticks: int = 10, **options: Any) -> STachometer:
    return STachometer(encoder=Encoder(8), timing=timing(tick, max_ticks), **({"frac_bits": 4} | options))


def test_a_division_takes_a_clock_a_digit_its_sign_included_and_one_for_the_dividend() -> None:
    """By default 28 clocks, as docs/concepts/timed.md says: 960 counts a tick are 10 bits, and 16 follow."""
    assert [one(encoder=Encoder(500)).division_clocks for one in (TTachometer, MTTachometer)] == [28, 28]
    # Twenty counts have 5 bits; on the lattice T has one count a tick, and M/T twenty.
    assert [t().division_clocks, mt().division_clocks] == [5 + 4 + 2] * 2
    assert [t(timer="tick").division_clocks, mt(timer="tick").division_clocks] == [1 + 4 + 2, 5 + 4 + 2]
    assert t().datapath_latency == 11 + 1
    # A bound may be 41 counts.
    assert t(bounds=True).division_clocks == 6 + 4 + 2
    # Of a greatest speed of one count, and one of four, there is one digit more; 16 counts have as many as 20.
    fast = {n: Speed(Fraction(n * 1_000_000, 20 * 32), "rev/s") for n in (1, 4, 16)}  # counts in a tick
    assert [t(max_speed=speed).max_count for speed in fast.values()] == [1, 4, 16]
    assert [t(max_speed=speed).division_clocks for speed in fast.values()] == [1 + 1 + 4 + 2, 3 + 1 + 4 + 2, 11]
    assert t(max_speed=fast[1], bounds=True).division_clocks == 6 + 4 + 2


def test_a_distance_has_as_many_bits_as_a_time_and_a_quotient_together_and_a_sign() -> None:
    """200 clocks have 8 bits, and 20 counts have 5; ten ticks of the lattice have 4."""
    assert [one.distance_width for one in (t(), mt(), t(timer="tick"))] == [8 + 5 + 1, 8 + 5 + 1, 4 + 1 + 1]
    assert t(bounds=True).distance_width == 8 + 6 + 1


def test_updates_are_a_division_apart() -> None:
    """On the lattice they come with ticks: a division of 11 clocks takes two ticks of 10, one of 11."""
    assert [t().update_spacing, mt().update_spacing] == [11, 11]
    assert [mt(tick, timer="tick").update_spacing for tick in (16, 11, 9, 6)] == [16, 11, 18, 12]
    assert [mt(tick, timer="tick").division_clocks for tick in (16, 11, 9, 6)] == [11, 10, 10, 9]
    assert t(timer="tick", max_tick_cycles=40).update_spacing == 7


def test_the_maximum_time_is_a_division_at_least() -> None:
    assert [t(20, 10).max_periods, t(2, 2, frac_bits=4).max_periods] == [200, 2 + 4 + 2]
    assert [mt(20, 10, timer="tick").max_periods, mt(4, 2, timer="tick").max_periods] == [10, 3]
    assert [mt(4, 2, timer="tick").division_clocks, mt(4, 2, timer="tick").division_periods] == [9, 3]
    short = t(3, 2)
    assert (short.division_clocks, short.max_time_cycles, short.standstill_ticks) == (8, 8, 3)
    assert (mt(4, 2, timer="tick").max_time_cycles, mt(4, 2, timer="tick").standstill_ticks) == (12, 3)
    assert t(20, 10).notes == ()
    assert short.notes == ("maximum time raised from 6 clocks to 8: a division takes 8",)


def test_the_minimum_time() -> None:
    """A tick by default; a measurement that is longer than B − 1 finds the divider free."""
    assert [mt().min_periods, mt(min_time=77).min_periods, mt(min_time=3).min_periods] == [20, 77, 10]
    assert [mt(timer="tick").min_periods, mt(timer="tick", min_time=60).min_periods] == [1, 3]
    assert mt(3, 9, timer="tick").min_periods == 2  # eight clocks are three ticks
    assert [mt(min_time=77).min_time_cycles, mt(timer="tick", min_time=60).min_time_cycles] == [77, 60]
    assert mt(min_time=77).parameters["min_time"] == 77
    assert mt().parameters["min_time"] == 20
    assert mt(min_time=3).notes == ("minimum time raised from 3 clocks to 10: a division takes 11",)
    for wrong, message in ((0, "from 1 to 200 clocks"), (201, "from 1 to 200 clocks")):
        with pytest.raises(ValueError, match=f"^min_time must be {message}, the maximum time, not {wrong}$"):
            mt(min_time=wrong)
    assert [mt(min_time=one).min_time for one in (1, 200)] == [1, 200]
    with pytest.raises(ValueError, match=r"^min_time must be a multiple of 20 clocks with times in ticks, not 30$"):
        mt(timer="tick", min_time=30)


def test_the_longest_measurement() -> None:
    """T: a maximum time. M/T: the count that closes comes a maximum time after T_c at most; or a late division."""
    assert [t().max_interval, t().interval_width] == [200, 8]
    assert [mt().max_interval, mt(min_time=77).max_interval] == [220, 277]
    assert [mt(timer="tick").max_interval, mt(timer="tick", max_tick_cycles=20).max_interval] == [1 + 10, 6 + 10]
    # With whole cycles it comes after twice T_c; at x1 each count is one.
    assert mt(whole_cycles=True, min_time=77).max_interval == 2 * 77 + 200
    assert [(one.cycle_counts, one.patient_periods) for one in (mt(), mt(whole_cycles=True))] == [(1, 20), (4, 40)]
    x1 = MTTachometer(encoder=Encoder(8, 1), timing=timing(20, 10), frac_bits=4, whole_cycles=True)
    assert (x1.cycle_counts, x1.max_interval) == (1, 220)
    assert [one.may_be_late for one in (mt(), mt(timer="tick"), mt(max_tick_cycles=40))] == [False] * 3
    assert mt(timer="tick", max_tick_cycles=20).may_be_late
    assert [one.interval_unit_cycles for one in (t(), t(timer="tick"))] == [1, 20]


def test_what_is_remembered() -> None:
    """T: the time since the last count, which may wrap, and that to the next; then a division.

    It begins with the dividend, and ends a clock behind a counter of 16 or 8 clocks, for the 9 or 5 digits.
    """
    assert [t().quotient_bits, t(timer="tick").quotient_bits] == [9, 5]
    assert t().remembered_clocks == (256 + 200 + 1) + 1 + 16 + 1
    assert t(timer="tick").remembered_clocks == (16 + 10 + 1) * 20 + 1 + 8 + 1
    assert t(timer="tick", max_tick_cycles=30).remembered_clocks == (16 + 10 + 1) * 30 + 1 + 8 + 1
    assert mt().remembered_clocks == (256 + 200 + 220 + 2) + 1 + 16 + 1


def test_speeds_beyond_the_range() -> None:
    """Two counts can be a clock apart; T counts one in a tick of the lattice, M/T all that there are."""
    slow: dict[str, Any] = {"max_speed": Speed(Fraction(1000), "rev/s")}  # 32 counts a ms: one in 20 clocks
    assert [one.max_count for one in (t(**slow), t())] == [1, 20]
    assert [one.flags_range for one in (t(), t(**slow), mt(), mt(**slow))] == [False, True, False, True]
    assert [one.flags_range for one in (t(timer="tick"), mt(timer="tick"), mt(timer="tick", **slow))] == [
        *(True, False, False)
    ]
    assert [len(one.method_ports) for one in (t(), t(**slow))] == [0, 1]
    assert [one.max_velocity for one in (t(), t(timer="tick"), mt(timer="tick"))] == [20, 1, 20]


def test_bounds_of_times() -> None:
    """Distance over a time that is one shorter: twice the quotient; a count more at reversals; and the edge error."""
    assert [one.max_bound for one in (t(), t(timer="tick"), mt(timer="tick"))] == [41, 3, 41]
    off: dict[str, Any] = {"bounds": True, "edge_error": Fraction(1, 8)}
    assert [one.max_bound for one in (t(**off), t(timer="tick", **off))] == [41 + 3, 3 + 1]
    wide = t(**off)
    assert (wide.bound_width, wide.absent_bound) == (7 + 4, 2**10 - 1)


@pytest.mark.parametrize("made", [t, mt])
def test_the_paper_alone_neither_decays_nor_has_bounds(made: Any) -> None:
    assert [made().decays, made(bound_decay=False).decays, made(paper_exact=True).decays] == [True, False, False]
    assert [made(paper_exact=True).parameters["bound_decay"], made().parameters["bound_decay"]] == [False, True]
    for wrong, message in (
        ({"bounds": True, "paper_exact": True}, "bounds must not be given with paper_exact, which has none"),
        ({"timer": "hour"}, "timer must be clock or tick, not 'hour'"),
    ):
        with pytest.raises(ValueError, match=f"^{message}$"):
            made(**wrong)
    assert made(bounds=True).bounds


def test_equations() -> None:
    assert [t().description, mt(timer="tick").description] == ["eq. (9), times in clocks", "eq. (13), times in ticks"]
    assert [s().description[:8], s(cancel=False).description] == ["eq. (21)", "eq. (17)"]
    assert [s().heading, s(cancel=False).heading] == ["S method, eq. (21)", "S method, eq. (17)"]


def test_the_numerator_of_s() -> None:
    """N = d0 + d1 of eq. (21) is of half counts, d1 of eq. (17) of counts; d is twice the greatest m_e at most."""
    assert [s().max_numerator, s(cancel=False).max_numerator] == [80, 40]
    # With bounds a count more or less, and the edge error: eighths of a count are needed for ⅜.
    for eighths, parts in ((0, 2), (4, 2), (2, 4), (3, 8)):
        spec = s(bounds=True, edge_error=Fraction(eighths, 8))
        assert spec.numerator_per_count == parts
        assert spec.max_numerator == 40 * parts + (8 + eighths) * parts // 8
    plain = s(bounds=True, cancel=False, edge_error=Fraction(3, 8))
    assert (plain.numerator_per_count, plain.max_numerator) == (8, 331)
    assert (s(bounds=True, cancel=False).numerator_per_count, s(bounds=True, cancel=False).max_numerator) == (1, 41)


def kind(spec: STachometer) -> type:
    return type(spec.reciprocal)


def test_the_reciprocal_of_s() -> None:
    """Divided where a tick leaves the time, or from a table of up to 2048 ticks; otherwise it is carried along."""
    assert [kind(s(tick)) for tick in (960, 19, 18, 7, 6, 1)] == [
        *(
            DividedReciprocal,
            DividedReciprocal,
            NarrowReciprocal,
            NarrowReciprocal,
            CarriedReciprocal,
            CarriedReciprocal,
        )
    ]
    assert [kind(s(tick, reciprocal_source="table")) for tick in (960, 7, 6)] == [
        NarrowReciprocal,
        NarrowReciprocal,
        CarriedReciprocal,
    ]
    # Ties and bounds take a general one.
    assert [kind(s(18, ticks)) for ticks in (15, 16)] == [NarrowReciprocal, Reciprocal]
    assert kind(s(18, bounds=True)) is Reciprocal
    assert [kind(s(960, ticks, reciprocal_source="table")) for ticks in (2048, 2049)] == [Reciprocal, DividedReciprocal]
    assert kind(s(18, 2049)) is CarriedReciprocal
    assert s(1, 5001).reciprocal.entry == 2501  # type: ignore[union-attr]
    assert [one.memory and one.memory[:2] for one in (s(960), s(18), s(1, 5000))] == [
        *(None, ("table", 16), ("table and carried on", 4))
    ]


def test_what_is_told_of_the_reciprocal() -> None:
    assert [one.division for one in (s(18), s(19))] == ["", "divided in 13 clocks between two ticks"]
    # 11 + 16 bits of the velocity, and 22 behind them.
    wide = STachometer(encoder=Encoder(500), timing=Timing(48_000_000, 960, 500))
    assert wide.division == "divided in 38 clocks between two ticks; two adders for sums of 49 bits"
    assert [
        one.notes for one in (s(19), s(18, reciprocal_source="table"), s(960, 2048, reciprocal_source="table"))
    ] == [()] * 3
    short = "a tick of {} is too short to divide between two"
    assert s(18).notes == (f"reciprocal from a table: {short.format('18 clocks')}",)
    assert s(1, reciprocal_source="table").notes == (
        f"reciprocal carried along: {short.format('1 clock')}, or to look it up",
    )
    assert s(18, 2049).notes == (
        f"reciprocal carried along: {short.format('18 clocks')}, and a table has at most 2048 entries",
    )
    assert s(960, 2049, reciprocal_source="table").notes == ("reciprocal divided: a table has at most 2048 entries",)
    with pytest.raises(ValueError, match=r"^reciprocal must be serial or table, not 'none'$"):
        s(reciprocal_source="none")


def test_latencies_of_s() -> None:
    """80 has 7 bits, so N has 8: four digits, one clock each, and one to start."""
    assert [s(tick).serial for tick in (7, 18)] == [True, True]
    assert [s(6).serial, s(18, 2049).serial] == [False, False]
    assert [s(18).datapath_latency, s(7).datapath_latency, s(19).datapath_latency] == [4 + 1, 3 + 1, 4 + 1]
    # A table takes three clocks more: m_s, the table, its register. A division one for every bit, and one to begin.
    assert [s(18).busy_clocks, s(19).busy_clocks] == [5 + 3, 5 + 1 + 13]
    # One for each bit of N and each digit of N·R/m, and one each for the table, its register, and to round.
    fast = s(1, 5000)
    assert (fast.max_numerator, fast.datapath_latency) == (4, 4 + 2 + 3)
    # What saturates has two registers of its own.
    slow: dict[str, Any] = {"max_speed": Speed(Fraction(1000), "rev/s")}
    assert [one.tick_latency for one in (s(), s(**slow), s(1, **slow), t(), t(**slow))] == [2, 4, 2, 2, 2]


def test_windows_of_s() -> None:
    """A forced update keeps the newer half. The next one does not contain the last count any more."""
    assert [s(20, ticks).kept_ticks for ticks in (2, 3, 10, 11)] == [1, 1, 5, 5]
    assert [s(20, ticks).standstill_ticks for ticks in (2, 3, 10, 11)] == [3, 5, 15, 17]
    assert s(20, 10).remembered_clocks == (16 + 10 + 1) * 20
    assert s(20, 10, max_tick_cycles=30).remembered_clocks == (16 + 10 + 1) * 30


@pytest.mark.parametrize("made", [TTachometer, MTTachometer, STachometer])
def test_a_unit_takes_one_adder_where_it_is_a_sum_of_more_than_two(made: Any) -> None:
    """At 2^20 Hz, 32 clocks a tick and 32 counts a revolution, a count a tick is 1024 rev/s, or (64 − 4)·1024 rpm."""
    seldom = Timing(1 << 20, 32, 10)
    specs = {
        unit: made(encoder=Encoder(8), timing=seldom, unit=unit, frac_bits=-4) for unit in ("rev/s", "rpm", "rad/s")
    }
    digits = {unit: len(spec.output.digits) for unit, spec in specs.items()}
    assert (digits["rev/s"], digits["rpm"]) == (1, 2)
    assert digits["rad/s"] > 2
    assert {unit: spec.output_serial for unit, spec in specs.items()} == {
        "rev/s": False,
        "rpm": False,
        "rad/s": specs["rad/s"].output.serial_latency <= specs["rad/s"].update_spacing,
    }
    assert specs["rad/s"].output_serial


@pytest.mark.parametrize("made", [TTachometer, MTTachometer])
def test_a_digit_more_for_one_adder(made: Any) -> None:
    """With a greatest speed of a count a tick, too: its digit, one that shows that it is exceeded, and that one."""
    fast = Speed.parse("1024rev/s")
    spec = made(encoder=Encoder(8), timing=Timing(1 << 20, 32, 10), unit="rad/s", frac_bits=2, max_speed=fast)
    assert spec.max_count == 1
    assert spec.quotient_bits == 1 + 1 + spec.native_frac_bits + 1
    assert spec.output_serial
    # A sum of three, too: 20 counts have five bits, and six follow.
    three = made(encoder=Encoder(13), timing=Timing(1 << 20, 20, 10), unit="rev/s", frac_bits=-6)
    assert (len(three.output.digits), three.native_frac_bits, three.quotient_bits) == (3, 6, 5 + 6 + 2)
    assert three.output_serial
