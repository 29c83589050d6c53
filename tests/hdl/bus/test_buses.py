"""Registers on the buses of the exported Verilog, read and written by models that others wrote.

One design has a core on each bus, with the same motion on its pins. Models of masters play random accesses on the three
buses at once, with pauses. The design writes down in which clock each access reached the registers, and what they
answered is held against the golden model.
"""

import json
import os
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import bus_bench
from support.compiled import lint
from support.nightly import only, only_rows
from support.random_case import random_ticks

from tachometry.hdl.export import export
from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.core.index import Index
from tachometry.spec.language.port import Port
from tachometry.spec.registers.buses import BUSES, CAPTURE
from tachometry.spec.registers.map import RegisterMap

# Whatever a register can show; positions have two.
SPEC = STachometer(
    encoder=Encoder(8, 4),
    timing=Timing(1_000_000, 8, 20),
    position_width=48,
    index=Index(),
    age=True,
    filter_clocks=2,
    external_tick=True,
    max_tick_cycles=16,
)
MAP = RegisterMap(SPEC)
NAMES = bus_bench.NAMES

# What happened on each bus, from the levels that the edge of a clock sees. The models drive `reg`: Icarus loses
# what cocotb forces on a net.
TOP = """
module top(input clk, input rst, input a, input b, input z, input tick_in, input capture);
  integer file, clock = 0;
  initial file = $fopen("accesses.txt", "w");
  always @(posedge clk) clock <= rst ? 0 : clock + 1;
@LINES@
  always @(posedge clk) if (!rst) begin
    if (s_apb_psel && !s_apb_penable) $fdisplay(file, "apb %0d %0d", s_apb_pwrite, clock);
    if (s_apb_psel && s_apb_penable && s_apb_pready) $fdisplay(file, "apb_error %0d %0d", s_apb_pwrite, s_apb_pslverr);
    if (wb_ack_o || wb_err_o) $fdisplay(file, "wishbone %0d %0d", wb_we_i, clock - 1);
    if (s_axi_rvalid && !r_waits) $fdisplay(file, "axi-lite 0 %0d", clock - 2);
    if (s_axi_bvalid && !b_waits) $fdisplay(file, "axi-lite 1 %0d", clock - 2);
    if (r_waits && (!s_axi_rvalid || {s_axi_rdata, s_axi_rresp} !== r_kept)) $fdisplay(file, "changed 0 %0d", clock);
    if (b_waits && (!s_axi_bvalid || s_axi_bresp !== b_kept)) $fdisplay(file, "changed 1 %0d", clock);
  end
  reg r_waits = 0, b_waits = 0;
  reg [33:0] r_kept = 0;
  reg [1:0] b_kept = 0;
  always @(posedge clk) begin
    r_waits <= s_axi_rvalid && !s_axi_rready;
    b_waits <= s_axi_bvalid && !s_axi_bready;
    r_kept <= {s_axi_rdata, s_axi_rresp};
    b_kept <= s_axi_bresp;
  end
endmodule
"""


@dataclass(frozen=True)
class Planned:
    """One access of a plan: idle clocks before it, address of the byte, what is written, and which bytes of it."""

    idle: int
    address: int
    data: int | None
    strobes: tuple[int, ...] = (0, 1, 2, 3)


def wired(bus: str) -> str:
    """Return the core on the bus, and what its lines are connected to."""
    ports = [port for port in BUSES[bus].ports(MAP) if port.name != CAPTURE.name]

    def declared(port: Port) -> str:
        kind, end = ("reg", " = 0") if port.direction == "input" else ("wire", "")
        return f"  {kind} [{port.width - 1}:0] {port.name} /* verilator public_flat_rw */{end};"

    names = ["clk", "rst", *(pin.name for pin in SPEC.ports.pins), CAPTURE.name, *(port.name for port in ports)]
    instance = f"  {NAMES[bus]} of_{NAMES[bus]} ({', '.join(f'.{name}({name})' for name in names)});"
    return "\n".join([*map(declared, ports), instance])


