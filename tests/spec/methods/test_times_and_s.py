"""Times and widths of T, M/T and S, by small numbers that can be told by hand."""

from fractions import Fraction
from typing import Any

import pytest

from tachometry.spec import Encoder, MTachometer, MTTachometer, Speed, STachometer, Timing, TTachometer
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
    assert [one(encoder=Encoder(500)).form.division_clocks for one in (TTachometer, MTTachometer)] == [28, 28]
    # Twenty counts have 5 bits; on the lattice T has one count a tick, and M/T twenty.
    assert [t().form.division_clocks, mt().form.division_clocks] == [5 + 4 + 2] * 2
    assert [t(timer="tick").form.division_clocks, mt(timer="tick").form.division_clocks] == [1 + 4 + 2, 5 + 4 + 2]
    assert t().latency.datapath == 11 + 1
    # A bound may be 41 counts.
    assert t(bounds=True).form.division_clocks == 6 + 4 + 2
    # Of a greatest speed of one count, and one of four, there is one digit more; 16 counts have as many as 20.
    fast = {n: Speed(Fraction(n * 1_000_000, 20 * 32), "rev/s") for n in (1, 4, 16)}  # counts in a tick
    assert [t(max_speed=speed).tick.max_count for speed in fast.values()] == [1, 4, 16]
    assert [t(max_speed=speed).form.division_clocks for speed in fast.values()] == [1 + 1 + 4 + 2, 3 + 1 + 4 + 2, 11]
    assert t(max_speed=fast[1], bounds=True).form.division_clocks == 6 + 4 + 2


def test_a_distance_has_as_many_bits_as_a_time_and_a_quotient_together_and_a_sign() -> None:
    """200 clocks have 8 bits, and 20 counts have 5; ten ticks of the lattice have 4."""
    assert [one.form.distance_width for one in (t(), mt(), t(timer="tick"))] == [8 + 5 + 1, 8 + 5 + 1, 4 + 1 + 1]
    assert t(bounds=True).form.distance_width == 8 + 6 + 1


def test_updates_are_a_division_apart() -> None:
    """On the lattice they come with ticks: a division of 11 clocks takes two ticks of 10, one of 11."""
    assert [t().times.update_spacing, mt().times.update_spacing] == [11, 11]
    assert [mt(tick, timer="tick").times.update_spacing for tick in (16, 11, 9, 6)] == [16, 11, 18, 12]
    assert [mt(tick, timer="tick").form.division_clocks for tick in (16, 11, 9, 6)] == [11, 10, 10, 9]
    assert t(timer="tick", external_tick=True, max_tick_cycles=40).times.update_spacing == 7


def test_the_maximum_time_is_a_division_at_least() -> None:
    assert [t(20, 10).form.max_periods, t(2, 2, frac_bits=4).form.max_periods] == [200, 2 + 4 + 2]
    assert [mt(20, 10, timer="tick").form.max_periods, mt(4, 2, timer="tick").form.max_periods] == [10, 3]
    assert [mt(4, 2, timer="tick").form.division_clocks, mt(4, 2, timer="tick").form.division_periods] == [9, 3]
    short = t(3, 2)
    assert (short.form.division_clocks, short.times.longest, short.times.standstill_ticks) == (8, 8, 3)
    assert (mt(4, 2, timer="tick").times.longest, mt(4, 2, timer="tick").times.standstill_ticks) == (12, 3)
    assert t(20, 10).words.notes == ()
    assert short.words.notes == ("maximum time raised from 6 clocks to 8: a division takes 8",)


def test_the_minimum_time() -> None:
    """A tick by default; a measurement that is longer than B − 1 finds the divider free."""
    assert [mt().form.min_periods, mt(min_time=77).form.min_periods, mt(min_time=3).form.min_periods] == [20, 77, 10]
    assert [mt(timer="tick").form.min_periods, mt(timer="tick", min_time=60).form.min_periods] == [1, 3]
    assert mt(3, 9, timer="tick").form.min_periods == 2  # eight clocks are three ticks
    assert [mt(min_time=77).times.shortest, mt(timer="tick", min_time=60).times.shortest] == [77, 60]
    assert mt(min_time=77).parameters["min_time"] == 77
    assert mt().parameters["min_time"] == 20
    assert mt(min_time=3).words.notes == ("minimum time raised from 3 clocks to 10: a division takes 11",)
    for wrong, message in ((0, "from 1 to 200 clocks"), (201, "from 1 to 200 clocks")):
        with pytest.raises(ValueError, match=f"^min_time must be {message}, the maximum time, not {wrong}$"):
            mt(min_time=wrong)
    assert [mt(min_time=one).min_time for one in (1, 200)] == [1, 200]
    with pytest.raises(ValueError, match=r"^min_time must be a multiple of 20 clocks with times in ticks, not 30$"):
        mt(timer="tick", min_time=30)


