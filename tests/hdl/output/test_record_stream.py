"""Records on AXI4-Stream: the box against its rules, cores in Icarus under back-pressure against the golden model."""

import json
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import docs
from support.command import run
from support.nightly import only
from support.simulate import clock_by_clock
from support.verilog import play

from tachometry.hdl.core.register_core import RegisterCore
from tachometry.hdl.export import export
from tachometry.hdl.export.targets.rio import check as check_rio
from tachometry.hdl.output.record_stream import RecordStream
from tachometry.sim import build, golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.golden import stream
from tachometry.sim.golden.front_end import decoded
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import AxesSpec, ParameterError, STachometer, TachometerSpec, of_manifest, of_options, of_texts
from tachometry.spec.core.stream import READY, Part, Stream
from tachometry.spec.registers.demo import DemoMap
from tachometry.spec.registers.map import RegisterMap

PARTS = (Part("time", 32, 0, signed=False), Part("flags", 32, 4, signed=False), Part("position", 5, 8))
SEEN = ["m_axis_tdata", "m_axis_tvalid", "m_axis_tlast", "overruns"]
BASE = {"ppr": "25", "clock": "1MHz", "tick": "40clk", "max-time": "160clk", "max-speed": "500rev/s"}
MORE = {"index": "yes", "index-once": "yes", "health": "yes", "over-speed": "200rev/s", "probe": "1"}
CORES = {
    "s": ("s", MORE | {"compare": "2:3:0:7clk", "preset": "7", "stream": "axi"}),
    "edge": ("mt", {"position-width": "48", "index": "yes", "index-reset": "yes", "stream": "axi:edge:5"}),
    "track": ("track", {"tick": "400clk", "max-time": "1600clk", "stream": "axi:tick:1"}),
}

_C = """
#include <stdio.h>
#include "spindle_regs.h"
int main(void) {
  struct spindle_record one;
  FILE *file = fopen("spindle.bin", "rb");
  while (fread(&one, sizeof one, 1, file) == 1)
    printf("%ld %ld %lld %d\\n", (long)one.time, (long)one.velocity, (long long)one.position,
           (one.flags & SPINDLE_RECORD_LOST_MASK) != 0);
  return 0;
}
"""


@pytest.mark.parametrize("packet", [3, 1])
def test_every_clock_is_as_the_rules_say(packet: int) -> None:
    """Events, takers and clears at random: every clock is as the rules say."""
    rng = np.random.default_rng(packet)
    rows = [
        {
            "event": int(rng.random() < (0.9 if clock % 100 < 30 else 0.2)),
            "m_axis_tready": int(rng.random() < (0.2 if clock % 70 < 40 else 0.8)),
            "flags": int(rng.integers(2)),
            "position": int(rng.integers(-16, 16)),
            "clear": int(rng.random() < 0.01),
        }
        for clock in range(500)
    ]
    seen = clock_by_clock(RecordStream(PARTS, 1, 16, packet), rows, SEEN)
    waits, lost, sent, dropped = None, 0, 0, 0
    for clock, row in enumerate(rows):
        found = seen[clock]
        assert found["m_axis_tvalid"] == (waits is not None), clock
        assert found["overruns"] == dropped, clock
        if waits is not None:
            assert (found["m_axis_tdata"], found["m_axis_tlast"]) == (waits, sent % packet == 0), clock
            waits = None if row["m_axis_tready"] else waits
        if row["event"] and waits is None:
            words = [clock, lost | row["flags"] << 1, row["position"] & 0xFFFFFFFF]
            waits, lost, sent = sum(word << 32 * place for place, word in enumerate(words)), 0, sent + 1
        elif row["event"]:
            lost, dropped = 1, dropped + 1
        dropped = 0 if row["clear"] else dropped
    assert sent > 50


def core(case: str) -> tuple[TachometerSpec, PinTrace]:
    method, more = CORES[case]
    spec = of_texts(method, BASE | more)
    return spec, stress(spec, seed=1, n_edges=40).until(400 * spec.timing.tick_cycles)


@pytest.mark.parametrize("case", only(["s", "edge"], CORES))
def test_exported_verilog_sends_what_the_golden_stream_does(case: str, tmp_path: Path) -> None:
    spec, trace = core(case)
    files = export(spec)
    pins, outputs = [*spec.ports.pins], [*spec.ports.streamed]
    changes = np.stack([trace.clock, *(trace.lines[pin.name] for pin in pins)], axis=1).astype(np.int64)
    found = play(files["tachometer.v"], pins, outputs, ["m_axis_tvalid"], tmp_path, changes, trace.n_clocks)
    steps = decoded(spec, trace)
    clock, records = stream.records(spec, trace, steps, golden.tables(spec, trace, steps))
    described = json.loads(files["tachometer.json"])["stream"]
    known = clock > golden.run(spec, trace).updates.clock[0]
    ready = trace.at(found[:, 0].astype(np.int64))[READY]
    begins = np.append(True, ready[:-1] != 0)  # of records: the one before was taken
    assert found[begins, 0].tolist() == clock.tolist()
    data = b"".join(int(word).to_bytes(records.itemsize, "little") for word in found[begins, 1])
    got = np.frombuffer(data, np.dtype(described["dtype"]))
    for name in got.dtype.names or ():
        assert got[name][known].tolist() == records[name][known].tolist(), name
    assert found[begins, 3].tolist() == [int(place % described["packet"] == 0) for place in range(1, len(clock) + 1)]
    held = np.cumsum(begins) - 1
    assert (found[:, 1:] == found[begins, 1:][held]).all()
    assert np.diff(found[:, 0])[~begins[1:]].tolist() == [1] * int(np.count_nonzero(~begins))
    assert described["flags"][0] == "lost"
    assert 10 < np.count_nonzero(got["flags"] & 1) < len(got) - 10
    assert len(np.unique(got["flags"])) > (20 if case == "s" else 2)


