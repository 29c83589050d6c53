"""The plugin for RIO: its Verilog and its C code, from the pins of the FPGA to those of HAL, against the golden model."""

import json
import re
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.compiled import lint
from support.lockstep import random_case
from support.mutant import caught
from support.rio import component, hal_type, loaded

from tachometry.hdl import export
from tachometry.sim import golden
from tachometry.sim.engines import build
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import METHODS, TachometerSpec, of_texts
from tachometry.spec.port import INDEX, TICK, UPDATE
from tachometry.spec.targets.rio import hal_pins, rio_files

NAME = "spindle"
PLUGIN, WRAPPER, CORE = rio_files(NAME)
BASE = {"ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us"}
EVERY = {
    "s": {"external-tick": "yes", "index": "yes", "filter": "4", "unit": "rpm", "bounds": "yes", "age": "yes"},
    "m": {"decoding": "1", "lowpass": "20Hz", "velocity-width": "12"},
    "t": {"decoding": "2", "index": "yes", "position-width": "8"},
    "mt": {"external-tick": "yes", "bounds": "yes"},
    "rairan": {"filter": "100", "bounds": "yes"},
}
SCALE, OFFSET = -25.0, 3.5
EVERY_FRAME = 7  # ticks between two frames
_BENCH = """
module bench;
  reg clk = 0;
  reg @PINS@;
  @WIRES@
  spindle_rio dut (.clk(clk), @CONNECTIONS@);
  integer in, out, more, at, clock;
  initial begin
    in = $fopen("pins.txt", "r");
    out = $fopen("rows.txt", "w");
    more = $fscanf(in, "%d", at);
    for (clock = 0; clock < @N_CLOCKS@; clock = clock + 1) begin
      if (more == 1 && at == clock) begin
        more = $fscanf(in, "@FORMAT@", @READ@);
        more = $fscanf(in, "%d", at);
      end
      #1 clk = 0;
      #1 if (dut.core.tick) $fdisplay(out, "%0d@FORMAT_OUT@", clock, @SENT@);
      #1 clk = 1;
      #1;
    end
    $fclose(out);
    $finish;
  end
endmodule
"""


# Cores with all that the plugin shows, on shafts with errors: external ticks that fail, and counts beyond the greatest.
SEEDS = (104, 68)


@cache
def case(seed: int) -> tuple[TachometerSpec, PinTrace]:
    spec, _, trace = random_case(seed, "s")
    # The position wraps often.
    spec = replace(spec, index_reset=False, position_width=8)
    assert spec.index
    assert spec.age
    assert spec.filter_clocks
    return spec, trace


@cache
def exported(seed: int) -> dict[str, str]:
    return export(case(seed)[0], NAME, target="rio")


