"""The coefficients of a control loop, from its gains, its motor and the units of its core."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

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
from tachometry.spec.language.units import PI

if TYPE_CHECKING:
    from tachometry.spec.control.loop import LoopSpec


def extra_bits_of(spec: LoopSpec) -> int:
    """Return f."""
    least = [rate * spec.seconds for rate in (spec.observer, spec.filter) if rate is not None]
    return form.extra_bits(*(1 - form.decay(one) for one in least))


def ratios_of(spec: LoopSpec) -> dict[Term, list[Fraction]]:
    """Return what each term is multiplied by, in units of its result for one of its word."""
    unit = spec.rad_per_s / (1 << extra_bits_of(spec))  # rad/s
    observed = form.ratios(spec.observer, spec.seconds, spec.longest)
    per_current = spec.torque_constant / (spec.inertia * spec.observer) * spec.amperes / unit
    found = {
        Term.OBSERVER: observed,
        Term.CURRENT: [one * per_current / n for n, one in enumerate(observed, 1)],
        **{term: [_gain(spec, term) * _of_one(spec, term)] for term in GAINS},
    }
    if spec.filter is not None:
        found[Term.FILTER] = form.ratios(spec.filter, spec.seconds, spec.longest)
    return found


def _gain(spec: LoopSpec, term: Term) -> Fraction:
    """Return k_p, k_v, or how much of the acceleration and of the disturbance becomes current: all."""
    return {Term.POSITION: spec.position_gain, Term.VELOCITY: spec.velocity_gain}.get(term, Fraction(1))


def _of_one(spec: LoopSpec, term: Term) -> Fraction:
    """Return what a term is multiplied by if its gain is 1."""
    unit = spec.rad_per_s / (1 << extra_bits_of(spec))
    part = spec.amperes / (1 << GUARD_BITS)  # A
    words = {
        Term.POSITION: 2 * PI / spec.tachometer.encoder.counts_per_rev / (1 << POSITION_FRAC_BITS),
        Term.VELOCITY: unit,
        Term.ACCELERATION: Fraction(2) ** -spec.acceleration_frac_bits,
        Term.DISTURBANCE: spec.observer * unit,
    }
    return spec.inertia / spec.torque_constant / part * words[term]


def control_form(spec: LoopSpec) -> ControlForm:
    """Return formats and coefficients."""
    ratios = spec.ratios
    bits = form.factor_bits(list(ratios.values()))
    gain_bits = min(bits, MOST_GAIN_BITS) if spec.gains == "inputs" else 0
    terms = {term: form.coefficients(found, bits) for term, found in ratios.items()}
    if gain_bits:
        terms |= {term: form.gain(ratios[term][0], _usual(spec, term), bits, gain_bits) for term in GAINS}
    core = spec.tachometer
    return ControlForm(
        velocity_width=core.velocity_width,
        velocity_limit=core.full_scale,
        extra_bits=extra_bits_of(spec),
        factor_bits=bits,
        terms=terms,
        current_limit=math.floor(spec.current_limit / spec.amperes),
        position_width=core.position_width,
        command_bits=spec.command_bits,
        acceleration_width=ACCELERATION_WIDTH,
        synchronised=spec.synchronised,
        gain_bits=gain_bits,
    )


def _usual(spec: LoopSpec, term: Term) -> Fraction:
    """Return the ratio for which the range of a gain is made: that of its option, or of k_p = (k_v/2)² for k_p = 0."""
    return (_gain(spec, term) or spec.velocity_gain**2 / 4) * _of_one(spec, term)


def gain_per_lsb(spec: LoopSpec, term: Term) -> Fraction:
    """Return what one LSB of a gain that is an input is: of k_p in 1/s², of k_v in 1/s.

    Of the acceleration and of the disturbance it is a part of what the motor's data make of them.
    """
    one = spec.form.terms[term]
    return Fraction(1 << one.shift, 1 << spec.form.gain_bits) / _of_one(spec, term)