def test_registers_have_the_records_that_were_dropped() -> None:
    spec = of_texts("m", BASE | {"tick": "8clk", "max-time": "32clk", "stream": "axi:tick"})
    trace = stress(spec, seed=1, n_edges=40).until(2000)
    registers = RegisterMap(spec)
    words = {register.name: register.offset // 4 for register in registers}
    rng = np.random.default_rng(1)
    accesses = []
    for clock in range(5, trace.n_clocks - 2, 9):
        data = 1 if rng.random() < 0.03 else None
        accesses.append(Access(clock, words["CONTROL" if data else "VELOCITY"], data))
        accesses.append(Access(clock + 1, words["OVERRUNS"], None))
    rows: list[dict[str, int]] = [{"bus.read": 0, "bus.write": 0} for _ in range(trace.n_clocks)]
    for clock, *levels in zip(trace.clock.tolist(), *trace.lines.values(), strict=True):
        rows[clock] |= {name: int(level) for name, level in zip(trace.lines, levels, strict=True) if name != "z"}
    for access in accesses:
        kind = {"bus.read": 1} if access.data is None else {"bus.write": 1, "bus.write_data": access.data}
        rows[access.clock] |= {"bus.address": access.address, **kind}
    seen = clock_by_clock(RegisterCore(registers), rows, ["bus.read_data"])
    answers = GoldenBank(registers, trace).answers(accesses)
    wrong = [
        (access, data)
        for access, (data, _) in zip(accesses, answers, strict=True)
        if access.address == words["OVERRUNS"] and seen[access.clock + 1]["bus.read_data"] != data
    ]
    assert wrong == []
    assert len({data for access, (data, _) in zip(accesses, answers, strict=True)}) > 20


def test_the_page_reads_records_and_so_does_c(tmp_path: Path) -> None:
    page = docs.page("guides/integration.md")
    (command,) = re.findall(r"```console\n(tachometry generate .*--stream.*)\n", page)
    (shown,) = re.findall(r"```python\n(about = .*?)```", page, re.DOTALL)
    assert run(*command.split()[1:-1], tmp_path) == 0
    spec = of_manifest(tmp_path / "spindle.json").tachometer
    trace = stress(spec, seed=1, n_edges=10)
    steps = decoded(spec, trace)
    clock, records = stream.records(spec, trace, steps, golden.tables(spec, trace, steps))
    records.tofile(tmp_path / "spindle.bin")
    shown = shown.replace("rtl/", f"{tmp_path}/").replace("spindle.bin", f"{tmp_path}/spindle.bin")
    found: dict[str, Any] = {"json": json, "np": np, "Path": Path}
    exec(shown, found)
    assert found["seconds"].tolist() == ((clock - 1) % 2**32 / 1e8).tolist()
    assert np.abs(found["rad_per_s"]).max() == np.abs(records["velocity"]).max() * spec.velocity.rad_per_s_per_lsb
    assert found["lost"].tolist() == (records["flags"] & 1).tolist()
    (tmp_path / "main.c").write_text(_C)
    flags = ("-x", "c", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-o", "main", "main.c")
    build.run([*build.compiler(), *flags], "compiler", tmp_path)
    said = subprocess.run([tmp_path / "main"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    rows = [[int(word) for word in line.split()] for line in said.splitlines()]
    names = ("time", "velocity", "position")
    assert rows == [[*(int(one[name]) for name in names), int(one["flags"]) & 1] for one in records]


@pytest.mark.parametrize("text", ["axi:update:256", "axi:edge:1", "axi:tick:65536"])
def test_a_stream_is_written_as_it_is_read(text: str) -> None:
    spec = of_texts("s", BASE | {"stream": text})
    assert str(spec.stream) == text
    assert of_options(spec.options) == spec
    assert replace(spec, stream=None).ports == of_texts("s", BASE).ports


@pytest.mark.parametrize("text", ["axi4", "axi:clock", "axi:edge:0", "axi:edge:65537", "axi::3", ""])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(ParameterError, match="stream must be axi, or axi: and update, tick or edge, and maybe :N"):
        Stream.parse("stream", text)


def test_cores_that_send_none_refuse_it() -> None:
    spec = of_texts("s", BASE | {"stream": "axi"})
    assert isinstance(spec, STachometer)
    with pytest.raises(ParameterError, match="stream must be left out with --axes"):
        AxesSpec(tachometer=spec, axes=4)
    with pytest.raises(ParameterError, match="stream must be left out of a demo"):
        DemoMap(spec)
    with pytest.raises(ParameterError, match="stream must not be given for RIO"):
        check_rio(spec)
