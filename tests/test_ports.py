"""Every output port is in the waveform, in a CSV, in the comparison and in the testbench, whatever the options."""

import csv
import json
from pathlib import Path

import pytest
from support.nightly import only

from tachometry.hdl import Tachometer
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.probes import shown
from tachometry.sim.signals.run import Run, compare
from tachometry.sim.signals.tables import write_counts, write_events, write_trace
from tachometry.sim.studies.pairs import configurations, spec_of
from tachometry.sim.testbench.vectors import strobe_rows
from tachometry.spec import METHODS, TachometerSpec
from tachometry.spec.registers.manifest import manifest


def heads(path: Path) -> list[str]:
    with path.open(newline="") as file:
        return next(csv.reader(file))


def changed(run: Run, strobe: str, name: str) -> Run:
    """Return the run with one bit of one port wrong in its first row."""
    table = run.tables[strobe]
    column = table[name].copy()
    column[0] ^= 1
    return Run(run.n_clocks, run.tables | {strobe: table.having(**{name: column})})


@pytest.mark.parametrize("whole", only([False], [False, True]))
@pytest.mark.parametrize("method", METHODS)
def test_every_port(method: str, whole: bool, tmp_path: Path) -> None:
    """Of all cores, the most ports first; or of those that have one which none before them has."""
    seen = set[str]()
    for spec in sorted(map(spec_of, configurations(method)), key=lambda spec: -len(spec.ports.outputs)):
        ports = {port.name for port in spec.ports.outputs}
        if whole or ports - seen:
            check(spec, tmp_path)
        seen |= ports


def check(spec: TachometerSpec, tmp_path: Path) -> None:
    trace = stress(spec, seed=1, n_edges=40)
    run = golden.run(spec, trace.until(min(trace.n_clocks, 100_000)))
    write_trace(tmp_path / "trace", spec, run)
    write_counts(tmp_path / "counts", run)
    write_events(tmp_path / "events", run)
    # The rows of these files are the strobes.
    listed = {"tick", "velocity_valid", *heads(tmp_path / "trace"), *heads(tmp_path / "counts")}
    listed |= {*heads(tmp_path / "events")} | {*run.tables}
    listed |= {"velocity"} if "velocity_raw" in listed else set()
    widths = {name: (len(value), value.shape().signed) for name, value in shown(Tachometer(spec)).items()}
    vectors = strobe_rows(run)
    described = {port["name"] for port in manifest(spec)["ports"]}
    for port in spec.ports.outputs:
        assert port.name in listed, f"{port.name} is in no CSV"
        assert widths[port.name] == (port.width, port.signed), f"{port.name} is not in the waveform"
        assert port.name in described
        assert port.help.endswith("."), f"{port.name} is not explained"
        if port.is_strobe:
            without = Run(run.n_clocks, run.tables | {port.name: run.tables[port.name].rows(slice(1, None))})
            assert bool(compare(run, without)[0]) == bool(len(run.tables[port.name]))
        elif len(run.tables[port.held_by]):
            assert port.name in vectors[port.held_by]["ports"], f"{port.name} is not in the testbench"
            count, (first,) = compare(run, changed(run, port.held_by, port.name))
            assert (count, first.signal) == (1, f"{port.held_by}.{port.name}")
    assert json.dumps(vectors)
