"""Probes against their rules clock by clock, and a core with probes against the golden model."""

import re
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.simulate import clock_by_clock
from support.verilog import play_native

from tachometry.hdl.front_end import probe_latch
from tachometry.sim import golden
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.stress import stress
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.core.probe import RISING
from tachometry.spec.registers.map import RegisterMap

BASE = {"ppr": "25", "clock": "1MHz", "tick": "20clk", "max-time": "60clk", "probe": "rising,falling,both"}
SEEN = ["probed", *(f"probe_{name}_{k}" for k in range(2) for name in ("valid", "position", "time", "fine", "age"))]
END = 15  # of a time of four bits
LATE, OLD = 7, 31  # clocks to an update, and the end of an age of five bits


@pytest.mark.parametrize("latency", [2, 3])
def test_every_clock_is_as_the_rules_say(latency: int) -> None:
    """Two probes with edges of their own, which change, on levels, steps and arms at random."""
    rng = np.random.default_rng(0)
    rows, position = [], 0
    held = {"level": 0, "edges": 0b0110}
    for clock in range(400):
        held |= {"edges": int(rng.integers(16))} if rng.random() < 0.02 else {}
        held |= {"level": int(rng.integers(4))} if rng.random() < 0.3 else {}
        step = int(rng.choice([-1, 1])) if rng.random() < (0.5 if clock % 100 < 50 else 0.03) else 0
        arm = int(rng.integers(4)) if rng.random() < 0.2 else 0
        held |= {"update": int(rng.random() < (0.08 if clock % 200 < 120 else 0)), "fine": int(rng.integers(-32, 32))}
        rows.append({**held, "ready": 3 if clock > 5 else 0, "step": step, "arm": arm})
    sums = np.cumsum([row["step"] for row in rows])
    for clock, row in enumerate(rows):  # the position of the next clock has the steps up to that of `latency` − 1 ago
        at = clock - latency + 1
        row["position"] = int(sums[at] + 16) % 32 - 16 if at >= 0 else 0
    box = probe_latch.ProbeLatch(0b0110, 2, 5, 4, latency, fine_width=6, age_width=5, update_latency=LATE)
    seen = clock_by_clock(box, rows, SEEN)
    probed, wanted = [0, 0], dict.fromkeys(SEEN, 0)
    for clock in range(1, len(rows)):
        known, at = clock - 1, clock - latency  # the clock before, and that of the edge
        for probe in range(2):
            wanted[f"probe_valid_{probe}"] = 0
            edge = False
            if at > 0 and rows[at]["ready"]:
                before, now = (rows[row]["level"] >> probe & 1 for row in (at - 1, at))
                asked = rows[known - 1]["edges"] >> 2 * probe
                edge = (now > before and bool(asked & 1)) or (now < before and bool(asked & 2))
            if edge and not probed[probe]:
                counts = [row for row in range(at + 1) if rows[row]["step"]]
                position = int(sums[at] + 16) % 32 - 16
                wanted[f"probe_valid_{probe}"] = 1
                wanted[f"probe_position_{probe}"] = position
                wanted[f"probe_time_{probe}"] = min(at - counts[-1], END) if counts else END
                ends = [row - LATE for row in range(known + 1) if rows[row]["update"]]
                wanted[f"probe_fine_{probe}"] = rows[known]["fine"]
                wanted[f"probe_age_{probe}"] = min(at - ends[-1], OLD) if ends else OLD
            probed[probe] = int((probed[probe] or edge) and not rows[known]["arm"] >> probe & 1)
        wanted["probed"] = probed[0] | probed[1] << 1
        assert seen[clock] == wanted, (latency, clock)
    assert min(len({row[f"probe_{name}_0"] for row in seen}) for name in ("position", "fine", "age")) > 2


