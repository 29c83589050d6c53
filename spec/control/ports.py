"""Ports of a control loop."""

from collections.abc import Iterator
from typing import Any

from tachometry.spec.control.coefficients import gain_per_lsb
from tachometry.spec.control.form import GAINS, POSITION_FRAC_BITS, Term
from tachometry.spec.control.generator import AMPLITUDE_WIDTH, MODE_WIDTH, RATE_FRAC_BITS, WORD
from tachometry.spec.control.loop import Loop
from tachometry.spec.language.port import Port, held, strobe
from tachometry.spec.language.units import signed_width

CONTROL, CURRENT = "control_tick", "current_valid"
GAIN_PORTS = {term: f"gain_{term.name.lower()}" for term in GAINS}
_TAKEN = {"fixed": "It is taken with control_tick.", "inputs": "It is taken in the clock before control_tick."}
_GAIN_HELP = {
    Term.POSITION: "Gain k_p of the position error.",
    Term.VELOCITY: "Gain k_v of the velocity error.",
    Term.ACCELERATION: "How much of the commanded acceleration becomes current.",
    Term.DISTURBANCE: "How much of the estimated disturbance becomes current.",
}
_COMMAND_HELP = {
    "position": "Commanded position; it wraps as position does.",
    "velocity": "Commanded velocity.",
    "acceleration": "Commanded acceleration, or 0.",
}
_GAIN_UNIT = {Term.POSITION: " 1/s²", Term.VELOCITY: " 1/s"}


def loop_ports(spec: Loop) -> Iterator[Port]:
    """Yield ports beside those of the tachometer."""
    form, taken = spec.form, _TAKEN[spec.gains]
    fine = f"2^{-spec.tachometer.velocity.frac_bits - form.extra_bits} {spec.tachometer.unit}"
    amperes = f"2^{-spec.units.current_frac_bits} A"
    yield Port("enable", "input", help="The current is 0 unless this is high in the clock of control_tick.")
    if spec.command == "generator":
        yield from _generated(spec)
    else:
        for name, (width, unit) in _units(spec).items():
            text = f"{_COMMAND_HELP[name]} {taken}"
            yield Port(f"command_{name}", "input", width, signed=True, unit=unit, help=text)
    if spec.gains == "inputs":
        for term in GAINS:
            unit = f"{float(gain_per_lsb(spec.units, form, term)):.9g}{_GAIN_UNIT.get(term, '')}"
            yield Port(GAIN_PORTS[term], "input", form.gain_bits, unit=unit, help=f"{_GAIN_HELP[term]} {taken}")
        text = f"Greatest current; a limit beyond that of the option is held at it. {taken}"
        yield Port("current_limit", "input", form.current_limit.bit_length(), unit=amperes, help=text)
        yield Port("freeze", "input", help="Commands, gains and limit stay as they were, but enable does not.")
    yield strobe(CONTROL, "One clock for every control period: position and commands are taken.")
    yield strobe(CURRENT, "One clock for every new current.")
    text = "Commanded current, within the limit."
    yield held(CURRENT, "current", spec.current_width, signed=True, unit=amperes, help=text)
    yield held(CURRENT, "current_saturated", help="This current was held within the limit.")
    text = "y, the velocity that is controlled: behind the filter, if there is one."
    yield held(CURRENT, "filtered_velocity", signed_width(form.most_y), signed=True, unit=fine, help=text)
    text = "Estimated disturbance as z - y; multiplied by torque_per_lsb of the manifest it is in Nm."
    yield held(CURRENT, "disturbance", signed_width(form.most_w), signed=True, unit=fine, help=text)
    text = (
        "The current as a bit stream of a first-order sigma-delta modulator: 1 in (current + 2^(w-1)) of 2^w clocks, "
    )
    yield Port("current_pdm", "output", help=text + "w bits of current.")


def _units(spec: Loop) -> dict[str, tuple[int, str]]:
    """Return bits and unit of the commanded position, velocity and acceleration."""
    form, tachometer = spec.form, spec.tachometer
    return {
        "position": (tachometer.position_width + POSITION_FRAC_BITS, f"2^{-POSITION_FRAC_BITS} counts"),
        "velocity": (form.command_width, f"2^{-tachometer.velocity.frac_bits - form.command_bits} {tachometer.unit}"),
        "acceleration": (form.acceleration_width, f"2^{-spec.units.acceleration_frac_bits} rad/s²"),
    }


