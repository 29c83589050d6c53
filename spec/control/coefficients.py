"""The coefficients of a control loop, from its gains, its motor and the units of its core."""

import math
from collections.abc import Sequence
from fractions import Fraction

from tachometry.spec.control import form
from tachometry.spec.control.form import (
    ACCELERATION_WIDTH,
    GAINS,
    GUARD_BITS,
    MOST_GAIN_BITS,
    POSITION_FRAC_BITS,
    ControlForm,
    Term,
)
from tachometry.spec.control.law import Law
from tachometry.spec.control.units import Units
from tachometry.spec.language.units import PI


def ratios_of(units: Units) -> dict[Term, Sequence[Fraction]]:
    """Return what each term is multiplied by, in units of its result for one of its word."""
    law = units.law
    observed = form.ratios(law.observer, units.seconds, units.longest)
    per_current = law.torque_constant / (law.inertia * law.observer) * units.amperes / units.fine
    found: dict[Term, Sequence[Fraction]] = {
        Term.OBSERVER: observed,
        Term.CURRENT: [one * per_current / n for n, one in enumerate(observed, 1)],
        **{term: [_gain(law, term) * _of_one(units, term)] for term in GAINS},
    }
    if law.filter is not None:
        found[Term.FILTER] = form.ratios(law.filter, units.seconds, units.longest)
    return found


def _gain(law: Law, term: Term) -> Fraction:
    """Return k_p, k_v, or how much of the acceleration and of the disturbance becomes current: all."""
    return {Term.POSITION: law.position_gain, Term.VELOCITY: law.velocity_gain}.get(term, Fraction(1))


def _of_one(units: Units, term: Term) -> Fraction:
    """Return what a term is multiplied by if its gain is 1."""
    law, part = units.law, units.amperes / (1 << GUARD_BITS)  # A
    words = {
        Term.POSITION: 2 * PI / law.tachometer.encoder.counts_per_rev / (1 << POSITION_FRAC_BITS),
        Term.VELOCITY: units.fine,
        Term.ACCELERATION: Fraction(2) ** -units.acceleration_frac_bits,
        Term.DISTURBANCE: law.observer * units.fine,
    }
    return law.inertia / law.torque_constant / part * words[term]


def control_form(units: Units, ratios: dict[Term, Sequence[Fraction]], *, inputs: bool) -> ControlForm:
    """Return formats and coefficients, for gains that are inputs or fixed."""
    bits = form.factor_bits(list(ratios.values()))
    gain_bits = min(bits, MOST_GAIN_BITS) if inputs else 0
    terms = {term: form.coefficients(found, bits) for term, found in ratios.items()}
    if gain_bits:
        terms |= {term: form.gain(ratios[term][0], _usual(units, term), bits, gain_bits) for term in GAINS}
    law, core = units.law, units.law.tachometer
    return ControlForm(
        velocity_width=core.velocity.width,
        velocity_limit=core.velocity.full_scale,
        extra_bits=units.extra_bits,
        factor_bits=bits,
        terms=terms,
        current_limit=math.floor(law.current_limit / units.amperes),
        position_width=core.position_width,
        command_bits=units.command_bits,
        acceleration_width=ACCELERATION_WIDTH,
        synchronised=law.synchronised,
        gain_bits=gain_bits,
    )


def _usual(units: Units, term: Term) -> Fraction:
    """Return the ratio for which the range of a gain is made: its option's, or of k_p = (k_v/2)² where that is 0."""
    gain = _gain(units.law, term) or units.law.velocity_gain**2 / 4
    return gain * _of_one(units, term)


def gain_per_lsb(units: Units, made: ControlForm, term: Term) -> Fraction:
    """Return what one LSB of a gain that is an input is: of k_p in 1/s², of k_v in 1/s.

    Of the acceleration and of the disturbance it is a part of what the motor's data make of them.
    """
    return Fraction(1 << made.terms[term].shift, 1 << made.gain_bits) / _of_one(units, term)
