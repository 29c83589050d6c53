"""Probes, from the pins and the words of the command line alone; see `extras.harness`."""

import re
import zipfile
from pathlib import Path

import numpy as np
from extras.harness import Case, agreeing, in_icarus, on_a_bus

from tachometry.sim import golden
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder

CASES = (
    Case("s", "probe=rising,falling,both index=yes"),
    Case("track", "probe=2 tick=500clk max-time=2000clk preset=40 unit=rpm lowpass=100Hz", 10, 20_000, late=True),
    Case("m", "probe=both,both filter=3clk max-speed=100rev/s position-width=8"),
)
BUS = Case("s", "probe=rising,falling,both position-width=8", edges=40)


def rule(case: Case) -> None:
    """An edge of an armed probe latches the sum of all steps up to it, and the clocks since the latest."""
    spec, run = case.spec, case.run()
    if spec.filter_clocks or spec.preset is not None:
        return
    edges = {"rising": (1,), "falling": (-1,), "both": (1, -1)}
    late, end = (
        spec.latency_entries["pin_to_probe"],
        2 ** next(port.width for port in spec.ports if port.name == "probe_time_0") - 1,
    )
    steps = case.steps()
    sums, counted = np.cumsum(steps), np.maximum.accumulate(np.where(steps, np.arange(len(steps)), -1))
    probe, arm = case.level("probe"), case.level("probe_arm")
    for number, kind in enumerate(case.texts["probe"].split(",")):
        latched, wanted = False, []
        for clock in range(1, len(steps) - late):
            edge = (probe[clock] >> number & 1) - (probe[clock - 1] >> number & 1) in edges[kind]
            if edge and not latched:
                since = clock - counted[clock] if counted[clock] >= 0 else end
                wanted.append((clock + late, int(sums[clock]), min(int(since), end)))
            latched = (latched or edge) and not arm[clock + late - 1] >> number & 1
        table = run.tables[f"probe_valid_{number}"]
        shown = zip(table.clock, table[f"probe_position_{number}"], table[f"probe_time_{number}"], strict=True)
        assert [tuple(map(int, row)) for row in shown] == wanted
        assert len(wanted) > 5


test_cores = agreeing(CASES, rule)
test_bus = on_a_bus(BUS)
test_verilog = in_icarus(CASES[0])


def test_fine_position_and_velocity_say_where_an_even_shaft_was() -> None:
    """At 3 rev/s of 100 counts: within 0.03 counts, wherever between two ticks the probe rises."""
    spec = Case("track", "clock=10MHz tick=600clk max-time=99ms probe=1").spec
    trace = VirtualEncoder(25).record(parse_motion("constant:3rev/s:2s")).recording.place(10_000_000)
    rises = np.arange(15_000_000, 19_900_000, 123_457)
    latched = golden.run(spec, trace.with_pulses("probe_0", rises, 9).completed(spec)).tables["probe_valid_0"]
    assert latched.clock.tolist() == (rises + spec.latency_entries["pin_to_probe"]).tolist()
    shown = latched.probe_fine_0 / 64 + 3 * 100 * latched.probe_age_0 / 10e6
    assert np.ptp(shown - 3 * 100 * rises / 10e6) < 0.03
    assert np.ptp(latched.probe_age_0) > 500
    assert latched.probe_age_0.max() < 1 << next(port.width for port in spec.ports if port.name == "probe_age_0")


def test_a_capture_has_the_wires_of_a_core_with_probes(tmp_path: Path) -> None:
    trace = Case("s", "probe=2 preset=7").trace()
    write_sr(tmp_path / "c.sr", trace, 1_000_000)
    with zipfile.ZipFile(tmp_path / "c.sr") as file:
        text = file.read("metadata").decode()
    assert re.findall(r"^probe\d+=(\w+)$", text, re.MULTILINE) == ["A", "B", "Z", "PRESET"]
    assert np.array_equal(trace.level >> 3, trace.lines["preset"])
