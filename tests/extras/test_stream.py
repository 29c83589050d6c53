"""A stream, under back-pressure, against its golden records; see `extras.harness`."""

import json
import re
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extras.harness import Case, agreeing, in_icarus, on_a_bus, refused
from support import docs
from support.command import run
from support.simulate import clock_by_clock

from tachometry.hdl.core.tachometer import Tachometer
from tachometry.hdl.export.targets.rio import check as check_rio
from tachometry.sim import build, golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.golden.extras.stream import records
from tachometry.sim.golden.front_end import decoded
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import AxesSpec, ParameterError, STachometer, of_manifest
from tachometry.spec.registers.demo import DemoMap

FAST = "tick=40clk max-time=160clk max-speed=500rev/s"
CASES = (
    Case(
        "s",
        f"{FAST} index=yes index-once=yes health=yes over-speed=200rev/s probe=1 "
        "position-compare=2:3:0:7clk stream=axi",
    ),
    Case("mt", f"{FAST} position-width=48 index=yes index-reset=yes stream=axi:edge:5"),
    Case("track", "tick=400clk max-time=1600clk stream=axi:update:1", clocks=8000),
)
BUS = Case("m", "tick=8clk max-time=32clk stream=axi:tick", edges=40)
DATA, VALID, LAST = "m_axis_tdata", "m_axis_tvalid", "m_axis_tlast"


# Of each core the bytes of a record, as `struct` has them, their names, and the bits of `flags` from the lowest on.
LAYOUTS = {
    "s": (
        "<IIii",
        "time flags position velocity",
        "forced overflow standstill homed probed position_compare fault over_speed",
    ),
    "mt": ("<IIqi12x", "time flags position velocity", "forced overflow standstill out_of_range"),
    "track": ("<IIqiii4x", "time flags position_fine position velocity acceleration", "forced overflow standstill"),
}


def played(spec: Any, trace: PinTrace, shown: list[str]) -> tuple[dict[int, Any], Any]:
    """Return the golden records by their clocks, and what gates show in each clock."""
    rows: list[dict[str, int]] = [{} for _ in range(trace.n_clocks)]
    for number, clock in enumerate(trace.clock.tolist()):
        rows[clock] = {pin.name: int(trace.lines[pin.name][number]) for pin in spec.ports.pins}
    steps = decoded(spec, trace)
    clocks, golden_records = records(spec, trace, steps, golden.tables(spec, trace, steps))
    return dict(zip(clocks.tolist(), golden_records, strict=True)), clock_by_clock(Tachometer(spec), rows, shown)


def rule(case: Case) -> None:
    """Each record comes in its clock, holds until it is taken, has the ports of its event, and ends its packet."""
    spec, trace = case.spec, case.trace().until(4000)
    form, (names, flags) = LAYOUTS[case.method][0], (words.split() for words in LAYOUTS[case.method][1:])
    packet = int(([*case.texts["stream"].split(":"), "256"][2:] or ["256"])[0])
    words, seen = played(spec, trace, [DATA, VALID, LAST, *names[2:], *flags])
    known = golden.run(spec, trace).updates.clock[0]
    held, sent, lost, ready = None, 0, 0, case.level("m_axis_tready")
    for clock, row in enumerate(seen):
        out = [row[name] for name in (DATA, LAST)]
        if clock in words:
            assert held is None, clock
            held, sent = out, sent + 1
            record = dict(
                zip(names, struct.unpack(form, row[DATA].to_bytes(struct.calcsize(form), "little")), strict=True)
            )
            lost += record["flags"] & 1
            before = seen[clock - 1]
            bits = sum(before[name] << bit for bit, name in enumerate(flags, 1))
            assert record == {"time": clock - 1, "flags": bits | record["flags"] & 1} | {
                name: before[name] for name in names[2:]
            }
            assert clock < known + 2 or record == {name: int(words[clock][name]) for name in names}, clock
            assert row[LAST] == (sent % packet == 0)
        assert row[VALID] == (held is not None), clock
        assert held is None or out == held, clock
        held = None if ready[clock] else held
    assert sent > 4
    assert lost or case.method == "track"


def test_an_edge_between_the_velocity_and_the_rest_has_the_update_before() -> None:
    spec, clock = Case("track", "tick=400clk max-time=1600clk stream=axi:edge").spec, np.arange(0, 6000, 250)
    level, one = quadrature(np.arange(len(clock))), np.uint8(1)
    lines = {"a": level & one, "b": level >> one, "m_axis_tready": np.full_like(level, 1)}
    words, seen = played(spec, PinTrace.of_lines(clock, 6200, lines).completed(spec), [DATA, "velocity"])
    found = {at: seen[at][DATA] >> 160 & (1 << 32) - 1 for at in words}
    assert found == {at: int(record["velocity"]) for at, record in words.items()}
    assert any(found[at] != seen[at - 1]["velocity"] for at in words)


test_cores = agreeing(CASES, rule)
test_bus = on_a_bus(BUS)
test_verilog = in_icarus(CASES[0])
OTHER = "stream must be axi, or axi: and update, tick or edge, and maybe :N"
test_refusals = refused(
    {f"stream={text}": OTHER for text in ("axi4", "axi:clock", "axi:edge:0", "axi:edge:65537", "axi::3", "")}
)


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


def test_the_page_reads_records_and_so_does_c(tmp_path: Path) -> None:
    page = docs.page("guides/integration.md")
    (command,) = re.findall(r"```console\n(tachometry generate .*--stream.*)\n", page)
    (shown,) = re.findall(r"```python\n(about = .*?)```", page, re.DOTALL)
    assert run(*command.split()[1:-1], tmp_path) == 0
    spec = of_manifest(tmp_path / "spindle.json").tachometer
    trace = stress(spec, seed=1, n_edges=10)
    steps = decoded(spec, trace)
    clock, sent = records(spec, trace, steps, golden.tables(spec, trace, steps))
    sent.tofile(tmp_path / "spindle.bin")
    shown = shown.replace("rtl/", f"{tmp_path}/").replace("spindle.bin", f"{tmp_path}/spindle.bin")
    found: dict[str, Any] = {"json": json, "np": np, "Path": Path}
    exec(shown, found)
    assert found["seconds"].tolist() == ((clock - 1) % 2**32 / 1e8).tolist()
    assert np.abs(found["rad_per_s"]).max() == np.abs(sent["velocity"]).max() * spec.velocity.rad_per_s_per_lsb
    assert found["lost"].tolist() == (sent["flags"] & 1).tolist()
    (tmp_path / "main.c").write_text(_C)
    flags = ("-x", "c", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-o", "main", "main.c")
    build.run([*build.compiler(), *flags], "compiler", tmp_path)
    said = subprocess.run([tmp_path / "main"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    rows = [[int(word) for word in line.split()] for line in said.splitlines()]
    names = ("time", "velocity", "position")
    assert rows == [[*(int(one[name]) for name in names), int(one["flags"]) & 1] for one in sent]


def test_cores_that_send_none_refuse_it() -> None:
    spec = Case("s", "stream=axi").spec
    assert isinstance(spec, STachometer)
    with pytest.raises(ParameterError, match="stream must be left out with --axes"):
        AxesSpec(tachometer=spec, axes=4)
    with pytest.raises(ParameterError, match="stream must be left out of a demo"):
        DemoMap(spec)
    with pytest.raises(ParameterError, match="stream must not be given for RIO"):
        check_rio(spec)
