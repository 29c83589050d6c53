"""The plugin for RIO, from the pins of the FPGA to those of HAL, against the golden model."""

import json
import re
import shlex
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support import docs
from support.axes import small
from support.command import run as command_line
from support.compiled import lint
from support.nightly import only
from support.options import had_by
from support.random_case import random_case
from support.rio import component, hal_type, loaded
from support.verilog import PLAY, filled

from tachometry.hdl.export import export
from tachometry.hdl.export.targets.rio import hal_pins
from tachometry.hdl.export.targets.target import TARGETS
from tachometry.sim import build, golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.signals.axes import AxesTrace, Trace, of_axis
from tachometry.sim.signals.run import Table
from tachometry.spec import METHODS, AxesSpec, CoreSpec, ParameterError, TachometerSpec, of_texts
from tachometry.spec.core.index import Index
from tachometry.spec.language.port import INDEX, TICK, UPDATE

PAGE = docs.page("guides/linuxcnc.md")
NAME = "spindle"
PLUGIN, WRAPPER, CORE = (f"spindle_rio/{file}" for file in ("plugin.py", "spindle_rio.v", "spindle.v"))
BASE = {"ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us"}
EVERY = {
    "s": {"external-tick": "yes", "index": "yes", "filter": "4", "unit": "rpm", "bounds": "yes", "age": "yes"},
    "m": {"decoding": "1", "lowpass": "20Hz", "velocity-width": "12"},
    "t": {"decoding": "2", "index": "yes", "position-width": "8"},
    "mt": {"external-tick": "yes", "bounds": "yes"},
    "rairan": {"filter": "100", "bounds": "yes"},
    "track": {"external-tick": "yes", "index": "yes", "unit": "rpm", "velocity-width": "24"},
}
SCALE, OFFSET = -25.0, 3.5
EVERY_FRAME = 7  # ticks between two frames
START = 50  # the frame with which the host begins
_BENCH = """
module bench;
  reg clk = 0;
  reg @LEVELS@;
  @WIRES@
  spindle_rio dut (.clk(clk), @CONNECTIONS@);
  integer in, out, more, at, clock;
  initial begin
    in = $fopen("pins.txt", "r");
    out = $fopen("rows.txt", "w");
    more = $fscanf(in, "%d", at);
"""


# Cores with all that the plugin shows, on shafts with errors: external ticks that fail, and counts beyond the greatest.
SEEDS = (141, 170)
OF_AXES = 0  # the seed of three axes


@cache
def case(seed: int) -> tuple[CoreSpec, Trace]:
    if seed == OF_AXES:
        axes = small(parallel=True, index=Index(at="edge"), position_width=8, filter_clocks=1)
        return axes, AxesTrace.of([stress(axes.tachometer, seed=one, n_edges=40) for one in (11, 20, 22)])
    spec, _, trace = random_case(seed, "s")
    # The position wraps often.
    spec = replace(spec, index=Index(), position_width=8, age=True)
    assert spec.index
    assert spec.filter_clocks
    return spec, trace


@cache
def exported(seed: int) -> dict[str, str]:
    return export(case(seed)[0], NAME, target="rio")


