import json
import re
from pathlib import Path
from typing import Any

import pytest
from support import docs
from support.compiled import lint
from support.script import load

from tachometry.hdl.export import export
from tachometry.sim.studies import size as synthesis
from tachometry.sim.studies.plan import CELLS
from tachometry.spec import METHODS, Encoder, STachometer, Timing
from tachometry.spec.control import LoopSpec

size = load("size")
SPEC = STachometer(encoder=Encoder(500), timing=Timing(48_000_000, 960, 500))


def step(kind: str, delay: float, source: str, sink: str) -> dict[str, Any]:
    """Return a step of a path as nextpnr reports it; `source` and `sink` are `cell/PORT`."""
    ends = [dict(zip(("cell", "port"), end.split("/"), strict=True)) for end in (source, sink)]
    return {"type": kind, "delay": delay, "from": ends[0], "to": ends[1]}


TABLE = "core.datapath.reciprocal.table.0.0/DOA14"
Q = "core.datapath.scaler.q_TRELLIS_FF_Q_14/M"
RAM_PATH = [step("clk-to-q", 5.6, TABLE, TABLE), step("routing", 1.9, TABLE, Q), step("setup", 0, Q, Q)]

STATE = "core.datapath.interval$34.m_s_SB_DFFESR_Q_5_D_SB_LUT4_O_LC"
TOTAL = "core.datapath.scaler.total_SB_DFFESR_Q_9_D_SB_LUT4_O_I3_SB_CARRY_CI$CARRY"
COUNT = "core.pulse_count_SB_DFFESR_Q_2_D_SB_LUT4_O_LC"
CARRY_PATH = [
    step("clk-to-q", 0.5, f"{STATE}/O", f"{STATE}/O"),
    step("routing", 1.0, f"{STATE}/O", f"{TOTAL}/I1"),
    step("logic", 0.25, f"{TOTAL}/I1", f"{TOTAL}/COUT"),
    step("routing", 0.0, f"{TOTAL}/COUT", f"{TOTAL}/CIN"),
    step("logic", 0.25, f"{TOTAL}/CIN", f"{TOTAL}/COUT"),
    step("routing", 0.5, f"{TOTAL}/COUT", f"{TOTAL}/I3"),
    step("logic", 0.3, f"{TOTAL}/I3", f"{TOTAL}/O"),
    step("routing", 0.6, f"{TOTAL}/O", f"{COUNT}/CEN"),
    step("setup", 0.1, f"{COUNT}/CEN", f"{COUNT}/CEN"),
]
PIN_PATH = [step("source", 0, "serial_in$tr_io/O", "serial_in$tr_io/O"), step("routing", 99, "serial_in$tr_io/O", Q)]

REPORT = {
    "critical_paths": [
        {"from": "posedge clk", "to": "posedge clk", "path": RAM_PATH},
        {"from": "<async>", "to": "posedge clk", "path": PIN_PATH},
    ],
    "fmax": {"clk": {"achieved": 133.25, "constraint": 12}},
    "utilization": {
        "DP16KD": {"available": 56, "used": 1},
        "MULT18X18D": {"available": 28, "used": 0},
        "TRELLIS_COMB": {"available": 24288, "used": 325},
        "TRELLIS_FF": {"available": 24288, "used": 215},
        "TRELLIS_IO": {"available": 197, "used": 75},
    },
}


def results(**changed: float) -> dict[tuple[str, str], Any]:
    """Return the results of the reference on all targets, at its bars but for what is changed on HX8K."""
    found = {
        "ECP5": {"COMB": 265, "FF": 260, "DP16KD": 0, "MULT": 0, "Fmax": 190.0, "latency": 4},
        "HX8K": {"LC": 340, "RAM": 0, "Fmax": 130.0, "latency": 4} | changed,
        "UP5K": {"LC": 340, "RAM": 0, "DSP": 0, "Fmax": 52.0, "latency": 4},
    }
    return {("reference", target): size.Measurement(figures, "a → b") for target, figures in found.items()}


def test_area_and_fmax_of_a_report() -> None:
    assert synthesis.area(REPORT, size.TARGETS["ECP5"].cells) == {"COMB": 325, "FF": 215, "DP16KD": 1, "MULT": 0}
    assert synthesis.achieved(REPORT) == 133.25


def test_a_cell_that_a_report_lacks_is_an_error() -> None:
    with pytest.raises(KeyError, match="ICESTORM_LC"):
        synthesis.area(REPORT, size.TARGETS["HX8K"].cells)


def test_critical_path_is_between_clocks() -> None:
    assert synthesis.critical_path(REPORT) == RAM_PATH


@pytest.mark.parametrize(
    ("path", "phrase"),
    [
        (RAM_PATH, "block RAM reciprocal.table → scaler.q: logic 5.6 ns, routing 1.9 ns"),
        (CARRY_PATH, "interval.m_s → enable of pulse_count over 2 carry + 1 LUT: logic 1.4 ns, routing 2.1 ns"),
    ],
)
def test_what_limits_fmax(path: list[dict[str, Any]], phrase: str) -> None:
    assert synthesis.limit(path) == phrase


