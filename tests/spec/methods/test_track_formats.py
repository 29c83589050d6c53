"""Formats of the tracking recursion, computed another way, for cores of all sizes."""

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from tachometry.spec import ParameterError, TrackTachometer, of_texts
from tachometry.spec.formats.tracking import RATIOS, STEP_BACK, Tracking
from tachometry.spec.formats.tracking_program import Program


def drawn(seed: int) -> Tracking:
    """Return ticks from 2^8 clocks on, up to a thousand counts in each, bandwidths over five decades."""
    rng = np.random.default_rng(seed)
    external = bool(rng.random() < 0.5)
    tick = int(2 ** rng.uniform(8.2, 17))
    return Tracking(
        clock_hz=int(10 ** rng.uniform(5, 8.2)),
        tick_cycles=tick,
        longest_tick=int(tick * 2 ** rng.uniform(0, 4)) if external else tick,
        max_ticks=int(2 ** rng.uniform(1, 12)),
        max_count=int(2 ** rng.uniform(0, 10)),
        external=external,
        bandwidth=Fraction(10 ** rng.uniform(0, 5)).limit_denominator(1000),
        least_memory=Fraction(rng.uniform(0.5, 0.95)).limit_denominator(100),
        edge_error=Fraction(int(rng.integers(1, 9)), 8),
        agile=bool(rng.random() < 0.5),
        growing=bool(rng.random() < 0.5),
        velocity_bits=int(rng.integers(4, 20)),
        fine_bits=int(rng.integers(1, 16)),
    )


def few(seed: int) -> Tracking:
    """Return few counts in short ticks with great bandwidths, so that small terms are the greatest."""
    rng, form = np.random.default_rng(seed), drawn(seed)
    tick = int(rng.integers(257, 400))
    return replace(
        form,
        clock_hz=1 << 20,
        tick_cycles=tick,
        longest_tick=int(tick * 2 ** rng.uniform(0, 4)) if form.external else tick,
        max_ticks=int(2 ** rng.uniform(1, 3)),
        max_count=int(2 ** rng.uniform(0, 2)),
        bandwidth=Fraction((1 << 20) / tick * 10 ** rng.uniform(-1.5, 0)).limit_denominator(1000),
        velocity_bits=int(rng.integers(4, 8)),
        fine_bits=int(rng.integers(14, 17)),
    )


Made = Callable[[int], Tracking]


def for_each(n: int, *kinds: Made) -> Callable[[Callable[[Tracking], None]], Callable[[Made], None]]:
    """Return a test of n cores of each kind, which tells the one that fails."""

    def decorated(check: Callable[[Tracking], None]) -> Callable[[Made], None]:
        @pytest.mark.parametrize("made", kinds)
        def test(made: Made) -> None:
            for seed in range(n):
                try:
                    check(made(seed))
                except AssertionError as error:
                    error.add_note(f"{made.__name__}({seed})")
                    raise

        return test

    return decorated


@for_each(1000, drawn, few)
def test_a_word_holds_what_the_program_computes(form: Tracking) -> None:
    """All in counts and the unit of time U."""
    unit, counts, error = 2.0**form.unit_bits, form.max_count, 2 * form.max_count + 2
    assert form.max_error == error
    speed, change = (most / 2.0**form.frac_bits for most in (form.max_velocity, form.max_acceleration))
    assert speed == pytest.approx(counts * unit / form.tick_cycles, rel=1e-3)
    wide, gain = float(form.bandwidth) / form.clock_hz, 1 - float(form.least_memory)
    # U over the gap in which λ·gap is the most that counts, −ln θ.
    per_gap = (4 if form.agile else 1) * wide * unit / -math.log(1 - gain)
    moved = 2 * max(counts, speed * form.longest_tick / unit)
    greatest = max(
        counts * (counts + moved),
        1.25 * speed + 3 * error * gain**2 * per_gap,
        2 * error * gain * 2**form.ratio_range,
        2 * error * gain**2 * per_gap * 2 ** (form.extra_bits + form.ratio_range),
        2 * change,
        2 * speed * max(1.125, 2 ** (form.times_bits - 1) / unit),
        4 * error,
        change + error * gain**3 * per_gap**2 * 2**form.extra_bits,
        2 * error + 2 * moved + 2,
        4 * wide * 2**form.gap_bits,
    )
    dividend = max(form.number_bits + form.mean_bits, form.gap_bits + form.gain_bits - 8)
    assert form.width == 1 + max(math.ceil(math.log2(greatest)) + form.frac_bits, dividend)


