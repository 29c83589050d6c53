"""Engines against the golden model and against each other."""

import os
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from amaranth.back import rtlil
from support.nightly import only

from tachometry.hdl import Tachometer
from tachometry.sim import build, golden
from tachometry.sim.engines.compiled import CompiledEngine, Design, effort_of
from tachometry.sim.engines.cxxrtl import Cxxrtl, translate
from tachometry.sim.engines.engine import Engine, Interrupted, Watch
from tachometry.sim.engines.pick import ENGINES, NAMES, pick, present
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import compare
from tachometry.spec import METHODS, Encoder, MTachometer, STachometer, Timing
from tachometry.spec.core.index import Index

COMPILED = [name for name in ENGINES if name != "pysim"]
SPEC = STachometer(encoder=Encoder(100), timing=Timing(20_000, 20, 10))


def turning(n_clocks: int, spacing: int = 7) -> PinTrace:
    """Return edges in order, `spacing` clocks apart, and once an illegal one."""
    clock = np.arange(0, n_clocks, spacing)
    phase = np.arange(len(clock)) + 2 * (clock > n_clocks // 2) - 3 * (clock > n_clocks * 3 // 4)
    a, b = (np.isin(phase % 4, levels).astype(np.uint8) for levels in ((1, 2), (2, 3)))
    return PinTrace(clock, a, b, n_clocks)


@pytest.mark.parametrize("name", only(["cxxrtl"], COMPILED))
def test_rows_beyond_one_buffer_and_sums_in_memory(name: str) -> None:
    spec = MTachometer(encoder=Encoder(100), timing=Timing(20_000, 1, 10), average=16)
    trace = turning(100_000, spacing=3)
    run = pick(name).run(spec, trace)
    assert len(run.ticks.clock) > 99_000
    assert compare(golden.run(spec, trace), run) == (0, [])


# Both engines have one writer of waveforms.
@pytest.mark.parametrize("name", only(["cxxrtl"], COMPILED))
@pytest.mark.parametrize("window", [None, (1234, 1999), (3000, 3001)])
def test_the_waveform_is_that_of_pysim(name: str, window: tuple[int, int] | None, tmp_path: Path) -> None:
    trace, texts = turning(4000), {}
    for engine in (PySim(), pick(name)):
        folder = tmp_path / engine.name
        folder.mkdir()
        run = engine.run(SPEC, trace, Watch(folder / "v.vcd", window))
        assert compare(golden.run(SPEC, trace), run) == (0, [])
        texts[engine.name] = [(folder / file).read_bytes() for file in ("v.vcd", "v.gtkw")]
    assert texts[name] == texts["pysim"]
    begin, end = window or (0, 4000)
    times = [int(line[1:]) for line in texts[name][0].decode().splitlines() if line.startswith("#")]
    assert {time // 50_000_000 for time in times} <= {0, *range(begin, end + 1)}
    assert times[-1] == end * 50_000_000


# Both have one driver; CXXRTL is the faster.
@pytest.mark.parametrize("name", only(["cxxrtl"], COMPILED))
def test_memory_and_python_calls_do_not_grow_with_clocks(name: str) -> None:
    spec = replace(SPEC, timing=Timing(20_000, 1_000_000, 10))
    low = np.zeros(1, dtype=np.uint8)
    trace = PinTrace(np.zeros(1, dtype=np.int64), low, low, 20_000_000)
    engine, seen = pick(name), list[int]()
    engine.run(spec, replace(trace, n_clocks=1))
    tracemalloc.start()
    run = engine.run(spec, trace, Watch(progress=seen.append))
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()
    assert len(run.ticks.clock) == 19
    assert sorted(seen) == seen
    assert 2 <= len(seen) < 1000
    assert seen[-1] == 20_000_000


@pytest.mark.parametrize("name", only(["pysim", "cxxrtl"], ENGINES))  # compiled engines share their driver
def test_an_interrupt_brings_what_was_simulated(name: str, tmp_path: Path) -> None:
    def ctrl_c(done: int) -> None:
        if done > 3000:
            raise KeyboardInterrupt

    trace = turning(2_000_000)
    with pytest.raises(Interrupted) as stop:
        pick(name).run(SPEC, trace, Watch(tmp_path / "v.vcd", (100, 200), ctrl_c))
    run = stop.value.run
    assert 3000 < run.n_clocks < 2_000_000
    assert compare(golden.run(SPEC, trace.until(run.n_clocks)), run) == (0, [])
    assert (tmp_path / "v.gtkw").exists()


@pytest.mark.parametrize("name", ENGINES)
def test_a_line_that_is_missing_is_told(name: str) -> None:
    with pytest.raises(ValueError, match="the trace must have the lines of the core, and lacks z"):
        pick(name).run(replace(SPEC, index=Index()), turning(100))


def test_auto_with_and_without_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    assert pick().name == "cxxrtl"
    monkeypatch.setattr(build, "find_compiler", lambda: None)
    monkeypatch.setattr("tachometry.sim.engines.pick.find_compiler", lambda: None)
    assert pick().name == "pysim"
    assert present() == ["pysim"]
    with pytest.raises(OSError, match=r"^there is no C\+\+ compiler: install g\+\+ or clang, or pip install"):
        pick("cxxrtl")
    with pytest.raises(ValueError, match=r"^engine must be one of auto, pysim, .*, not 'fast'$"):
        pick("fast")


def test_the_compiler_is_that_of_cxx_or_the_systems_or_ziglangs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tool = tmp_path / "clang++"
    tool.write_text("#!/bin/sh\n")
    tool.chmod(0o755)
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert build.find_compiler() == ("clang++",)
    monkeypatch.setenv("CXX", f"{tool} -v")
    assert build.find_compiler() == (str(tool), "-v")
    monkeypatch.delenv("CXX")
    monkeypatch.setenv("PATH", os.devnull)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert build.find_compiler() is None
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object())
    found = build.find_compiler()
    assert found is not None
    assert found[1:] == ("-m", "ziglang", "c++")


def test_runs_of_other_lengths_have_libraries_of_their_own() -> None:
    """In any order: the compiler takes its time for a long one alone."""
    designs = [Design(SPEC, list(SPEC.ports.pins), effort=effort) for effort in range(3)]
    engine = Cxxrtl()
    assert len({engine.kept(design) for design in (*designs, *designs)}) == 3
    # What tracking computes takes longest to compile.
    for method, efforts in (("s", [1, 1, 2]), ("track", [0, 1, 2])):
        assert [effort_of(method, clocks) for clocks in (10**5, 10**6, 10**8)] == efforts


def test_every_engine_is_one() -> None:
    assert {*present()} == {*NAMES} - {"cxxrtl-every-clock"}
    for name in NAMES:
        engine: Engine = pick(name)
        assert engine.name == name
        assert isinstance(engine, PySim | CompiledEngine)


# It has memory that can be written; a core that does not settle would differ from the golden model.
@pytest.mark.parametrize("method", only(["track"], METHODS))
def test_every_method_has_a_core_that_settles_at_once(method: str) -> None:
    """Else CXXRTL would have to evaluate it more than once a clock; long words and writable memory included."""
    facts = METHODS[method].facts
    spec = METHODS[method](encoder=Encoder(100), timing=Timing(100_000, 1000, 10), bounds=facts.bounds, age=True)
    text = translate(rtlil.convert(Tachometer(spec), name="top", emit_src=False))
    assert "bool converged = true;" in text
    assert "debug" not in text.split("bool p_top::eval")[1]