def test_the_longest_measurement() -> None:
    """T: a maximum time. M/T: the count that closes comes a maximum time after T_c at most; or a late division."""
    assert [t().form.max_interval, t().widths.interval] == [200, 8]
    assert [mt().form.max_interval, mt(min_time=77).form.max_interval] == [220, 277]
    assert [
        mt(timer="tick").form.max_interval,
        mt(timer="tick", external_tick=True, max_tick_cycles=20).form.max_interval,
    ] == [1 + 10, 6 + 10]
    # With whole cycles it comes after twice T_c; at x1 each count is one.
    assert mt(whole_cycles=True, min_time=77).form.max_interval == 2 * 77 + 200
    assert [(one.form.cycle_counts, one.form.patient_periods) for one in (mt(), mt(whole_cycles=True))] == [
        (1, 20),
        (4, 40),
    ]
    x1 = MTTachometer(encoder=Encoder(8, 1), timing=timing(20, 10), frac_bits=4, whole_cycles=True)
    assert (x1.form.cycle_counts, x1.form.max_interval) == (1, 220)
    assert [one.form.may_be_late for one in (mt(), mt(timer="tick"), mt(external_tick=True, max_tick_cycles=40))] == [
        False
    ] * 3
    assert mt(timer="tick", external_tick=True, max_tick_cycles=20).form.may_be_late
    assert [one.times.interval_unit for one in (t(), t(timer="tick"))] == [1, 20]


def test_what_is_remembered() -> None:
    """T: the time since the last count, which may wrap, and that to the next; then a division.

    It begins with the dividend, and ends a clock behind a counter of 16 or 8 clocks, for the 9 or 5 digits.
    """
    assert [t().form.quotient_bits, t(timer="tick").form.quotient_bits] == [9, 5]
    assert t().recovery.remembered == (256 + 200 + 1) + 1 + 16 + 1
    assert t(timer="tick").recovery.remembered == (16 + 10 + 1) * 20 + 1 + 8 + 1
    assert t(timer="tick", external_tick=True, max_tick_cycles=30).recovery.remembered == (16 + 10 + 1) * 30 + 1 + 8 + 1
    assert mt().recovery.remembered == (256 + 200 + 220 + 2) + 1 + 16 + 1


def test_speeds_beyond_the_range() -> None:
    """Two counts can be a clock apart; T counts one in a tick of the lattice, M/T all that there are."""
    slow: dict[str, Any] = {"max_speed": Speed(Fraction(1000), "rev/s")}  # 32 counts a ms: one in 20 clocks
    assert [one.tick.max_count for one in (t(**slow), t())] == [1, 20]
    assert [one.form.flags_range for one in (t(), t(**slow), mt(), mt(**slow))] == [False, True, False, True]
    assert [one.form.flags_range for one in (t(timer="tick"), mt(timer="tick"), mt(timer="tick", **slow))] == [
        True,
        False,
        False,
    ]
    assert [len(one.method_ports) for one in (t(), t(**slow))] == [0, 1]
    assert [one.velocity.max for one in (t(), t(timer="tick"), mt(timer="tick"))] == [20, 1, 20]


def test_bounds_of_times() -> None:
    """Distance over a time that is one shorter: twice the quotient; a count more at reversals; and the edge error."""
    assert [one.bound.max for one in (t(), t(timer="tick"), mt(timer="tick"))] == [41, 3, 41]
    off: dict[str, Any] = {"bounds": True, "edge_error": Fraction(1, 8)}
    assert [one.bound.max for one in (t(**off), t(timer="tick", **off))] == [41 + 3, 3 + 1]
    wide = t(**off)
    assert (wide.velocity.bound_width, wide.velocity.absent_bound) == (7 + 4, 2**10 - 1)


