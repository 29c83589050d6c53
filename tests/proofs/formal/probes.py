"""What checkers look at in more than one kind of core."""

STANDSTILL_PROBES = {
    "core_rests": "standstill.shown",
    "core_empty": "standstill.left",
    "core_silent": "standstill.was_silent",
}


def within(block: str, probes: dict[str, str], there: bool) -> dict[str, str]:
    """Probes to wires of a generate block, if it is there."""
    return {f"{block}.{wire}": path for wire, path in probes.items() if there}
