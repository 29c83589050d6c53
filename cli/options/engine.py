"""Options of the simulation: what runs the hardware, and which part of it the waveform shows."""

from typing import Any

import click
import numpy as np

from tachometry.cli.options.option import Group, option
from tachometry.sim.signals.arrays import Ints
from tachometry.sim.studies.simulation import Running
from tachometry.spec import CoreSpec, ParameterError, TachometerSpec
from tachometry.spec.core.timing import time_or_clocks

_SIMULATION = "Simulation"

_PULSE = """Times at which an input rises, as preset:20ms,35ms. Inputs are preset (with --preset), home (with \
--index-once) and probe_0 and so on (with --probe). It can be given for each input."""


_OPTIONS = [
    option(
        _SIMULATION,
        "--engine",
        type=click.Choice(["auto", "pysim", "cxxrtl", "verilator", "cxxrtl-every-clock"], case_sensitive=False),
        default="auto",
        help="Simulator of the hardware. pysim is Amaranth's simulator and runs some 10,000 clocks a second. cxxrtl is "
        "compiled and runs 10,000,000 and more, but needs a C++ compiler and some seconds for a new core; it skips "
        "clocks in which only a timer counts. cxxrtl-every-clock skips none. verilator is compiled from the exported "
        "Verilog. auto is cxxrtl if there is a compiler, else pysim.",
    ),
    option(_SIMULATION, "--pulse INPUT:TIME,TIME…", multiple=True, help=_PULSE),
    option(_SIMULATION, "--vcd-from TIME", help="Start of the waveform of --vcd, such as 20us or 960clk."),
    option(_SIMULATION, "--vcd-to TIME", help="End of the waveform of --vcd, such as 20us or 960clk."),
]


def _read(
    *, engine: str, vcd_from: str | None, vcd_to: str | None, pulse: tuple[str, ...], **others: Any
) -> dict[str, Any]:
    def window(spec: CoreSpec, n_clocks: int) -> tuple[int, int]:
        begin = 0 if vcd_from is None else _clock("vcd_from", vcd_from, spec)
        end = n_clocks if vcd_to is None else min(_clock("vcd_to", vcd_to, spec), n_clocks)
        if begin >= end:
            raise ValueError(f"--vcd-from must be before --vcd-to and the end of the run, clock {end}, not {begin}")
        return begin, end

    if (vcd_from is not None or vcd_to is not None) and "--vcd" not in others["targets"]:
        raise ValueError("--vcd must be given together with --vcd-from and --vcd-to")
    return dict(running=Running(engine, window, lambda spec: _pulses(spec, pulse)), **others)


ENGINE_OPTIONS = Group(_OPTIONS, _read)
"""Handed over as `running`, see `Running`."""


def _pulses(spec: TachometerSpec, texts: tuple[str, ...]) -> dict[str, Ints]:
    """Return clocks in which inputs rise, by their names."""
    found: dict[str, Ints] = {}
    apart = 2 * (spec.filter_clocks + 1)  # high and low as long as the filter asks for
    for text in texts:
        name, colon, times = text.partition(":")
        if not (pulsed := spec.front_end.pulsed):
            raise ParameterError("pulse", "must be given together with --preset, --index-once or --probe")
        if name not in pulsed or not colon:
            form = f"must be INPUT:TIME,TIME… of {' or '.join(pulsed)}, such as {pulsed[0]}:{times or '20ms'}"
            raise ParameterError("pulse", f"{form}, not {text!r}")
        if name in found:
            whole = ",".join(each.partition(":")[2] for each in texts if each.startswith(f"{name}:"))
            raise ParameterError("pulse", f"must be given once for {name}: type --pulse {name}:{whole}")
        clocks = np.sort([_clock("pulse", time, spec) for time in times.split(",")])
        if len(near := np.flatnonzero(np.diff(clocks) < apart)):
            rest = f"must have times at least {apart} clocks apart, not {clocks[near[0]]} and {clocks[near[0] + 1]}"
            raise ParameterError("pulse", rest)
        found[name] = clocks
    return found


def _clock(what: str, text: str, spec: CoreSpec) -> int:
    """Return the clock in which an instant lies."""
    if (seconds := time_or_clocks(what, text, spec.timing.clock_hz)) < 0:
        raise ParameterError(what, f"must be at least 0, not {text}")
    return int(seconds * spec.timing.clock_hz)
