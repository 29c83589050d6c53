"""Random cores are right in every bit, or refused in a line: as exported Verilog, against the golden model."""

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.nightly import nightly
from support.verilog import run_in_icarus

from tachometry.cli.reports.axes import axes_rows
from tachometry.cli.reports.core import core_rows
from tachometry.hdl.export import export
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import compare
from tachometry.spec import AUTO, METHODS, AxesSpec, CoreSpec, ParameterError, common_options, of_options, own_options
from tachometry.spec.core.sensors import SENSORS
from tachometry.spec.core.timing import MAX_TICK_CYCLES, MAX_TICKS
from tachometry.spec.formats.velocity_output import UNITS
from tachometry.spec.registers.buses import BUSES

CLOCKS_HZ, MOST_COUNTS = (100_000, 400_000_000), 1 << 24
EDGES, TICKS, LEAST_CLOCKS, MOST_CLOCKS = 20, 30, 6000, 24_000  # of a motion
_LAST = {"blanking", "electrical", "ratio", "teeth", "disc-table"}  # drawn by `_add_last`
_NUMBERS = "ppr clock tick max-time unit sensor decoding frac-bits velocity-width max-speed over-speed filter lowpass"
_QUADRATURE = {"health", "index-at"}  # which few other sensors have


class _Draw(random.Random):
    """Random numbers that are often at an end of their range."""

    def log(self, least: int, most: int) -> int:
        """Return a whole number whose logarithm is uniform."""
        if self.random() < 0.15:
            return self.choice((least, most))
        return round(2 ** self.uniform(np.log2(least), np.log2(most)))

    def speed(self) -> str:
        return f"{self.log(1, 1 << 40) / (1 << 20):.6g}{self.choice(('rad/s', 'rev/s', 'rpm'))}"

    def often(self, share: float) -> bool:
        return self.random() < share


