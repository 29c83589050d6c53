"""`generate` prints these lines of a core with a control loop."""

from tachometry.cli.reports.core import configuration, measured, registers_row
from tachometry.sim.studies.plan import Plans
from tachometry.spec.control import LoopSpec
from tachometry.spec.language.units import plural, short_time
from tachometry.spec.registers.buses import Bus


def loop_rows(spec: LoopSpec, bus: Bus | None = None) -> list[tuple[str, str]]:
    """Return the configuration of tachometer and loop, and the registers on a bus."""
    form, period, late = spec.form, spec.units.seconds, spec.latency.tick_to_result
    filtered = "none" if spec.filter is None else f"{float(spec.filter):.6g} rad/s"
    when = "at updates of the velocity" if spec.synchronised else "at every control tick"
    widths = ", ".join(
        f"{port.name} {port.width}" for port in spec.ports[len(spec.tachometer.ports) :] if port.width > 1
    )
    rows = [
        ("gains", f"kp {float(spec.position_gain):.6g} 1/s², kv {float(spec.velocity_gain):.6g} 1/s"),
        ("observer", f"{float(spec.observer):.6g} rad/s, velocity filter {filtered}, {when}"),
        ("motor", f"{float(spec.inertia):.6g} kg m², {float(spec.torque_constant):.6g} Nm/A"),
        (
            "current",
            f"at most {float(form.current_limit * spec.units.amperes):.6g} A, in 2^{-spec.units.current_frac_bits} A",
        ),
        ("control period", f"{short_time(period)} ({plural(spec.period, 'clock')})"),
        ("command to current", f"{plural(late, 'clock')} ({short_time(spec.tachometer.tick.seconds(late))})"),
        (
            "multiplier",
            f"{spec.multiplier}: words of {form.word_width} bits by coefficients of {form.factor_bits}, "
            f"{plural(spec.latency.product, 'clock')} a product",
        ),
        ("widths of the loop", widths),
    ]
    registers = [] if bus is None else [registers_row(spec, bus)]
    alone = spec.tachometer
    return [*configuration(alone), *measured(alone, Plans.of(alone)), *rows, *registers]
