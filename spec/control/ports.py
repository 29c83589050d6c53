"""Ports of a control loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tachometry.spec.control.form import POSITION_FRAC_BITS
from tachometry.spec.port import Port, held, strobe
from tachometry.spec.units import signed_width

if TYPE_CHECKING:
    from tachometry.spec.control.loop import LoopSpec

CONTROL, CURRENT = "control_tick", "current_valid"


def loop_ports(spec: LoopSpec) -> tuple[Port, ...]:
    """Ports beside those of the tachometer."""
    form, tachometer = spec.form, spec.tachometer

    def command(name: str, width: int, unit: str, help: str) -> Port:
        return Port(
            f"command_{name}", "input", width, width > 1, unit=unit, help=f"{help} It is taken with control_tick."
        )

    fine = f"2^{-tachometer.frac_bits - form.extra_bits} {tachometer.unit}"
    return (
        Port("enable", "input", help="The current is 0 unless this is high in the clock of control_tick."),
        command(
            "position",
            tachometer.position_width + POSITION_FRAC_BITS,
            f"2^{-POSITION_FRAC_BITS} counts",
            "Commanded position; it wraps as position does.",
        ),
        command(
            "velocity",
            form.command_width,
            f"2^{-tachometer.frac_bits - form.command_bits} {tachometer.unit}",
            "Commanded velocity.",
        ),
        command(
            "acceleration",
            form.acceleration_width,
            f"2^{-spec.acceleration_frac_bits} rad/s²",
            "Commanded acceleration, or 0.",
        ),
        strobe(CONTROL, "One clock for every control period: position and commands are taken."),
        strobe(CURRENT, "One clock for every new current."),
        held(
            *(CURRENT, "current", spec.current_width),
            signed=True,
            unit=f"2^{-spec.current_frac_bits} A",
            help="Commanded current, within the limit.",
        ),
        held(CURRENT, "current_saturated", help="This current was held within the limit."),
        held(
            *(CURRENT, "filtered_velocity", signed_width(form.most_y)),
            signed=True,
            unit=fine,
            help="y, the velocity that is controlled: behind the filter, if there is one.",
        ),
        held(
            *(CURRENT, "disturbance", signed_width(form.most_w)),
            signed=True,
            unit=fine,
            help="Estimated disturbance as z - y; multiplied by torque_per_lsb of the manifest it is in Nm.",
        ),
        Port(
            *("drive", "output"),
            help="The current as a bit stream of a first-order sigma-delta modulator: 1 in (current + 2^(w-1)) of 2^w "
            "clocks, w bits of current.",
        ),
    )


def loop_entries(spec: LoopSpec) -> dict[str, Any]:
    """What the manifest says of the loop."""
    form = spec.form
    return {
        "period_cycles": int(spec.period),
        "first_tick": spec.first_tick,
        "tick_to_current": spec.latency,
        "longest_interval": form.longest,
        "current": {
            "width": spec.current_width,
            "amperes_per_lsb": float(spec.amperes),
            "limit": form.current_limit,
        },
        "command_position": {"counts_per_lsb": 2.0**-POSITION_FRAC_BITS},
        "command_velocity": {"rad_per_s_per_lsb": float(spec.rad_per_s / (1 << form.command_bits))},
        "command_acceleration": {"rad_per_s2_per_lsb": 2.0**-spec.acceleration_frac_bits},
        "filtered_velocity": {"rad_per_s_per_lsb": float(spec.rad_per_s / (1 << form.extra_bits))},
        "disturbance": {
            "torque_per_lsb": float(spec.inertia * spec.observer * spec.rad_per_s / (1 << form.extra_bits))
        },
    }
