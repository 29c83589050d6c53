"""Words for a core: what commands, figures and plans show."""

from dataclasses import dataclass

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.velocity import Velocity
from tachometry.spec.language.units import SpeedUnit, plural


@dataclass(frozen=True)
class Words:
    """Texts about a core for commands, figures and plans."""

    description: str  # how it measures, in the words of its paper
    method: str  # the method, and why it was taken where none was named
    heading: str  # the name that figures give it
    notes: tuple[str, ...]  # sentences on what of the core is not as its options say
    on_ramps: str = ""  # how it follows a constant acceleration without delay; empty: it lags by half a measurement
    remark: str = ""  # a remark below the plan of the method; empty: none
    # The memory of the reciprocal: its kind, entries, bits of an entry. None: there is no such memory.
    memory: tuple[str, int, int] | None = None
    division: str = ""  # how the reciprocal is found where it is divided; empty: it is not


def speed_notes(asked: Asked, velocity: Velocity) -> tuple[str, ...]:
    """Return a note if the greatest speed is less than the one asked for."""
    fastest, most = asked.max_speed, velocity.max
    if fastest is None or fastest.counts(asked.encoder.counts_per_rev, asked.timing.tick_seconds) <= most:
        return ()
    unit = SpeedUnit(fastest.unit)
    greatest, many = unit.of(most * velocity.scale.unit_velocity), plural(most, "count")
    return (f"greatest speed cut from {fastest} to {greatest:.6g}{unit.name}: {many} per tick is the most",)