def test_wrapper_connects_every_port_to_bits_of_its_own() -> None:
    text = synthesis.wrapper(SPEC.ports)
    found = re.findall(r"\.(\w+)\((\w+)(?:\[(\d+) \+: (\d+)\])?\)", text)
    assert [name for name, *_ in found] == [port.name for port in SPEC.ports]
    assert [int(width or 1) for *_, width in found] == [port.width for port in SPEC.ports]
    bits = [(bus, int(low or 0) + i) for _, bus, low, width in found for i in range(int(width or 1))]
    assert len(set(bits)) == len(bits)
    outputs = sum(port.width for port in SPEC.ports if port.direction == "output")
    # The last bit of `feed` loads the shift register.
    assert {bus: sum(bit[0] == bus for bit in bits) for bus in ("clk", "feed", "result")} == {
        "clk": 1,
        "feed": 3,
        "result": outputs,
    }
    assert "reg [3:0] feed;" in text
    assert f"wire [{outputs - 1}:0] result;" in text


def test_wrapper_elaborates(tmp_path: Path) -> None:
    (tmp_path / "core.v").write_text(export(SPEC, synthesis.CORE)[f"{synthesis.CORE}.v"])
    (tmp_path / "wrapper.v").write_text(synthesis.wrapper(SPEC.ports))
    lint(["wrapper.v", "core.v"], "wrapper", tmp_path)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TACHOMETRY_CACHE", str(tmp_path / "cache"))
    return tmp_path


SAME: dict[str, Any] = {"files": {"core.v": "module"}, "commands": [["yosys", "a"]], "results": ["area.json"]}
SAME |= {"tools": {"yosys": "0.70"}}