def plan(seed: int, bus: str, number: int) -> list[Planned]:
    """Return random accesses: reads of all addresses, there or not, and writes, most of them refused."""
    rng = np.random.default_rng([seed, len(bus)])
    words = 1 << MAP.address_width - 2
    velocity, control, counters = (MAP[name].offset // 4 for name in ("VELOCITY", "CONTROL", "COUNTERS"))
    found = []
    for _ in range(number):
        idle = int(rng.integers(1, 6)) if rng.random() < 0.3 else 0
        word = int(rng.integers(words)) if rng.random() < 0.3 else int(rng.integers(len(MAP.registers)))
        word = int(rng.choice([word, velocity, counters], p=[0.8, 0.15, 0.05]))
        data, strobes = None, tuple(range(4))
        if rng.random() < 0.25:
            word = int(rng.choice([word, control]))
            data = int(rng.integers(1 << 32))
            if rng.random() < 0.9:  # counters are to count
                data &= ~1
            if bus != "apb":
                first = int(rng.choice([0, 1, 2, 3], p=[0.7, 0.1, 0.1, 0.1]))
                strobes = tuple(range(first, int(rng.integers(first + 1, 5))))
        found.append(Planned(idle, 4 * word, data, strobes))
    return found


def motion(seed: int, n_clocks: int) -> tuple[PinTrace, list[int]]:
    """Return fast and slow, to and fro, with glitches, missing ticks and illegal transitions; and
    clocks of captures.
    """
    part = n_clocks / SPEC.timing.clock_hz / 4
    bounce = Bounce(3, 2e-6)
    encoder = VirtualEncoder(8, jitter=0.3, illegal=0.005, bounce=bounce, index=True, seed=seed, start_angle_rad=3)
    parts = [f"sine:-8000rad/s:500Hz:{part / 2}s", f"constant:-3000rad/s:{part}s", f"stop:{part / 2}s"]
    parts += [f"ramp:0rad/s:30000rad/s:{part}s", f"ramp:30000rad/s:-30000rad/s:{part}s"]
    rng = np.random.default_rng(seed)
    trace = encoder.record(parse_motion("+".join(parts))).recording.place(SPEC.timing.clock_hz)
    captures = np.flatnonzero(rng.random(n_clocks) < 0.01)
    return random_ticks(trace, SPEC.timing.tick_cycles, rng), captures.tolist()


def write_design(folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for bus, name in NAMES.items():
        (folder / f"{name}.v").write_text(export(SPEC, name, bus)[f"{name}.v"])
    (folder / "top.v").write_text(TOP.replace("@LINES@", "\n".join(map(wired, NAMES))))


def play(folder: Path, simulator: str, seed: int, number: int, clocks_each: int) -> dict[str, str]:
    """Return the fault on each bus after `number` accesses, each with about `clocks_each` clocks."""
    n_clocks = number * clocks_each
    trace, captures = motion(seed, n_clocks)
    plans = {bus: plan(seed, bus, number) for bus in NAMES}
    names = [pin.name for pin in SPEC.ports.pins]
    # The pins, and `capture` for one clock at a time.
    high = set(captures)
    at = sorted({*trace.clock.tolist(), *captures, *(clock + 1 for clock in captures)})
    rows = np.searchsorted(trace.clock, at, side="right") - 1
    levels = np.stack([trace.lines[name][rows] for name in names], axis=1).tolist()
    told = {
        "clocks": n_clocks,
        "pins": [*names, CAPTURE.name],
        "changes": [[clock, *row, int(clock in high)] for clock, row in zip(at, levels, strict=True)],
        **{bus: [[one.idle, one.address, one.data, one.strobes] for one in plans[bus]] for bus in NAMES},
    }
    (folder / "plan.json").write_text(json.dumps(told))
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", "COCOTB"))}
    command = [sys.executable, bus_bench.__file__, simulator, str(folder)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    answers = json.loads((folder / "answers.json").read_text())
    noted: dict[tuple[str, int], list[int]] = defaultdict(list)
    for line in (folder / "accesses.txt").read_text().splitlines():
        bus, written, value = line.split()
        noted[bus, int(written)].append(int(value))
    assert not noted.keys() - {(bus, kind) for bus in (*NAMES, "apb_error", "changed") for kind in (0, 1)}
    golden = GoldenBank(MAP, replace(trace, n_clocks=max(n_clocks, trace.n_clocks)))
    found = {bus: different(bus, plans[bus], answers[bus], noted, golden, captures) for bus in NAMES}
    changed = noted["changed", 0] + noted["changed", 1]
    found["axi-lite"] = found["axi-lite"] or (f"clock {changed[0]}: an answer that waits changed" if changed else "")
    return found


def different(
    bus: str,
    planned: list[Planned],
    answers: dict[str, list[Any]],
    noted: dict[tuple[str, int], list[int]],
    golden: GoldenBank,
    captures: list[int],
) -> str:
    """Return the first answer that differs from that of the golden model; empty if there is none."""
    done: list[tuple[Access, bool, int | None, bool]] = []
    for kind in (0, 1):
        of_kind = [one for one in planned if (one.data is not None) == bool(kind)]
        clocks, answered = noted[bus, kind], answers["writes" if kind else "reads"]
        if bus == "apb":  # its model knows neither that a write was done nor that there was an error
            errors = noted["apb_error", kind]
            data = [None] * len(errors) if kind else [value for value, _ in answered]
            answered = [[value, bool(error)] for value, error in zip(data, errors, strict=False)]
        if not len(of_kind) == len(clocks) == len(answered):
            return f"{len(of_kind)} accesses, {len(clocks)} of them made, {len(answered)} answered"
        for one, clock, (value, error) in zip(of_kind, clocks, answered, strict=True):
            done.append((Access(clock, one.address // 4, one.data), 0 in one.strobes, value, error))
    done.sort(key=lambda row: row[0].clock)
    # A write without byte 0 does nothing.
    for access, _, _, error in (row for row in done if not row[1]):
        if error:
            return f"{access}: an error"
    done = [row for row in done if row[1]]
    expected = golden.answers([row[0] for row in done], captures)
    shown: dict[int, set[int]] = defaultdict(set)
    for (access, _, value, error), (due, refused) in zip(done, expected, strict=True):
        if error != refused or (access.data is None and due is not None and value != due):
            return f"{access}: {value}, {error}, not {due}, {refused}"
        if access.data is None and due is not None:
            shown[access.address].add(due)
    unread = [one.name for place, one in enumerate(MAP) if len(shown[place]) < 2 - one.constant]
    return f"never read, or always the same: {', '.join(unread)}" if unread else ""


# The most lines and the most states; the others are linted where they are played.
@pytest.mark.parametrize("bus", only(["axi-lite", "uart"], BUSES))
def test_verilog_of_every_bus_has_no_warnings(bus: str, tmp_path: Path) -> None:
    (tmp_path / "tachometer.v").write_text(
        export(SPEC, bus=bus, baud=100_000 if BUSES[bus].baud else None)["tachometer.v"]
    )
    lint(["tachometer.v"], "tachometer", tmp_path)


@pytest.mark.parametrize(
    ("simulator", "seed", "number"),
    # So few that each register of each bus shows two values; the rest is more of the same.
    only_rows([("icarus", 9, 1500)], [("icarus", 9, 1500), ("icarus", 3, 4000), ("verilator", 1, 6000)]),
)
def test_buses_read_what_the_golden_model_says(simulator: str, seed: int, number: int, tmp_path: Path) -> None:
    write_design(tmp_path)
    assert play(tmp_path, simulator, seed, number, clocks_each=12) == dict.fromkeys(NAMES, "")
