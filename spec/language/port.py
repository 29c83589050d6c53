"""Ports of the exported core: what each one is, and with which strobe it is new.

Everything that shows or compares a core reads this list: engines, comparison, waveform, CSV, testbench, manifest,
documents. A port that is added here, and driven by hardware and golden model, appears in all of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

TICK, UPDATE, INDEX = "tick", "velocity_valid", "index_valid"
WHOLE = "update_valid"  # of a core that shows the velocity before the rest
WIDE, MISSED = "index_wide", "index_missed"
FINE = "position_fine"
STREAM = "m_axis"  # names of ports of a stream begin with it


@dataclass(frozen=True)
class Port:
    """Describes a scalar port of the exported core.

    - `held_by`: Of an output, the strobe in whose clocks it is read; a strobe is read with itself.
    - `unit`: What one LSB is.
    """

    name: str
    direction: str
    width: int = 1
    signed: bool = False
    held_by: str = ""
    unit: str = ""
    help: str = ""

    @property
    def is_strobe(self) -> bool:
        """Whether it is high for one clock when something is new."""
        return self.held_by == self.name


def pin(name: str, help: str, width: int = 1) -> Port:
    """Return an input, of one bit as a rule."""
    return Port(name, "input", width, help=help)


def strobe(name: str, help: str) -> Port:
    """Return an output that is high for one clock when something is new."""
    return Port(name, "output", held_by=name, help=help)


def held(by: str, name: str, width: int = 1, *, signed: bool = False, unit: str = "", help: str) -> Port:
    """Return an output that is read in the clocks of the strobe `by`."""
    return Port(name, "output", width, signed, by, unit, help)


def arranged(ports: Iterable[Port]) -> list[Port]:
    """Return ports in the order of all files: inputs as they come, then outputs, those of one strobe together."""
    every = [*ports]
    groups = [*dict.fromkeys(port.held_by or port.name for port in every)]
    outputs = [port for port in every if port.direction == "output"]
    outputs.sort(key=lambda port: (groups.index(port.held_by or port.name), not port.is_strobe))
    return [port for port in every if port.direction == "input"] + outputs


class Ports(tuple[Port, ...]):
    """Holds all ports of an exported core, in order."""

    __slots__ = ()

    @property
    def pins(self) -> tuple[Port, ...]:
        """Inputs beside clock and reset."""
        return tuple(port for port in self if port.direction == "input" and port.name not in ("clk", "rst"))

    @property
    def outputs(self) -> tuple[Port, ...]:
        """Outputs of the exported core but those of a stream, in order."""
        return tuple(port for port in self if port.direction == "output" and not port.name.startswith(STREAM))

    @property
    def streamed(self) -> tuple[Port, ...]:
        """Outputs of a stream."""
        return tuple(port for port in self if port.direction == "output" and port.name.startswith(STREAM))

    @property
    def strobes(self) -> dict[str, tuple[str, ...]]:
        """Outputs that strobe, each with the names of the outputs that are new with it."""
        outputs = self.outputs
        return {
            strobe.name: tuple(
                port.name for port in outputs if port.held_by == strobe.name and port.name != strobe.name
            )
            for strobe in outputs
            if strobe.is_strobe
        }