def test_levels() -> None:
    """Sixteen over a decade; λ that goes back by four of them is nearly doubled."""
    assert [RATIOS[0], RATIOS[15]] == pytest.approx([1, 0.1])
    assert RATIOS[6 - STEP_BACK] / RATIOS[6] == pytest.approx(10 ** (4 / 15)) == pytest.approx(1.848, abs=1e-3)


@for_each(100, drawn, few)
def test_constants(form: Tracking) -> None:
    one, wide, error = 2**form.frac_bits, float(form.bandwidth) / form.clock_hz, float(form.edge_error)
    assert form.max_gap == form.longest_tick * form.max_ticks + form.longest_tick
    assert form.max_acceleration == form.max_velocity * 2**form.extra_bits // 8
    assert form.fixed(Fraction(3, 2)) == 1.5 * one
    assert form.late_limit == pytest.approx((0.5 + 1.5 * error) * one, abs=0.51)
    # The square of a quarter of E, with 17 bits.
    assert form.mean_threshold.bit_length() == 17
    assert form.mean_threshold / 2**form.mean_threshold_bits == pytest.approx((error / 4) ** 2, rel=2**-17)
    per_gap = one * 2 ** (form.gap_bits - 1)
    levels = [wide / 10 ** (level / 15) for level in range(16)]
    assert form.rates == pytest.approx([rate * per_gap for rate in levels], rel=1e-12, abs=0.51)
    assert form.agile_rate == pytest.approx(4 * wide * per_gap, rel=1e-12, abs=0.51)
    # 1/λ grows by a tenth of the time. A level ends where λ is in the middle to the next, as ratios are.
    ends = [10 * (1 / math.sqrt(rate * lower) - 1 / wide) for rate, lower in pairwise(levels)]
    spans = [end - begin for begin, end in pairwise([0.0, *ends])]
    longest = 2 ** (form.width - 1) - 1 - form.max_gap  # so that a gap can be added
    assert form.spans == pytest.approx([*(min(span, longest) for span in spans), longest], rel=1e-9, abs=0.51)
    # The first speed: all counts of a tick, and two, in the shortest time between two; with a sign.
    fastest = (form.max_count + 2) * 2**form.unit_bits / max(form.tick_cycles // form.max_count, 1) * one
    bits = next(bits for bits in range(200) if fastest <= 2**bits) + 1
    assert form.start_bits == min(max(bits - form.width, 0), form.unit_bits)
    assert Program(form, Fraction(1, 100), 10).constants["coarse_v"] == form.max_velocity // 2**form.start_bits


def test_constants_of_the_program() -> None:
    form = spec_of(max_speed="1000rad/s").form
    program, one = Program(form, Fraction(1, 100), 10), 2.0**form.frac_bits
    expected = {
        "length": 960,
        "length_shifted": 960 * 2 ** (form.gain_bits - 8),
        "several": 2 * 2**form.mean_bits,
        "one": one,
        "three": 3 * one,
        "three_quarters": 0.75 * one,
        "lsb": 1,
        "lost": form.max_error * one,
        "most_v": form.max_velocity,
        "most_a": form.max_acceleration,
        "coarse_v": form.max_velocity // 2**form.start_bits,
        "least_gap": form.least_gap,
        "error": 0.4 * one,
        "errors": 0.8 * one,
        "some_error": 0.1 * one,
        "late": 1.1 * one,
        "mean_limit": form.mean_threshold,
        "rate0": form.rates[0],
        "agile_rate": form.agile_rate,
        "most_x0": -math.log(0.7) * one,
        "lead": 10 + program.clocks,
    }
    factor, shift = program.acceleration_scale
    assert shift == form.width - 2
    assert factor / 2**shift == pytest.approx(0.01, rel=2 ** -(shift - 8))
    assert program.constants == pytest.approx({**expected, "acceleration": factor}, abs=0.51)


@for_each(200, drawn)
def test_the_unit_of_time(form: Tracking) -> None:
    """As long as possible up to 1/(4·λ_0), but half the longest tick at least."""
    unit, most = 2**form.unit_bits, form.clock_hz / (4 * form.bandwidth)
    half = form.longest_tick / 2
    assert unit > half
    assert unit <= most < 2 * unit or (unit > most and unit <= 2 * half)


def gains(form: Tracking) -> list[tuple[int, float]]:
    """Return ticks from count to count, and d = 1 − θ, with the least bandwidth: in each, the fewest of the most x,
    none.
    """
    slowest = 10 if form.growing else 1
    per_tick = float(form.bandwidth) * form.tick_cycles / form.clock_hz / slowest
    forgets = (1 - float(form.least_memory)) * (0.2 if form.growing else 1)
    reached = round(-math.log(1 - forgets) / per_tick)
    return [
        (m, min(1 - math.exp(-per_tick * m), forgets))
        for m in (1, min(max(reached, 1), form.max_ticks), form.max_ticks)
    ]


@for_each(200, drawn)
def test_errors_are_held_with_the_fewest_bits(form: Tracking) -> None:
    """As in the error analysis: half an LSB of the velocity, and of the position."""
    found, u = gains(form), 2**form.unit_bits / form.tick_cycles
    more = next(bits for bits in range(10) if bits == 9 or all(m / (d * u) <= 2**bits for m, d in found))
    assert form.extra_bits == more

    def enough(bits: int) -> bool:
        each = [(m, d, m / (2 * d**2 * u) * (1 + m / (d * u * 2**more))) for m, d in found]
        velocity = max(3 * d / m * e + 1.5 / (d * u) + 1 for m, d, e in each) / 2**bits
        position = max(e + 1 for _, _, e in each) / 2**bits
        return velocity <= 0.5 / 2**form.velocity_bits and position <= 0.5 / 2**form.fine_bits

    assert form.frac_bits == next(bits for bits in range(100) if enough(bits))
    assert form.acceleration_error == pytest.approx(max(4.5 * u / m * 2**more + 1.5 / d for m, d in found))
    # A gain is off by 2^−B, of d or of d·U/m: for one count per tick by an eighth of an LSB of the velocity.
    least = min(found[0][1], found[0][1] * u)
    fewest = next(bits for bits in range(20, 100) if 2.0**-bits <= least / 8 / 2**form.velocity_bits)
    assert form.gain_bits - form.ratio_range == fewest
    # Each count of a tick is up to as many places from its end, less a half.
    counts = form.max_count
    assert form.places_bits == sum(2 * counts - 1 for _ in range(counts)).bit_length() + 1


def spec_of(**texts: str) -> TrackTachometer:
    spec = of_texts("track", {"ppr": "500"} | {name.replace("_", "-"): text for name, text in texts.items()})
    assert isinstance(spec, TrackTachometer)
    return spec


def test_ends_of_ranges() -> None:
    assert spec_of().fine_bits == 6
    assert [spec_of(fine_bits=bits).fine_bits for bits in ("1", "16")] == [1, 16]
    assert [spec_of(edge_error=error).edge_error for error in ("0.05", "2")] == [Fraction(1, 20), 2]
    beyond: tuple[dict[str, str], ...] = ({"fine_bits": "0"}, {"fine_bits": "17"}, {"edge_error": "2.01"})
    for wrong in (*beyond, {"edge_error": "0.049"}):
        with pytest.raises(ParameterError):
            spec_of(**wrong)


def test_widths_and_delays() -> None:
    assert [spec_of(velocity_width=width).acceleration.width for width in ("30", "39", "40", "60")] == [38, 47, 48, 48]
    for unit in ("count/tick", "rpm"):
        spec = spec_of(unit=unit, lowpass="100Hz")
        assert spec.latency.low_pass > 0
        assert (spec.latency.output > 0) == (unit == "rpm")
        program, around = spec.latency.low_pass + spec.latency.output, spec.latency.pin_to_count + spec.latency.tick
        assert spec.program.delay == around + 3 + program
    wide = {"tick": "40us", "max_time": "20s", "frac_bits": "24"}
    assert spec_of(bandwidth="20rad/s", **wide).form.width == 64
    with pytest.raises(ParameterError, match="its words would have 65 bits, and 64 are the most"):
        spec_of(bandwidth="10rad/s", **wide)


def test_the_shortest_tick_is_that_of_the_program() -> None:

    def with_tick(cycles: int) -> TrackTachometer:
        return spec_of(tick=str(cycles), max_time=str(500 * cycles))

    shortest = with_tick(900).times.min_tick_cycles
    assert with_tick(shortest).times.min_tick_cycles == shortest
    with pytest.raises(ParameterError, match=f"^tick_cycles must be at least {shortest} "):
        with_tick(shortest - 1)


@pytest.mark.parametrize("unit", ["count/tick", "rev/s", "rpm"])
@pytest.mark.parametrize(
    "options", [{}, {"velocity_width": "12"}, {"bandwidth": "200rad/s"}, {"max_speed": "3000rad/s"}]
)
def test_the_acceleration_has_the_most_fraction_bits(unit: str, options: dict[str, str]) -> None:
    """Its error is a quarter of an LSB at most; the greatest one fits, and so does what is rounded up."""
    spec = spec_of(unit=unit, **options)
    form = spec.form
    count = Fraction({"count/tick": 1, "rev/s": 50_000**2, "rpm": 60 * 50_000**2}[unit])  # per tick²
    count /= {"count/tick": 1}.get(unit, 2000)
    lsb = count * Fraction(960, 2**form.unit_bits) ** 2 / 2 ** (form.frac_bits + form.extra_bits)

    def fits(bits: int) -> bool:
        one = lsb * Fraction(2) ** bits  # in LSB of the output
        room = 2 ** (spec.acceleration.width - 1) - 2
        return form.max_acceleration * one <= room and form.acceleration_error * one <= 1 / 8

    assert spec.acceleration.frac_bits == max(bits for bits in range(-60, 60) if fits(bits))
    assert spec.program.acceleration_factor == lsb * Fraction(2) ** spec.acceleration.frac_bits


def test_the_velocity_is_shown_up_to_two_units_of_time_ahead() -> None:
    form = spec_of().form
    assert Program(form, Fraction(1, 100), 10**6).lead == 2 * 2**form.unit_bits - 1


def test_words_lie_side_by_side() -> None:
    """Those that change, the constants, and from 64 on 16 words for each table."""
    program = spec_of().program
    states = "p v a h gap gap_shifted mean before age e d r e1 e2 t x".split()
    assert [program.address(word) for word in states] == [*range(16)]
    assert [program.address(word) for word in program.constants] == [*range(16, 16 + len(program.constants))]
    assert [program.address(word) for word in program.tables] == [64, 80, 96]
    assert len(program.memory) == 64 + 3 * 16
    for word, value in program.constants.items():
        assert program.memory[program.address(word)] == value
    assert not any(program.memory[:16] + program.memory[16 + len(program.constants) : 64])