def run(seed: int, folder: Path, file: str, right: str, wrong: str) -> tuple[list[int], list[dict[str, float]]]:
    """Clocks of the frames, and what HAL then shows; with `right` replaced by `wrong` in a file."""
    spec, trace = case(seed)
    texts = dict(exported(seed))
    assert not right or texts[file].count(right) == 1, f"{right!r} stands {texts[file].count(right)} times in {file}"
    texts[file] = texts[file].replace(right, wrong) if right else texts[file]
    plugin = loaded(texts[PLUGIN], spec.timing.clock_hz)
    sent, pins = plugin.interface_data(), [pin.name for pin in spec.pins]
    # HAL takes what RIO sends as signed.
    wires = [f"wire {'signed ' * (one['size'] > 1)}[{one['size'] - 1}:0] {name};" for name, one in sent.items()]
    parts = {
        "PINS": ", ".join(f"{pin} = 0" for pin in pins),
        "WIRES": "\n  ".join(wires),
        "CONNECTIONS": ", ".join(f".{name}({name})" for name in (*pins, *sent)),
        "N_CLOCKS": trace.n_clocks,
        "FORMAT": " ".join(["%b"] * len(pins)),
        "READ": ", ".join(pins),
        "FORMAT_OUT": " %0d" * len(sent),
        "SENT": ", ".join(sent),
    }
    bench = re.sub("@([A-Z_]+)@", lambda mark: str(parts[mark[1]]), _BENCH)
    rows = np.stack([trace.clock, *(trace.lines[pin] for pin in pins)], axis=1)
    np.savetxt(folder / "pins.txt", rows.astype(np.int64), fmt="%d")
    for name, text in {"wrapper.v": texts[WRAPPER], "core.v": texts[CORE], "bench.v": bench}.items():
        (folder / name).write_text(text, encoding="utf-8")
    command = ["iverilog", "-g2001", "-s", "bench", "-o", "x.vvp", "core.v", "wrapper.v", "bench.v"]
    subprocess.run(command, cwd=folder, check=True)
    subprocess.run(["vvp", "-n", "x.vvp"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    frames = np.loadtxt(folder / "rows.txt", dtype=np.int64, ndmin=2)[::EVERY_FRAME]
    (folder / "hal.c").write_text(component(plugin), encoding="utf-8")
    strict = ("-x", "c", "-std=c11", "-Wall", "-Werror")
    build.run([*build.compiler(), *strict, "hal.c", "-o", "hal", "-lm"], "compiler", folder)
    lines = [f"{SCALE} {OFFSET}"]
    lines += [" ".join(map(str, (int(armed(number)), *row[1:]))) for number, row in enumerate(frames)]
    said = build.run([folder / "hal"], "program", folder, "\n".join(lines))
    shown = [dict(zip(plugin.signals(), map(float, line.split()), strict=True)) for line in said.splitlines()]
    return [int(clock) for clock in frames[:, 0]], shown


def armed(frame: int) -> bool:
    """Whether index-enable is set before this frame."""
    return frame % 60 == 20


def check(seed: int, folder: Path, file: str = PLUGIN, right: str = "", wrong: str = "") -> None:
    """Hold every pin in every frame against the golden model."""
    spec, trace = case(seed)
    clocks, shown = run(seed, folder, file, right, wrong)
    tables = golden.tables(spec, trace)
    ticks, updates, index = tables[TICK], tables[UPDATE], tables[INDEX]
    overflows = ticks.clock[ticks.overflow.astype(bool)]
    counted = {"decode-errors": tables["decode_error"].clock, "overflows": overflows}
    counted |= {"tick-errors": tables["tick_error"].clock} if spec.max_tick_cycles else {}
    period, before = 1 << spec.position_width, -1
    through = dict(zip(ticks.clock.tolist(), np.unwrap(ticks.position, period=period).tolist(), strict=True))
    per_lsb = spec.rad_per_s_per_lsb
    origin, enabled, resets = 0, False, 0
    assert len(clocks) == len(ticks.clock[::EVERY_FRAME]) == len(shown)
    for frame, (clock, found) in enumerate(zip(clocks, shown, strict=True)):
        at = int(np.searchsorted(ticks.clock, clock))
        assert ticks.clock[at] == clock
        enabled |= armed(frame)
        # A counter of the FPGA shows an event in the clock after it.
        new = index.rows((index.clock >= before) & (index.clock < clock))
        if enabled and len(new):
            latest = index.rows(index.clock <= clock)
            since = (through[clock] - int(latest.index_position[-1]) + period // 2) % period - period // 2
            origin, enabled, resets = through[clock] - since, False, resets + 1
        before = clock
        count = through[clock] - origin
        row = int(np.searchsorted(updates.clock, clock, side="right")) - 1
        velocity = per_lsb * int(updates.velocity[row]) if row >= 0 else 0
        per_s = velocity / (2 * np.pi) * spec.encoder.counts_per_rev
        expected = {
            "velocity": pytest.approx(per_s / SCALE, rel=1e-6),
            "velocity-rpm": pytest.approx(velocity * 30 / np.pi, rel=1e-6),
            "position": (count + OFFSET) / SCALE,
            "count": count,
            "index-enable": enabled,
            "stalled": ticks.stalled[at],
            "age": ticks.age[at],
            "swallowed-edges": ticks.swallowed_edges[at],
            **{name: np.count_nonzero(events < clock) for name, events in counted.items()},
        }
        if spec.output:
            expected["velocity-overflow"] = updates.velocity_overflow[row] if row >= 0 else 0
        assert found == expected, (frame, clock)
    assert resets >= 1
    assert max(through.values()) - min(through.values()) > period
    assert enabled or resets > 1


@pytest.mark.parametrize("seed", SEEDS)
def test_pins_of_hal_say_what_the_golden_model_says(seed: int, tmp_path: Path) -> None:
    check(seed, tmp_path)