@pytest.mark.parametrize(
    "change",
    [
        {"files": {"core.v": "module "}},
        {"commands": [["yosys", "b"]]},
        {"results": ["core.v"]},
        {"tools": {"yosys": "0.71"}},
    ],
)
def test_commands_run_once_until_something_changes(change: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def call(folder: Path, command: list[str]) -> None:
        calls.append((folder / "core.v").read_text())
        for name in ("area.json", "core.v"):
            (folder / name).write_text(str(len(calls)))

    monkeypatch.setattr(synthesis, "call", call)
    given = [SAME, SAME, SAME | change, SAME]
    assert [synthesis.made(**each) for each in given] == [[1], [1], [2], [1]]
    assert calls[0] == "module"


def test_a_failure_is_not_cached() -> None:
    failing = [["python", "-c", "import sys; print('no such cell'); sys.exit(3)"]]
    for _ in range(2):
        with pytest.raises(RuntimeError, match=r"failed:\nno such cell"):
            synthesis.made({}, failing, [], {})


def test_a_placement_that_cannot_be_routed_is_the_slowest(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Its report is empty, and the next seeds are routed all the same."""
    command = ["python", "-c", "while True: pass", "--seed", "2", "--report", "route2.json"]
    monkeypatch.setattr(synthesis, "LONGEST_ROUTE", 0.1)
    synthesis.call(tmp_path, command)
    assert (tmp_path / "route2.json").read_text() == "{}"
    monkeypatch.setattr(synthesis, "made", lambda *_: [REPORT, REPORT, {}, REPORT])
    found = synthesis.measure_core(SPEC, size.TARGETS["ECP5"], "", {}, seeds=(1, 2, 3))
    assert (found.figures["Fmax"], found.spread) == (133.25, (0.0, 133.25))


def test_missing_tools_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(synthesis, "PACKAGES", ("amaranth", "yowasp-nothing"))
    with pytest.raises(RuntimeError, match=r"yowasp-nothing is not installed: pip install 'tachometry\[size\]'"):
        synthesis.versions()


def test_fmax_is_the_median_of_the_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    """And what limits it is of the seed that has the median; nine seeds, if no others are asked for."""
    asked = []

    def made(files: object, commands: object, results: list[str], tools: object) -> list[Any]:
        asked.append(results[1:])
        speeds = [100.0, 140.0, 120.0, 90.0, 130.0, 110.0, 150.0, 95.0, 145.0][: len(results) - 1]
        return [REPORT, *({**REPORT, "fmax": {"clk": {"achieved": speed}}} for speed in speeds)]

    monkeypatch.setattr(synthesis, "made", made)
    nine = synthesis.measure_core(SPEC, size.TARGETS["ECP5"], "", {})
    three = synthesis.measure_core(SPEC, size.TARGETS["ECP5"], "", {}, seeds=(1, 2, 3))
    assert [len(names) for names in asked] == [9, 3]
    assert (nine.figures["Fmax"], nine.spread) == (120.0, (90.0, 150.0))
    assert (three.figures["Fmax"], three.spread) == (120.0, (100.0, 140.0))


def test_without_seeds_there_is_no_fmax(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cores that have no bar of Fmax are not routed; their cells are in the tables all the same."""
    monkeypatch.setattr(synthesis, "made", lambda files, commands, results, tools: [REPORT][: len(results)])
    found = synthesis.measure_core(SPEC, size.TARGETS["ECP5"], "", {}, seeds=())
    assert "Fmax" not in found.figures
    row = size.rows({("reference", "ECP5"): found})[1]
    assert row[3:12] == ["325", "215", "1", "0", "", "", "", "", str(SPEC.latency.tick_to_velocity)]


def test_what_is_not_measured_again_stays_on_the_page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tools = {"yosys": "0.70"}
    found = results() | {("t", "ECP5"): size.Measurement({"COMB": 266, "latency": 20}, "")}
    found["reference", "HX8K"] = size.Measurement(
        found["reference", "HX8K"].figures, "a → b: logic 9.0 ns", (127.0, 133.0)
    )
    written = tmp_path / "size.md"
    monkeypatch.setattr(size, "PAGE", written)
    monkeypatch.setattr(size, "CELLS", tmp_path / "cells.json")
    monkeypatch.setattr(size, "METHOD_CELLS", {"s": "reference", "t": "t"})
    monkeypatch.setattr(size, "versions", lambda: tools)
    size.write(written, size.page(found, tools))
    size.write_table(size.table_of(written), size.rows(found))
    assert size.kept(written, tools) == found
    with pytest.raises(RuntimeError, match=r"^size\.md was not written with yosys 0\.71: make size$"):
        size.kept(written, {"yosys": "0.71"})
    monkeypatch.setattr(size, "measure", lambda *_: size.Measurement({"COMB": 300, "latency": 21}, ""))
    assert size.main(["--only", "t", "--update", "-o", str(written)]) == 0
    after = size.kept(written, tools)
    assert (after["reference", "HX8K"], after["t", "ECP5"].figures["COMB"]) == (found["reference", "HX8K"], 300)
    assert "| t | T method | 300 |" in written.read_text(encoding="utf-8")
    assert json.loads((tmp_path / "cells.json").read_text()) == {"s": 265, "t": 300}


def test_the_page_has_what_its_table_has() -> None:
    page = size.PAGE.read_text(encoding="utf-8")
    (words,) = re.findall(r"make size` wrote it with (.*)\.\n", page)
    tools = dict(word.rsplit(" ", 1) for word in words.split(", "))
    assert page.startswith(size.page(size.kept(size.PAGE, tools), tools))


def test_every_peer_can_be_measured_again() -> None:
    peers, sources = load("peers"), size.data("peers")["sources"]["rows"]
    assert [row[0] for row in size.PEERS["rows"]] == [row[0] for row in sources]
    for name, _, revision, files, options, seeds, words in sources:
        assert re.fullmatch("[0-9a-f]{12}|this one", revision), name
        assert all((files, options)), name
        if revision == "this one":
            assert (size.ROOT / files).is_file(), name
        assert peers.arguments([__file__, *words.strip("`").split()]).seeds == int(seeds), name


def test_exit_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(size, "versions", lambda: {"yosys": "0.70"})
    for changed, code in (({}, 0), ({"LC": 341}, 1)):
        found = results(**changed)
        monkeypatch.setattr(size, "measure", lambda item, target, *_, found=found: found[item.name, target])
        assert size.main(["--only", "reference", "-o", str(tmp_path / "size.md")]) == code
    assert "reference misses a bar. " in capsys.readouterr().out
    assert size.read_table(tmp_path / "tables" / "size.csv")[1]["missed"] == "LC"


def test_latency_of_a_core(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of a control loop is from the control tick to the current, not that of its tachometer."""
    bare = size.Measurement({"LC": 1}, "a → b")
    monkeypatch.setattr(synthesis, "measure_verilog", lambda *_: bare)
    loop = LoopSpec(tachometer=SPEC)
    for spec, latency in ((SPEC, SPEC.latency.tick_to_velocity), (loop, loop.latency.tick_to_result)):
        found = synthesis.measure_core(spec, size.TARGETS["HX8K"], "", {})
        assert found.figures == {"LC": 1, "latency": latency}


def test_the_cells_that_commands_know_are_those_of_the_page() -> None:
    rows = {row["configuration"]: row["COMB"] for row in docs.table("size") if row["target"] == "ECP5"}
    assert {name: int(rows[row]) for name, row in size.METHOD_CELLS.items()} == CELLS
    assert {name.removesuffix("-block") for name in CELLS} == set(METHODS)
    assert f" {CELLS['track']} cells of an ECP5" in docs.page("concepts/track.md")


def test_a_core_of_two_families_keeps_the_cells_of_each() -> None:
    page, rows = load("estimate"), docs.table("estimate")
    for family, title in (("ecp5", "ECP5"), ("gowin", "Gowin GW1N")):
        cells = {row["core"]: float(row["cells"]) for row in rows if row["family"] == title}
        assert {core: figures["cells"] for core, figures in page.before(family).items()} == cells