def _generated(spec: Loop) -> Iterator[Port]:
    """Yield what the command generator is told, and what it commands."""
    form, taken = spec.generator, _TAKEN[spec.gains]
    text = f"0: a constant velocity; 1: a ramp to it; 2 or 3: a sine, which begins here at rest. {taken}"
    yield Port("generator_mode", "input", MODE_WIDTH, help=text)
    unit = f"2^{form.velocity_shift - form.fraction} counts per control tick"
    text = f"Velocity of constant and ramp. {taken}"
    yield Port("generator_velocity", "input", WORD, signed=True, unit=unit, help=text)
    unit = f"2^{-form.fraction} counts per control tick squared"
    text = f"Most by which the velocity of a ramp changes. {taken}"
    yield Port("generator_acceleration", "input", WORD, unit=unit, help=text)
    unit = f"2^{-POSITION_FRAC_BITS} counts"
    text = f"How far the middle of a sine is from where it begins. {taken} It counts when the sine begins."
    yield Port("generator_amplitude", "input", AMPLITUDE_WIDTH, signed=True, unit=unit, help=text)
    text = f"4·sin²(π·f·T) of a sine of frequency f, control ticks of T. {taken}"
    yield Port("generator_rate", "input", WORD, unit=f"2^{-RATE_FRAC_BITS}", help=text)
    texts = {
        "position": "Commanded position; where enable is low, the position.",
        "velocity": "How far the commanded position has gone since the control tick before.",
        "acceleration": "How much the commanded velocity has changed since the control tick before.",
    }
    for name, (width, unit) in _units(spec).items():
        yield held(CONTROL, f"command_{name}", width, signed=True, unit=unit, help=texts[name])


def loop_entries(spec: Loop) -> dict[str, Any]:
    """Return what the manifest says of the loop."""
    form = spec.form
    generator: dict[str, Any] = {}
    if spec.command == "generator":
        made = spec.generator
        generator["generator"] = {
            "velocity": {"counts_per_tick_per_lsb": 2.0 ** (made.velocity_shift - made.fraction)},
            "acceleration": {"counts_per_tick2_per_lsb": 2.0**-made.fraction},
            "amplitude": {"counts_per_lsb": 2.0**-POSITION_FRAC_BITS},
            "rate": {"per_lsb": 2.0**-RATE_FRAC_BITS},
        }
    return {
        "period_cycles": spec.period,
        "first_tick": spec.latency.first_tick,
        "tick_to_current": spec.latency.tick_to_result,
        "longest_interval": form.longest,
        "current": {
            "width": spec.current_width,
            "amperes_per_lsb": float(spec.units.amperes),
            "limit": form.current_limit,
        },
        "command_position": {"counts_per_lsb": 2.0**-POSITION_FRAC_BITS},
        "command_velocity": {"rad_per_s_per_lsb": float(spec.units.rad_per_s / (1 << form.command_bits))},
        "command_acceleration": {"rad_per_s2_per_lsb": 2.0**-spec.units.acceleration_frac_bits},
        "filtered_velocity": {"rad_per_s_per_lsb": float(spec.units.fine)},
        "disturbance": {"torque_per_lsb": float(spec.inertia * spec.observer * spec.units.fine)},
        **generator,
        **_gain_entries(spec),
    }


def _gain_entries(spec: Loop) -> dict[str, Any]:
    """Return what raw values of the gains mean: raw = round(gain/per_lsb), from 0 to most."""
    form = spec.form
    if not form.gain_bits:
        return {}
    found: dict[str, Any] = {
        GAIN_PORTS[term]: {
            "per_lsb": float(gain_per_lsb(spec.units, form, term)),
            "unit": _GAIN_UNIT.get(term, " 1").strip(),
            "most": form.most_gain,
            "option": form.reset_gains[term],
        }
        for term in GAINS
    }
    limit = form.current_limit
    amperes = {"per_lsb": float(spec.units.amperes), "unit": "A", "most": limit, "option": limit}
    return {"gains": found | {"current_limit": amperes}}