@pytest.mark.parametrize("clocks", [0, 2])
def test_an_edge_of_a_probe_and_a_count_of_the_same_clock_are_in_order(clocks: int) -> None:
    """A rises in clock 20, and the probe in a clock before it, with it, and after it."""
    spec = of_texts("s", BASE | {"probe": "2", "filter": f"{clocks}clk"})
    edge = PinTrace(np.array([0, 20]), np.array([0, 1], np.uint8), np.zeros(2, np.uint8), 80)
    for at, position, time in ((19, 0, 127), (20, 1, 0), (21, 1, 1)):
        trace = edge.with_pulses("probe_1", np.array([at]), 40).completed(spec)
        found = lockstep(spec, trace, PySim())
        assert found.n_mismatches == 0, found.first
        assert not len(found.actual.tables["probe_valid_0"])
        latched = found.actual.tables["probe_valid_1"]
        assert latched.probe_position_1.tolist() == [position]
        assert latched.probe_time_1.tolist() == [min(time, 2**spec.times.probe_width - 1)]
        assert latched.clock.tolist() == [at + spec.latency_entries["pin_to_probe"]]


@pytest.mark.parametrize(("before", "latches"), [(1, True), (2, False)])
def test_edges_that_a_program_sets_hold_from_the_clock_after(before: int, latches: bool) -> None:
    """An edge is known a clock before it is shown, by what is set before that."""
    spec = of_texts("s", BASE | {"probe": "1"})
    set_at = 20 + spec.latency_entries["pin_to_probe"] - before
    low, edges = np.zeros(3, np.uint8), np.array([RISING, RISING, 0])
    trace = PinTrace(np.array([0, 20, set_at]), low, low, 80, more={"probe": np.array([0, 1, 1]), "probe_edges": edges})
    assert len(golden.tables(spec, trace.completed(spec))["probe_valid_0"]) == latches


def test_fine_position_and_velocity_say_where_an_even_shaft_was() -> None:
    """At 3 rev/s of 100 counts: within 0.03 counts, wherever between two ticks the probe rises."""
    spec = of_texts("track", BASE | {"clock": "10MHz", "tick": "600clk", "max-time": "99ms", "probe": "1"})
    trace = VirtualEncoder(25).record(parse_motion("constant:3rev/s:2s")).recording.place(10_000_000)
    rises = np.arange(15_000_000, 19_900_000, 123_457)
    run = golden.run(spec, trace.with_pulses("probe_0", rises, 9).completed(spec))
    latched = run.tables["probe_valid_0"]
    assert len(latched) == len(rises)
    late = spec.latency_entries["pin_to_probe"]
    assert latched.clock.tolist() == (rises + late).tolist()
    shown = latched.probe_fine_0 / 64 + 3 * 100 * latched.probe_age_0 / 10e6
    assert np.ptp(shown - 3 * 100 * rises / 10e6) < 0.03
    assert np.ptp(latched.probe_age_0) > 500


CORES = {
    "s": ("s", {"index": "yes", "index-reset": "yes"}),
    "track": ("track", {"tick": "500clk", "max-time": "2000clk", "preset": "40", "unit": "rpm", "lowpass": "100Hz"}),
    "filter": ("m", {"filter": "3clk", "max-speed": "100rev/s", "position-width": "8"}),
}


@pytest.mark.parametrize("case", CORES)
def test_hardware_is_the_golden_model(case: str) -> None:
    method, more = CORES[case]
    spec = of_texts(method, BASE | more)
    found = lockstep(
        spec,
        stress(spec, seed=1, n_edges=10 if case == "track" else 40).until(20_000 if case == "track" else 9000),
        PySim(),
    )
    assert found.n_mismatches == 0, found.first
    assert all(len(found.actual.tables[f"probe_valid_{probe}"]) > 1 for probe in range(3))


