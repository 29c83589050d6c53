"""Formats of the control loop: exact enough, and wide enough for whatever comes."""

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from itertools import product as combinations
from typing import Any

import numpy as np
import pytest

from tachometry.spec import Encoder, ParameterError, Speed, STachometer, Timing, TrackTachometer
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.coefficients import gain_per_lsb
from tachometry.spec.control.form import (
    GAINS,
    GUARD_BITS,
    POSITION_FRAC_BITS,
    Coefficients,
    ControlForm,
    Term,
    coefficients,
)
from tachometry.spec.language.option import options_of

CORE = STachometer(
    encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), max_speed=Speed.parse("1000rad/s")
)


def random_spec(seed: int, gains: str = "fixed") -> LoopSpec:
    """Return gains, motors, clocks and units of all sizes."""
    rng = np.random.default_rng(seed)

    def about(middle: float, decades: float) -> Fraction:
        return Fraction(float(f"{middle * 10 ** rng.uniform(-decades, decades):.3g}"))

    core: dict[str, Any] = {
        "encoder": Encoder(int(rng.choice([1, 100, 500, 20_000]))),
        "timing": Timing(48_000_000, int(rng.choice([400, 960, 48_000])), int(rng.choice([2, 50, 500]))),
    }
    if rng.random() < 0.5:
        core |= {"unit": "rad/s", "frac_bits": int(rng.choice([2, 8]))}
    if rng.random() < 0.5:
        core |= {"max_speed": Speed(Fraction(500))}
    velocity = about(100, 1)
    observer = about(200, 1)
    return LoopSpec(
        tachometer=STachometer(**core),
        inertia=about(0.001, 2),
        torque_constant=about(0.05, 1),
        position_gain=velocity**2 / 4 if rng.random() < 0.8 else Fraction(0),
        velocity_gain=velocity,
        observer=observer,
        velocity_filter=(observer, about(200, 1), Fraction(0))[int(rng.integers(3))],
        current_limit=about(10, 1),
        synchronised=bool(rng.random() < 0.7),
        current_width=int(rng.choice([8, 16, 24])),
        gains=gains,
    )


SEEDS = range(12)


def with_gains(form: ControlForm, raw: Mapping[Term, int]) -> ControlForm:
    """Return a form whose gains are inputs, with these gains; its formats are those of the options all the same."""
    terms = {term: replace(form.terms[term], values=(one << form.gain_shift,)) for term, one in raw.items()}
    made = replace(form, terms=form.terms | terms)
    for name in ("most_error", "most_total", "word_width"):
        made.__dict__[name] = getattr(form, name)
    return made


def fits(value: int, width: int) -> bool:
    return -(1 << (width - 1)) <= value < 1 << (width - 1)