def run(seed: int, folder: Path) -> tuple[list[int], list[dict[str, float]]]:
    """Return the clocks of the frames, and what HAL then shows."""
    spec, trace = case(seed)
    texts = exported(seed)
    plugin = loaded(texts[PLUGIN], spec.timing.clock_hz)
    sent, pins = plugin.interface_data(), [*plugin.PINDEFAULTS]
    # HAL takes what RIO sends as signed.
    wires = [f"wire {'signed ' * (one['size'] > 1)}[{one['size'] - 1}:0] {name};" for name, one in sent.items()]
    parts: dict[str, str | int] = {
        "LEVELS": ", ".join(f"{pin} = 0" for pin in pins),
        "WIRES": "\n  ".join(wires),
        "CONNECTIONS": ", ".join(f".{name}({name})" for name in (*pins, *sent)),
        "N_CLOCKS": trace.n_clocks,
        "FORMAT": " ".join(["%b"] * len(pins)),
        "PINS": ", ".join(pins),
        "STROBES": "dut.core.tick",
        "FORMAT_OUT": " %0d" * len(sent),
        "OUTPUTS": ", ".join(sent),
    }
    bench = filled(_BENCH + PLAY, **parts)
    lines: dict[str, NDArray[Any]] = dict(trace.lines)
    if isinstance(trace, AxesTrace):
        lines = {f"{name}_{axis}": trace.lines[name] >> np.uint64(axis) & np.uint64(1) for axis, name in trace.names}
    rows = np.stack([trace.clock, *(lines[pin] for pin in pins)], axis=1)
    np.savetxt(folder / "pins.txt", rows.astype(np.int64), fmt="%d")
    for name, text in {"wrapper.v": texts[WRAPPER], "core.v": texts[CORE], "bench.v": bench}.items():
        (folder / name).write_text(text, encoding="utf-8")
    command = ["iverilog", "-g2001", "-s", "bench", "-o", "x.vvp", "core.v", "wrapper.v", "bench.v"]
    subprocess.run(command, cwd=folder, check=True)
    subprocess.run(["vvp", "-n", "x.vvp"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    frames = np.loadtxt(folder / "rows.txt", dtype=np.int64, ndmin=2)[::EVERY_FRAME][START:]
    (folder / "hal.c").write_text(component(plugin), encoding="utf-8")
    strict = ("-x", "c", "-std=c11", "-Wall", "-Werror")
    build.run([*build.compiler(), *strict, "hal.c", "-o", "hal", "-lm"], "compiler", folder)
    given = [f"{SCALE} {OFFSET}"]
    given += [" ".join(map(str, (int(armed(number)), *row[1:]))) for number, row in enumerate(frames)]
    said = build.run([folder / "hal"], "program", folder, "\n".join(given))
    shown = [dict(zip(plugin.signals(), map(float, line.split()), strict=True)) for line in said.splitlines()]
    return [int(clock) for clock in frames[:, 0]], shown


def armed(frame: int) -> bool:
    """Return whether index-enable is set before this frame."""
    return frame % 10 in (0, 3)


def check(seed: int, folder: Path) -> None:
    """Hold every pin in every frame against the golden model."""
    spec, trace = case(seed)
    clocks, shown = run(seed, folder)
    wanted = golden.run(spec, trace)
    assert len(clocks) == len(wanted.tables[TICK].clock[::EVERY_FRAME][START:]) == len(shown)
    if not isinstance(spec, AxesSpec):
        check_axis(spec.tachometer, wanted.tables, clocks, shown)
        return
    assert {name for name in shown[0] if name[-2:] not in ("-0", "-1", "-2")} == set()
    for axis in range(spec.axes):
        own = [{name[:-2]: value for name, value in row.items() if name.endswith(f"-{axis}")} for row in shown]
        check_axis(spec.axis, of_axis(spec, wanted, axis).tables, clocks, own)


def check_axis(
    spec: TachometerSpec, tables: Mapping[str, Table], clocks: list[int], shown: list[dict[str, float]]
) -> None:
    ticks, updates, index = tables[TICK], tables[UPDATE], tables[INDEX]
    overflows = ticks.clock[ticks.overflow.astype(bool)]
    counted = {"decode-errors": tables["decode_error"].clock, "overflows": overflows}
    counted |= {"tick-errors": tables["tick_error"].clock} if spec.external_tick else {}
    period, before = 1 << spec.position_width, clocks[0]
    through = np.unwrap(ticks.position, period=period).tolist()
    per_lsb = spec.velocity.rad_per_s_per_lsb
    first = int(np.searchsorted(ticks.clock, clocks[0], side="right")) - 1
    origin, enabled, resets = through[first] - int(ticks.position[first]), False, 0
    assert any(index.clock < clocks[0])
    for frame, (clock, found) in enumerate(zip(clocks, shown, strict=True)):
        at = int(np.searchsorted(ticks.clock, clock, side="right")) - 1
        enabled |= armed(frame)
        # A counter of the FPGA shows an event in the clock after it.
        new = index.rows((index.clock >= before) & (index.clock < clock))
        if enabled and len(new):
            latest = index.rows(index.clock <= clock)
            since = (through[at] - int(latest.index_position[-1]) + period // 2) % period - period // 2
            origin, enabled, resets = through[at] - since, False, resets + 1
        before = clock
        count = through[at] - origin
        row = int(np.searchsorted(updates.clock, clock, side="right")) - 1
        velocity = per_lsb * int(updates.velocity[row]) if row >= 0 else 0
        per_s = velocity / (2 * np.pi) * spec.encoder.counts_per_rev
        expected: dict[str, Any] = {
            "velocity": pytest.approx(per_s / SCALE, rel=1e-6),
            "velocity-rpm": pytest.approx(velocity * 30 / np.pi, rel=1e-6),
            "position": (count + OFFSET) / SCALE,
            "count": count,
            "index-enable": enabled,
            **{name: ticks.get(name.replace("-", "_"))[at] for name in ("age", "filtered-edges") if name in found},
            **{name: np.count_nonzero(events < clock) for name, events in counted.items()},
        }
        if spec.velocity.output:
            expected["velocity-overflow"] = updates.velocity_overflow[row] if row >= 0 else 0
        for port in spec.ports.outputs:  # those of the watch and of comparing
            name, table = port.name.replace("_", "-"), tables.get(port.held_by)
            if name in found.keys() - expected.keys() and table is not None:
                expected[name] = table.get(port.name)[np.searchsorted(table.clock, clock, side="right") - 1]
        assert found == expected, (frame, clock)
    assert resets >= 1
    assert np.abs(np.diff(ticks.position)).max() > period // 2  # it wraps
    assert enabled or resets > 1


@pytest.mark.parametrize("seed", [OF_AXES, *SEEDS])
def test_pins_of_hal_say_what_the_golden_model_says(seed: int, tmp_path: Path) -> None:
    check(seed, tmp_path)


def core(method: str) -> TachometerSpec:
    return of_texts(method, had_by(method, BASE | EVERY.get(method, {})))


@cache
def made(method: str) -> dict[str, str]:
    return export(core(method), NAME, target="rio")


@pytest.mark.parametrize("method", only(["s", "rairan"], METHODS))  # the fewest outputs and the most
def test_the_plugin_fits_its_verilog_and_the_core(method: str, tmp_path: Path) -> None:
    files, spec = made(method), core(method)
    for file in (WRAPPER, CORE):
        (tmp_path / Path(file).name).write_text(files[file], encoding="utf-8")
    lint(["spindle_rio.v", "spindle.v"], "spindle_rio", tmp_path)
    assert files[CORE] == files["spindle.v"]
    plugin = loaded(files[PLUGIN], spec.timing.clock_hz)
    found = re.findall(r"^  (input|output) \w+ (?:\[(\d+):0\] )?(\w+),?$", files[WRAPPER], re.MULTILINE)
    ports = {name: (direction, int(high or 0) + 1) for direction, high, name in found}
    sent = {name: ("output", one["size"]) for name, one in plugin.INTERFACE.items()}
    assert ports == {"clk": ("input", 1)} | {pin: ("input", 1) for pin in plugin.PINDEFAULTS} | sent
    assert list(plugin.PINDEFAULTS) == [pin.name for pin in spec.ports.pins]
    assert [plugin.NAME, *plugin.VERILOGS] == ["spindle_rio", "spindle_rio.v", "spindle.v"]
    assert {name: hal_type(pin) for name, pin in plugin.SIGNALS.items()} == {
        name: pin.kind for name, pin in hal_pins(spec).items()
    }
    # RIO compares the last words of names.
    for name in sent:
        assert not [other for other in sent if other.endswith(f"_{name}")]


def test_numbers_come_from_the_spec() -> None:
    """As RIO's test programs show them."""
    spec = core("m")
    plugin = loaded(made("m")[PLUGIN], 1_000_000)
    rpm = spec.velocity.rad_per_s_per_lsb * 30 / np.pi
    for value in (-5, 0, 1000):
        assert plugin.convert("velocity-rpm", {}, value) == pytest.approx(value * rpm)
        assert plugin.convert("velocity", {}, value) == pytest.approx(value * rpm / 60 * spec.encoder.counts_per_rev)
        assert plugin.convert("age", {}, value) == value


def test_a_board_with_another_clock_is_refused() -> None:
    assert loaded(made("m")[PLUGIN], 1_000_000).gateware_instances() == {"tacho0": {}}
    text = "^the clock of the FPGA must be 1000000 Hz for spindle_rio, not 27000000 Hz$"
    with pytest.raises(ValueError, match=text):
        loaded(made("m")[PLUGIN], 27_000_000).gateware_instances()


@pytest.mark.parametrize(
    ("options", "bus", "message"),
    [
        (
            {"position-width": "40"},
            None,
            "position_width must be at most 32 for RIO, whose numbers have no more, not 40",
        ),
        (
            {"velocity-width": "33"},
            None,
            "velocity_width must be at most 32 for RIO, whose numbers have no more, not 33",
        ),
        (
            {"index": "yes", "index-reset": "yes"},
            None,
            "index_reset must not be given for RIO: its pin index-enable resets the position",
        ),
        ({}, "spi", "bus must be none for rio, not spi"),
    ],
)
def test_cores_that_do_not_fit_are_refused(options: dict[str, str], bus: str | None, message: str) -> None:
    with pytest.raises(ParameterError, match=f"^{re.escape(message)}$"):
        export(of_texts("s", {"ppr": "500"} | options), NAME, bus, target="rio")


def test_axes_must_have_pins_for_each() -> None:
    with pytest.raises(ParameterError, match="parallel must be given together with --axes for RIO"):
        export(small(4), NAME, target="rio")


def test_the_page_has_every_pin_and_its_command_makes_the_plugin(tmp_path: Path) -> None:
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (\w+)", PAGE, re.MULTILINE))
    found = {name: pin.kind for method in METHODS for name, pin in hal_pins(core(method)).items()}
    found |= {"age": "u32", "tick-errors": "u32", "filtered-edges": "u32"}
    assert rows == found | {"position-scale": "float", "position-offset": "float"}
    (command,) = re.findall(r"```sh\n(tachometry .*?)```", PAGE, re.DOTALL)
    assert command_line(*shlex.split(command.replace("\\\n", ""))[1:-1], tmp_path) == 0
    (configuration,) = re.findall(r"```json\n(.*?)```", PAGE, re.DOTALL)
    described = json.loads(configuration)
    plugin = loaded((tmp_path / described["type"] / "plugin.py").read_text(encoding="utf-8"), 27_000_000)
    assert described["type"] == plugin.NAME
    assert described["pins"].keys() == plugin.PINDEFAULTS.keys()
    assert described["signals"].keys() <= plugin.SIGNALS.keys()


def test_other_targets_are_refused() -> None:
    with pytest.raises(ParameterError, match=rf"^target must be one of none, {', '.join(TARGETS)}, not 'mesa'$"):
        export(of_texts("s", {"ppr": "500"}), NAME, target="mesa")