def case_on_a_bus() -> tuple[TachometerSpec, RegisterMap, PinTrace, list[Access]]:
    """Return a core, its motion, and reads and writes of all registers, most of them those of probes."""
    spec = of_texts("s", BASE | {"compare": "list:3:2clk", "position-width": "8"})
    trace = stress(spec, seed=2, n_edges=40).until(2500)
    registers = RegisterMap(spec, irq=True)
    ticks = golden.tables(spec, trace)["tick"]
    rng = np.random.default_rng(1)
    places = {register.name: register.offset // 4 for register in registers}
    accesses = []
    for clock in range(5, trace.n_clocks - 1, 3):
        address, data = int(rng.integers(len(places))), None
        if rng.random() < 0.2:
            name = rng.choice(
                ["PROBE_ARM", "PROBE_EDGES", "INTERRUPT_ENABLE", "INTERRUPT_CLEAR", "COMPARE_NEXT", "COMPARE_LIST"],
                p=[0.2, 0.1, 0.1, 0.1, 0.2, 0.3],
            )
            address, data = places[str(name)], int(rng.integers(1 << 8))
            if name == "COMPARE_NEXT":  # mostly ahead of the shaft
                here = ticks.position[np.searchsorted(ticks.clock, clock) - 1]
                data = int(here + np.sign(ticks.position[-1]) * (data % 8 + 2)) & 0xFF
            elif name == "COMPARE_LIST":
                data = 2 if data % 3 == 0 else 1
        accesses.append(Access(clock, address, data))
    return spec, registers, trace, accesses


def test_registers_and_interrupt_of_exported_verilog(tmp_path: Path) -> None:
    spec, registers, trace, accesses = case_on_a_bus()
    rows: list[dict[str, int]] = [{"capture": 0, "read": 0, "write": 0} for _ in range(trace.n_clocks)]
    for clock, *levels in zip(trace.clock.tolist(), trace.a, trace.b, trace.lines["probe"], strict=True):
        rows[clock] |= dict(zip(("a", "b", "probe"), map(int, levels), strict=True))
    for access in accesses:
        kind = {"read": 1} if access.data is None else {"write": 1, "write_data": access.data}
        rows[access.clock] |= {"address": access.address, **kind}
    seen = play_native(spec, tmp_path, rows, ["reg_read_data", "reg_error", "irq"], irq=True)
    bank = GoldenBank(registers, trace)
    told = set()
    for access, (data, error) in zip(accesses, bank.answers(accesses), strict=True):
        got = seen[access.clock + 1][0] if data is not None else None, bool(seen[access.clock + 1][1])
        assert got == (data, error), f"{access}: {got}, not {data}, {error}"
        name = registers.registers[access.address].name
        told |= {(name, data)} if name.startswith(("PROBE", "COMPARE")) else set()
    assert len([name for name, _ in told if name.startswith("PROBE")]) > 20
    assert len([name for name, _ in told if name == "COMPARE_WAITING"]) == 4
    assert len([name for name, _ in told if name == "COMPARE_COUNT"]) > 2
    assert [bool(row[2]) for row in seen] == bank.irq(accesses, trace.n_clocks)[: len(seen)]
    assert len(bank.interrupts()["probe"]) > 10


def test_a_capture_has_the_wires_of_a_core_with_probes(tmp_path: Path) -> None:
    spec = of_texts("s", BASE | {"probe": "2", "preset": "7"})
    trace = stress(spec, 3)
    write_sr(tmp_path / "c.sr", trace, spec.timing.clock_hz)
    with zipfile.ZipFile(tmp_path / "c.sr") as file:
        text = file.read("metadata").decode()
    names = re.findall(r"^probe\d+=(\w+)$", text, re.MULTILINE)
    assert names == ["A", "B", "Z", "PRESET"]
    assert trace.level.max() < 1 << len(names)
    assert np.array_equal(trace.level >> 3, trace.lines["preset"])


def test_a_number_of_probes_is_taken_in_python_too() -> None:
    spec = of_texts("s", BASE | {"probe": "2"})
    assert replace(spec, probe="2").front_end.probes == spec.front_end.probes == ("probe_0", "probe_1")