def random_options(seed: int) -> tuple[dict[str, str], str]:
    """Return options of a core by their names, and a bus for its registers or `none`."""
    draw = _Draw(seed)
    method = draw.choice([*METHODS, "track", AUTO])
    sensor = draw.choice([*SENSORS] + ["quadrature"] * 4)
    decoding = draw.choice(SENSORS[sensor].decodings)
    clock = draw.log(*CLOCKS_HZ)
    if round_clock := draw.often(0.5):
        clock = round(clock, 1 - len(str(clock)))
    tick = draw.log(200, 8000) if method == "track" else draw.log(1, 4000)
    tick = draw.log(1, MAX_TICK_CYCLES) if draw.often(0.05) else tick
    ticks = draw.log(2, 300) if draw.often(0.9) else draw.log(2, MAX_TICKS)
    ticks = max(2, min(ticks, (1 << 28) // tick))  # a motion has a rest that is longer
    texts = {
        "method": method,
        "ppr": str(draw.log(1, MOST_COUNTS // decoding)),
        "decoding": str(decoding),
        "clock": f"{clock}Hz",
        "unit": draw.choice(UNITS),
    }
    if sensor != "quadrature":
        texts["sensor"] = sensor
    if draw.often(0.9) or not round_clock:
        texts["tick"] = f"{tick}clk"
        texts |= {"max-time": f"{tick * ticks}clk"} if draw.often(0.9) else {}
    some = {
        "frac-bits": (0.15, str(draw.randint(4, 24))),
        "velocity-width": (0.15, str(draw.randint(8, 64))),
        "max-speed": (0.4, draw.speed()),
        "over-speed": (0.05, draw.speed()),
        "filter": (0.2, str(draw.log(1, 3000))),
        "lowpass": (0.1, f"{draw.log(1, 1 << 20) * clock / tick / (1 << 20):.6g}Hz"),
    }
    texts |= {name: text for name, (share, text) in some.items() if draw.often(share)}
    _add_others(texts, draw, method, sensor)
    if method in ("s", "track", AUTO) and draw.often(0.06):
        axes = draw.choice((1, 2, 3, 5, 8, 32, 64))
        kept = {"method", "ppr", "clock", "unit", "max-speed", "filter", "index", "external-tick"}
        texts = {name: text for name, text in texts.items() if name in kept} | {"axes": str(axes)}
        texts |= _ratio(_Draw(MANY + seed))
    else:
        _add_last(texts, _Draw(MANY + seed))
    return texts, draw.choice([*BUSES]) if draw.often(0.1) else "none"


def _add_others(texts: dict[str, str], draw: _Draw, method: str, sensor: str) -> None:
    """Add some of the other options of a method, with values that it declares for tests or any within its limits."""
    own = () if method == AUTO else own_options(method)
    for about in {about.name: about for about in (*common_options(), *own)}.values():
        values = [value for value in about.tested if value]
        rare = sensor != "quadrature" and {about.name, about.needs} & _QUADRATURE
        if {about.name, about.needs} & {*_NUMBERS.split(), *_LAST} or not values or draw.often(0.99 if rare else 0.88):
            continue
        if method == "track" and "bounds" in (about.name, about.needs):
            continue
        if about.needs and draw.often(0.95):
            texts[about.needs] = "yes"
        within = about.limits is not None and draw.often(0.5)
        texts[about.name] = str(draw.randint(*about.limits)) if about.limits and within else draw.choice(values)


def _add_last(texts: dict[str, str], draw: _Draw) -> None:
    """Add options with random numbers of their own, so that the others of a seed stay."""
    if draw.often(0.05):
        texts |= {"electrical": str(draw.log(1, 512)), "lead": f"{draw.randint(0, 3)}tick"}
        texts |= {draw.choice(["sincos", "sincos-table"]): "yes"} if draw.often(0.5) else {}
        texts |= {"electrical": texts["ppr"]} if texts.get("sensor") == "hall" else {}
    if draw.often(0.1):
        texts["blanking"] = str(draw.log(2, 3000))
    if texts.get("sensor") == "pulses" and texts["decoding"] == "1" and draw.often(0.2):
        texts["teeth"] = draw.choice(["60-2", "36-2-2-2", "15-2,3-2,18-2", "12-1-1-2", "24+1"])
        texts["ppr"] = str(sum(int(part.partition("-")[0]) for part in texts["teeth"].replace("+", "-").split(",")))
    texts |= _ratio(draw)
    if draw.often(0.1) and texts["method"] in ("t", "mt", "s", "track"):
        texts["disc-table"] = "edges"


def _ratio(draw: _Draw) -> dict[str, str]:
    return {"ratio": f"{draw.log(1, 100)}/{draw.log(1, 100)}"} if draw.often(0.1) else {}


def motions(spec: CoreSpec, seed: int) -> list[Trace]:
    """Return motions that are played within seconds: one at usual speeds, and the same eight times as fast."""
    whole = stress_of(spec, seed, EDGES)
    clocks = min(max(LEAST_CLOCKS, TICKS * spec.timing.tick_cycles), MOST_CLOCKS)
    if not isinstance(whole, PinTrace):
        return [whole.until(min(whole.n_clocks, LEAST_CLOCKS))]
    trace = whole.until(min(whole.n_clocks, clocks))
    clock, last = np.unique(whole.clock[::-1] // 8, return_index=True)
    lines = {name: levels[::-1][last] for name, levels in whole.lines.items()}
    hurried = PinTrace.of_lines(clock, whole.n_clocks, lines)
    return [trace, hurried.until(min(whole.n_clocks, clocks // 4))]


# Cores that are played in seconds: every method and sensor, number 205, a constant of which was too wide, axes that are
# geared (265), a geared wheel with an extra tooth (1764), and a map whose place no program moves (1591).
SEEDS = (3, 8, 12, 13, 20, 26, 28, 31, 42, 59, 61, 67, 97, 205, 265, 1764, 1591)
MANY, PARTS = 2000, 8


def made(texts: dict[str, str]) -> CoreSpec | None:
    """Return the core of these options, which those that it names make again; None if it is refused, in a line."""
    try:
        spec = of_options(texts)
    except ParameterError as error:
        check_message(error)
        return None
    assert isinstance(spec, CoreSpec)
    assert of_options(spec.options) == spec
    assert axes_rows(spec) if isinstance(spec, AxesSpec) else core_rows(spec, None)
    return spec


def check_message(error: ParameterError) -> None:
    assert len(str(error).splitlines()) == 1
    assert len(str(error)) < 400


def check(seed: int, folder: Path) -> bool:
    """Play the core of a seed, if it is not refused; whether it was played."""
    texts, bus = random_options(seed)
    shown = f"seed {seed}: {' '.join(f'--{name} {text}' for name, text in texts.items())}"
    try:
        spec = made(texts)
        if spec is None:
            return False
        if bus != "none":
            export_with_registers(spec, bus)
        for trace in motions(spec, seed):
            expected = golden.run(spec, trace)
            if any(len(table) for table in expected.tables.values()):  # a tick may be longer than the motion
                count, first = compare(expected, run_in_icarus(spec, folder, trace))
                assert count == 0, first
    except Exception as error:
        error.add_note(shown)
        raise
    return True


def export_with_registers(spec: CoreSpec, bus: str) -> None:
    """Export the core with registers on a bus, which may reach too few of them or be too slow."""
    try:
        export(replace(spec, parallel=True) if isinstance(spec, AxesSpec) else spec, bus=bus)
    except ParameterError as error:
        check_message(error)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_core(seed: int, tmp_path: Path) -> None:
    assert check(seed, tmp_path)


@nightly
@pytest.mark.parametrize("part", range(PARTS))
def test_many_random_cores(part: int, tmp_path: Path) -> None:
    played = [check(seed, tmp_path) for seed in range(part, MANY, PARTS)]
    assert 0.5 < sum(played) / len(played) < 0.95