@pytest.mark.parametrize("made", [t, mt])
def test_the_paper_alone_neither_decays_nor_has_bounds(made: Any) -> None:
    assert [made().form.decays, made(bound_decay=False).form.decays, made(paper_exact=True).form.decays] == [
        True,
        False,
        False,
    ]
    assert [made(paper_exact=True).parameters["bound_decay"], made().parameters["bound_decay"]] == [False, True]
    for wrong, message in (
        ({"bounds": True, "paper_exact": True}, "bounds must not be given with paper_exact, which has none"),
        ({"timer": "hour"}, "timer must be clock or tick, not 'hour'"),
    ):
        with pytest.raises(ValueError, match=f"^{message}$"):
            made(**wrong)
    assert made(bounds=True).bounds


def test_the_numerator_of_s() -> None:
    """N = d0 + d1 of eq. (21) is of half counts, d1 of eq. (17) of counts; d is twice the greatest m_e at most."""
    assert [s().form.max_numerator, s(cancel=False).form.max_numerator] == [80, 40]
    # With bounds a count more or less, and the edge error: eighths of a count are needed for ⅜.
    for eighths, parts in ((0, 2), (4, 2), (2, 4), (3, 8)):
        spec = s(bounds=True, edge_error=Fraction(eighths, 8))
        assert spec.form.numerator_per_count == parts
        assert spec.form.max_numerator == 40 * parts + (8 + eighths) * parts // 8
    plain = s(bounds=True, cancel=False, edge_error=Fraction(3, 8))
    assert (plain.form.numerator_per_count, plain.form.max_numerator) == (8, 331)
    assert (s(bounds=True, cancel=False).form.numerator_per_count, s(bounds=True, cancel=False).form.max_numerator) == (
        1,
        41,
    )


def kind(spec: STachometer) -> type:
    return type(spec.form.reciprocal)