def check_observer(form: ControlForm) -> None:
    """From the extremes of y, z, u and ΣI no n leads beyond them.

    Each of the sums rises with each of these, as coefficients are less than 1, so the extremes are enough.
    """
    most_y, most_z = form.most_y, form.most_y + form.most_lead
    for n in {1, 2, form.longest // 2 + 1, form.longest} & {*range(1, form.longest + 1)}:
        for sign_y, sign_z, sign_u, sign_i in combinations((-1, 1), repeat=4):
            y, z, u = sign_y * most_y, sign_z * most_z, sign_u * form.most_y
            new_y = u
            if Term.FILTER in form.terms:
                assert fits((u - y) << form.terms[Term.FILTER].shift, form.word_width)
                new_y = y + form.product(Term.FILTER, u - y, n)
            assert abs(new_y) <= most_y
            w = z - new_y
            assert abs(w) <= form.most_w
            w -= form.product(Term.OBSERVER, w, n)
            total = sign_i * n * form.current_limit
            assert abs(total) <= form.most_sum
            assert fits(total << form.terms[Term.CURRENT].shift, form.word_width)
            w += form.product(Term.CURRENT, total, n)
            assert abs(w) <= form.most_w
            assert abs(new_y + w) <= most_z


def check_current(form: ControlForm, *, held: bool = True) -> None:
    """All sums fit, and a position error that is `held` gives a current at its limit, whatever the other terms are."""
    acceleration = 1 << (form.acceleration_width - 1)
    for signs in combinations((-1, 1), repeat=4):
        words = {
            Term.POSITION: signs[0] * form.most_error,
            Term.VELOCITY: signs[1] * (form.most_command + form.most_y),
            Term.ACCELERATION: signs[2] * acceleration,
            Term.DISTURBANCE: signs[3] * form.most_w,
        }
        total = 1 << (GUARD_BITS - 1)
        for term, word in words.items():
            assert fits(word << form.terms[term].shift, form.word_width)
            total += form.product(term, word)
            assert fits(total, form.total_width)
        everything = (1 << (form.position_width + POSITION_FRAC_BITS - 1)) - 1
        if held and form.terms[Term.POSITION].values[0] and form.most_error < everything:
            assert abs(total >> GUARD_BITS) >= form.current_limit
            assert (total > 0) == (signs[0] > 0)


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_overflows(seed: int) -> None:
    form = random_spec(seed).form
    check_observer(form)
    check_current(form)


@pytest.mark.parametrize("seed", range(12))
def test_nothing_overflows_with_gains_as_inputs(seed: int) -> None:
    """Whatever the gains are; and with a sixteenth of that of the position, holding its error changes no current."""
    form = random_spec(seed, "inputs").form
    rng = np.random.default_rng(seed + 100)
    some = {term: int(rng.choice([0, form.most_gain, int(rng.integers(form.most_gain))])) for term in GAINS}
    greatest = dict.fromkeys(GAINS, form.most_gain)
    for raw in (some, greatest):
        check_observer(with_gains(form, raw))
        check_current(with_gains(form, raw), held=False)
    check_current(with_gains(form, form.reset_gains | {Term.POSITION: -(-form.reset_gains[Term.POSITION] >> 4)}))


@pytest.mark.parametrize("seed", range(4))
def test_gains_of_the_options(seed: int) -> None:
    """A gain is that of the option to half an LSB, and can be 16 times it."""
    spec = random_spec(seed, "inputs")
    nominal = {Term.POSITION: spec.position_gain, Term.VELOCITY: spec.velocity_gain}
    for term, raw in spec.form.reset_gains.items():
        lsb, wanted = gain_per_lsb(spec.units, spec.form, term), nominal.get(term, Fraction(1))
        assert abs(raw * lsb - wanted) <= lsb / 2
        assert spec.form.most_gain * lsb > 15.9 * wanted
    assert spec.form.most_gain == 2**spec.form.gain_bits - 1
    # Where k_p is 0 the range is that for two equal poles.
    none = replace(spec, position_gain=Fraction(0))
    most = none.form.most_gain * gain_per_lsb(none.units, none.form, Term.POSITION)
    assert 15.9 < most / (spec.velocity_gain / 2) ** 2 < 33
    # An error is held within 16 times what the gain of the option needs, or a usual one, a 32nd of the greatest.
    for form in (spec.form, none.form):
        position, usual = form.terms[Term.POSITION], 2**form.factor_bits // 32
        gain = min(position.values[0] or usual, usual)
        fixed = replace(form, terms=form.terms | {Term.POSITION: replace(position, values=(gain,))}, gain_bits=0)
        greatest = 2 ** (form.position_width + POSITION_FRAC_BITS - 1)
        assert form.most_error == min(16 * (fixed.most_error + 1), greatest) - 1


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("most_lead", lambda form: form.most_lead // 2),
        ("word_width", lambda form: form.word_width - 1),
        ("total_width", lambda form: form.total_width - 12),
        ("most_error", lambda form: form.most_error // 4),
    ],
)
def test_formats_are_no_wider_than_needed(name: str, wrong: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    form = LoopSpec(tachometer=CORE).form
    less = wrong(form)
    monkeypatch.setattr(ControlForm, name, property(lambda self: less), raising=True)
    form = replace(form)
    with pytest.raises(AssertionError):  # noqa: PT012
        check_observer(form)
        check_current(form)


@pytest.mark.parametrize("seed", SEEDS)
def test_coefficients_are_those_of_the_equations(seed: int) -> None:
    spec = random_spec(seed)
    form = spec.form
    time, unit = float(spec.units.seconds), float(spec.units.rad_per_s) / 2**form.extra_bits
    part, inertia, constant = float(spec.units.amperes) / 16, float(spec.inertia), float(spec.torque_constant)
    rate = float(spec.observer)
    wanted = {
        Term.OBSERVER: lambda n: -math.expm1(-rate * time * n),
        Term.CURRENT: lambda n: -math.expm1(-rate * time * n) / n * constant / (inertia * rate) * part * 16 / unit,
        Term.VELOCITY: lambda n: inertia * float(spec.velocity_gain) / constant * unit / part,
        Term.DISTURBANCE: lambda n: inertia * rate / constant * unit / part,
    }
    if spec.filter is not None:
        wanted[Term.FILTER] = lambda n: -math.expm1(-float(spec.filter or 0) * time * n)
    for term, ratio in wanted.items():
        found = form.terms[term]
        for n in {1, len(found.values) // 2 + 1, len(found.values)}:
            value = found.values[n - 1] * 2.0 ** (found.shift - form.factor_bits)
            assert value == pytest.approx(ratio(n), rel=2**-12 * 1.01)
    least = min(-math.expm1(-float(one) * time) for one in (spec.observer, spec.filter or spec.observer))
    assert 4 <= least * 2**form.extra_bits < 8 or form.extra_bits == 2


@pytest.mark.parametrize("seed", SEEDS)
def test_products_are_rounded_and_the_least_coefficient_has_twelve_bits(seed: int) -> None:
    form = random_spec(seed).form
    assert 2**11 <= min(min(one.values) for one in form.terms.values() if one.values[0]) <= 2**12
    for term, one in form.terms.items():
        for word in (-1001, -3, -1, 0, 1, 2, 777, 123_456):
            exact = Fraction(word * 2**one.shift * one.values[-1], 2**form.factor_bits)
            assert form.product(term, word, len(one.values)) == math.floor(exact + Fraction(1, 2))


def test_a_tracking_core_has_no_filter() -> None:
    core = TrackTachometer(encoder=Encoder(500), max_speed=Speed.parse("1000rad/s"), velocity_width=16)
    assert LoopSpec(tachometer=core).filter is None
    assert LoopSpec(tachometer=CORE).filter == 40
    (told,) = (about for about in options_of(LoopSpec) if about.field == "velocity_filter")
    assert told.parse is not None
    assert [told.parse("x", text) for text in ("none", " NONE ", "40rad/s")] == [0, 0, 40]
    with pytest.raises(ParameterError, match=r"^x must be greater than 0, not 0$"):
        told.parse("x", "0rad/s")
    assert replace(LoopSpec(tachometer=CORE), observer=Fraction(80)).period == 960


def test_a_long_measurement_is_cut_into_parts() -> None:
    spec = LoopSpec(tachometer=replace(CORE, timing=Timing.parse("48MHz", "20us", "100ms")))
    assert spec.units.longest == 1023
    assert LoopSpec(tachometer=CORE).units.longest == 511
    # Two ticks, as the update may come late in one, and as control ticks need not come with them: all bits of 4.
    assert LoopSpec(tachometer=replace(CORE, timing=Timing(48_000_000, 960, 2)), control_period=960).units.longest == 7


def test_a_coefficient_just_below_a_power_of_two_has_all_bits() -> None:
    assert coefficients([Fraction(1, 2), 1 - Fraction(1, 10**6)], 12) == Coefficients((2048, 4095), 0)
    assert coefficients([Fraction(1), Fraction(3)], 12) == Coefficients((1024, 3072), 2)


def test_words_of_80_bits() -> None:
    """Each doubling of a great inertia takes one more."""
    core = replace(CORE, encoder=Encoder(1), frac_bits=24, position_width=48, max_speed=Speed.parse("1e6rad/s"))

    def loop(inertia: int) -> LoopSpec:
        return LoopSpec(
            tachometer=core,
            inertia=Fraction(inertia),
            torque_constant=Fraction(1, 10**9),
            position_gain=Fraction(10**12),
            velocity_gain=Fraction(10**6),
            velocity_filter=Fraction(0),
            current_limit=Fraction(10**9),
        )

    inertia = next(2**n for n in range(20) if loop(2**n).form.word_width == 80)
    with pytest.raises(ParameterError, match="words would have 81 bits, and 80 are the most"):
        loop(2 * inertia)


def test_gains_that_are_inputs_have_24_bits_at_most() -> None:
    bits = [
        (spec.form.factor_bits, spec.form.gain_bits)
        for spec in (LoopSpec(tachometer=CORE, gains="inputs", inertia=Fraction(1, 10**n)) for n in range(1, 9))
    ]
    assert {gain for _, gain in bits} >= {24}
    assert all(gain == min(factor, 24) for factor, gain in bits)


def test_coefficients_of_40_bits() -> None:
    """Each halving of a small gain takes one more."""
    found = (LoopSpec(tachometer=CORE, position_gain=Fraction(1, 2**n)) for n in range(100))
    gain = next(spec.position_gain for spec in found if spec.form.factor_bits == 40)
    with pytest.raises(ParameterError, match=r"^kp must fit the other gains: coefficients would have 41 bits"):
        LoopSpec(tachometer=CORE, position_gain=gain / 2)


def test_limits() -> None:
    assert LoopSpec(tachometer=CORE).current_width == 16
    assert LoopSpec(tachometer=CORE, velocity_filter=Fraction(1, 2)).filter == Fraction(1, 2)
    # 16 bits hold 2^15 − 1 LSB, and not one more.
    just = Fraction(2**15 - 1, 2**10)
    assert [
        LoopSpec(tachometer=CORE, current_limit=just + more).units.current_frac_bits for more in (0, Fraction(1, 2**10))
    ] == [10, 9]
    with pytest.raises(ParameterError, match=r"^velocity_filter must be at least 0, not -1$"):
        LoopSpec(tachometer=CORE, velocity_filter=Fraction(-1))
    with pytest.raises(ParameterError, match=r"^observer must be from 0\.01193 to 3\.015e\+08 rad/s here, not 1e\+09$"):
        LoopSpec(tachometer=CORE, observer=Fraction(10**9))
    with pytest.raises(ParameterError, match=r"^current_width must be from 8 to 24, not 25$"):
        LoopSpec(tachometer=CORE, current_width=25)
    with pytest.raises(ParameterError, match=r"^kp must be at least 0, not -0\.5$"):
        LoopSpec(tachometer=CORE, position_gain=Fraction(-1, 2))
    with pytest.raises(ParameterError, match=r"^kp must be of a size from 1e-12 to 1e12, not 1e-13$"):
        LoopSpec(tachometer=CORE, position_gain=Fraction(1, 10**13))
    for period in (0, (1 << 24) + 1):
        with pytest.raises(ParameterError, match=rf"^control_period must be from 1 to {1 << 24} clocks, not {period}$"):
            LoopSpec(tachometer=CORE, control_period=period)
