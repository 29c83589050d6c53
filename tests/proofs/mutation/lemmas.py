"""Lemmas make proofs about mutants short, and are proven with them.

In Verilog; `{name}` is a register of the core by name, which may be the end of a path, `[name]` that of the mutant.
"""

from tachometry.hdl.arithmetic.saturate import raised_for
from tachometry.spec import STachometer, TachometerSpec
from tachometry.spec.methods.timed import TimedTachometer


def lemmas(spec: TachometerSpec) -> list[str]:
    """Return those for a core."""
    if isinstance(spec, STachometer):
        return [*_tick(spec), *_window(spec)]
    if isinstance(spec, TimedTachometer):
        return _gap(spec)
    return []


def _within(name: str, limit: object, middle: int = 0) -> str:
    return f"$signed({{{name}}}) <= {middle} + {limit} && $signed({{{name}}}) >= {middle} - {limit}"


def _tick(spec: STachometer) -> list[str]:
    """Return a window has no more counts than clocks."""
    cycles = spec.timing.tick_cycles
    if cycles >= 16:
        return []  # the sampling clock is no counter
    left = "$signed({sampling_clock.left})"
    start = raised_for(cycles, spec.widths.max_count)
    name = f"pulse_counter.{'raised' if start else 'count'}"
    return [
        f"{left} >= -1 && {left} <= {cycles - 2}",
        f"{left} == {cycles - 2} || !{{complete}}",
        f"{left} == {cycles - 2} ? {_within(name, cycles, start)}"
        f" : {_within(name, f'($signed({cycles - 2}) - {left})', start)}",
    ]


def _window(spec: STachometer) -> list[str]:
    """Return inside a window all pulse numbers but the first and the last are equal."""
    longest = spec.timing.max_ticks
    counts = ("pulse_counter.pulse_count", "alteration.offset", "interval.opening")
    return [
        f"{{m_s}} >= 1 && {{m_s}} <= {longest} && {{longest}} == ({{m_s}} == {longest})",
        *(_within(name, spec.widths.max_count) for name in counts),
    ]


def _gap(spec: TimedTachometer) -> list[str]:
    """Return the last count's age, and its sign, which counts for nothing if it is too old."""
    longest = spec.form.max_periods
    return [
        f"{{gap_timer.age}} >= 1 && {{gap_timer.age}} <= {longest}",
        f"{{nearly}} == ({{gap_timer.age}} == {longest - 1})",
        "!{gap_timer.opened} || {count_way.negative} == [count_way.negative]",
    ]