def test_the_reciprocal_of_s() -> None:
    """Divided where a tick leaves the time, or from a table of up to 2048 ticks; otherwise it is carried along."""
    assert [kind(s(tick)) for tick in (960, 19, 18, 7, 6, 1)] == [
        DividedReciprocal,
        DividedReciprocal,
        NarrowReciprocal,
        NarrowReciprocal,
        CarriedReciprocal,
        CarriedReciprocal,
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
    assert s(1, 5001).form.reciprocal.entry == 2501  # type: ignore[union-attr]
    assert [one.words.memory and one.words.memory[:2] for one in (s(960), s(18), s(1, 5000))] == [
        None,
        ("table", 16),
        ("table and carried on", 4),
    ]


def test_what_is_told_of_the_reciprocal() -> None:
    assert [one.words.division for one in (s(18), s(19))] == ["", "divided in 13 clocks between two ticks"]
    # 11 + 16 bits of the velocity, and 22 behind them.
    wide = STachometer(encoder=Encoder(500), timing=Timing(48_000_000, 960, 500))
    assert wide.words.division == "divided in 38 clocks between two ticks; two adders for sums of 49 bits"
    assert [
        one.words.notes for one in (s(19), s(18, reciprocal_source="table"), s(960, 2048, reciprocal_source="table"))
    ] == [()] * 3
    short = "a tick of {} is too short to divide between two"
    assert s(18).words.notes == (f"reciprocal from a table: {short.format('18 clocks')}",)
    assert s(1, reciprocal_source="table").words.notes == (
        f"reciprocal carried along: {short.format('1 clock')}, or to look it up",
    )
    assert s(18, 2049).words.notes == (
        f"reciprocal carried along: {short.format('18 clocks')}, and a table has at most 2048 entries",
    )
    assert s(960, 2049, reciprocal_source="table").words.notes == (
        "reciprocal divided: a table has at most 2048 entries",
    )
    with pytest.raises(ValueError, match=r"^reciprocal must be serial or table, not 'none'$"):
        s(reciprocal_source="none")


@pytest.mark.parametrize("made", [TTachometer, MTTachometer, STachometer])
def test_a_unit_takes_one_adder_where_it_is_a_sum_of_more_than_two(made: Any) -> None:
    """At 2^20 Hz, 32 clocks a tick and 32 counts a revolution, a count a tick is 1024 rev/s, or (64 − 4)·1024 rpm."""
    seldom = Timing(1 << 20, 32, 10)
    specs = {
        unit: made(encoder=Encoder(8), timing=seldom, unit=unit, frac_bits=-4) for unit in ("rev/s", "rpm", "rad/s")
    }
    digits = {unit: len(spec.velocity.output.digits) for unit, spec in specs.items()}
    assert (digits["rev/s"], digits["rpm"]) == (1, 2)
    assert digits["rad/s"] > 2
    assert {unit: spec.latency.output_serial for unit, spec in specs.items()} == {
        "rev/s": False,
        "rpm": False,
        "rad/s": specs["rad/s"].velocity.output.serial_latency <= specs["rad/s"].times.update_spacing,
    }
    assert specs["rad/s"].latency.output_serial


@pytest.mark.parametrize("made", [TTachometer, MTTachometer])
def test_a_digit_more_for_one_adder(made: Any) -> None:
    """With a greatest speed of a count a tick, too: its digit, one that shows that it is exceeded, and that one."""
    fast = Speed.parse("1024rev/s")
    spec = made(encoder=Encoder(8), timing=Timing(1 << 20, 32, 10), unit="rad/s", frac_bits=2, max_speed=fast)
    assert spec.tick.max_count == 1
    assert spec.form.quotient_bits == 1 + 1 + spec.velocity.native_frac_bits + 1
    assert spec.latency.output_serial
    # A sum of three, too: 20 counts have five bits, and six follow.
    three = made(encoder=Encoder(13), timing=Timing(1 << 20, 20, 10), unit="rev/s", frac_bits=-6)
    assert (len(three.velocity.output.digits), three.velocity.native_frac_bits) == (3, 6)
    assert three.form.quotient_bits == 5 + 6 + 2
    assert three.latency.output_serial


def make_spec(average: int, frac_bits: int = 16, tick: int = 20, **options: Any) -> MTachometer:
    timing = Timing(1_000_000, tick, 10)
    return MTachometer(encoder=Encoder(8), timing=timing, average=average, frac_bits=frac_bits, **options)


@pytest.mark.parametrize("frac_bits", [4, 8])
@pytest.mark.parametrize("average", [1, 2, 3, 4, 5, 8, 16, 32, 64, 256])
def test_a_mean_is_a_shift_where_it_is_a_number_of_the_format(average: int, frac_bits: int) -> None:
    exact = 2**frac_bits % average == 0
    spec = make_spec(average, frac_bits)
    assert spec.form.shift == (frac_bits - average.bit_length() + 1 if exact else None)
    assert spec.latency.datapath == (1 if exact else (spec.form.numerator_width + 1) // 2 + 3)


@pytest.mark.parametrize(("eighths", "parts"), [(0, 1), (8, 1), (4, 2), (2, 4), (6, 4), (1, 8), (3, 8)])
@pytest.mark.parametrize("average", [3, 4, 8, 16])
def test_bounds_take_parts_of_a_count(average: int, eighths: int, parts: int) -> None:
    """A count more or less, and the edge error: in parts of a count that make a whole number of both."""
    spec = make_spec(average, 5, bounds=True, edge_error=Fraction(eighths, 8))
    margin = (1 + Fraction(eighths, 8)) * parts
    assert 1 << spec.bound.error_bits == parts
    assert spec.form.margin == margin
    assert spec.form.max_sum == 20 * average
    assert spec.form.max_numerator == 20 * average * parts + margin
    shifts = average != 3 and 2**5 % (average * parts) == 0
    assert (spec.form.shift is not None) == shifts
    # One clock for the sum, one for each two bits, two more for the scaler.
    bits = (20 * average * parts + int(margin)).bit_length() + 1
    assert spec.form.numerator_width == bits
    assert spec.latency.datapath == (1 if shifts else (bits + 1) // 2 + 3)


def test_without_bounds_there_is_no_margin() -> None:
    spec = make_spec(3)
    assert (spec.form.max_numerator, spec.form.numerator_width, spec.form.sum_width, spec.widths.interval) == (
        60,
        7,
        7,
        2,
    )
    assert (spec.times.standstill_ticks, spec.recovery.remembered) == (3, 4 * 20)


def test_one_adder_is_enough_if_a_tick_is_long() -> None:
    """The numerator of 3 ticks of 4 clocks has 5 bits, and an adder a clock more to do than it has digits."""
    assert [make_spec(3, tick=tick).latency.serial for tick in (3, 4, 5)] == [False, True, True]
    assert [make_spec(3, tick=tick).latency.datapath for tick in (3, 4)] == [5 + 3, 3 + 3]
    assert not make_spec(4).latency.serial
    # Ticks from outside may come in half the time; of 10 clocks the numerator has 6 bits.
    external = [
        make_spec(3, tick=tick, external_tick=True, max_tick_cycles=tick).latency.serial for tick in (4, 7, 8, 10)
    ]
    assert external == [False, False, True, True]
