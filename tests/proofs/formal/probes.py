"""Checkers look at these signals; the numbers are small enough for a SAT solver."""

from typing import Any

from tachometry.spec import Encoder, Speed, Timing

STANDSTILL_PROBES = {
    "core_rests": "silence.shown",
    "core_empty": "silence.ticks.left",
    "core_silent": "silence.was_silent",
}


def within(block: str, probes: dict[str, str], there: bool) -> dict[str, str]:
    """Return probes to wires of a generate block, if it is there."""
    return {f"{block}.{wire}": path for wire, path in probes.items() if there}


def counting(tick_cycles: int, max_ticks: int, max_count: int) -> dict[str, Any]:
    """Return parameters of a core with so many clocks and at most so many counts a tick."""
    return {
        "encoder": Encoder(1, 4),
        "timing": Timing(4 * tick_cycles, tick_cycles, max_ticks),
        "max_speed": Speed.parse(f"{max_count}rev/s"),
        "frac_bits": 4,
        "position_width": 8,
    }
