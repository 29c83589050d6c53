"""Timing is read from recorded logs of nextpnr, and from logs with violations; programs are found."""

import importlib.metadata
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.fake_tools import FakeTools

from tachometry.boards.fpga import tools
from tachometry.boards.fpga.flow import widen_tables
from tachometry.boards.fpga.timing import TimingError, check_hold, slowest_clock

LOGS = Path(__file__).parent / "logs"
# Of a Tang Nano 9K, for which nextpnr 0.11 lists 8 violations whose paths have 1.07 ns left.
FALSE_HOLD = (LOGS / "gowin_false_hold.log").read_text()
COUNT = "Info: 8 Hold/min time violations"
LEFT = "hold -0.16  1.07 Source"


def report(achieved: float, constraint: float = 27.0, **others: float) -> dict[str, object]:
    clocks = {"cd_sync.clk": {"achieved": achieved, "constraint": constraint}}
    return {"fmax": clocks | {name: {"achieved": fast, "constraint": 27.0} for name, fast in others.items()}}


def refused(check: Callable[..., object], *args: object) -> str:
    """Return why something is refused; empty if it is not."""
    try:
        check(*args)
    except ValueError as error:
        return str(error)
    return ""


def check_holds() -> None:
    for fine in (
        "",
        FALSE_HOLD,
        FALSE_HOLD.replace("Warning: Hold", "ERROR: Hold"),
        FALSE_HOLD.replace(LEFT, "hold -0.16  0.00 Source"),
    ):
        assert refused(check_hold, fine) == ""
    clock, of_hold = "clock 'posedge cd_sync.clk'", "timing is not met: "
    last_is_late = "hold  0.42 -0.01 Source".join(FALSE_HOLD.rsplit(LEFT, 1))
    early = of_hold + "data are {} ns too early at t.core.tachometer.datapath.quotient.reciprocal.table.0.0.ADB{}"
    unlisted = f"{of_hold}a hold time on {clock}, whose path is not listed"
    for wrong, message in [
        (last_is_late, early.format("0.01", 8)),
        (last_is_late.replace("Warning: Hold", "ERROR: Hold"), early.format("0.01", 8)),
        (FALSE_HOLD.replace(LEFT, "hold  0.42 -1.50 Source"), early.format("1.50", 11)),
        (FALSE_HOLD.replace(COUNT, COUNT.replace("8", "11")), f"{of_hold}of 11 hold times only 8 are listed"),
        (FALSE_HOLD.replace("Info:       hold", "Info:       what"), unlisted),
        (f"Warning: Hold/min time violation for {clock}:\n", unlisted),
    ]:
        assert refused(check_hold, wrong) == message


def test_clocks_are_held_against_the_one_of_the_board() -> None:
    for fine, clock_hz in [
        (report(126.1), 27_000_000),
        (report(27.0), 27_000_000),
        (report(40.2, 11.99999), 12_000_000),  # nextpnr keeps the period in picoseconds
    ]:
        assert refused(slowest_clock, fine, clock_hz) == ""
    assert slowest_clock(report(126.1, other=30.0), 27_000_000) == 30
    for wrong, message in [
        (report(26.99), "timing is not met: cd_sync.clk is good for 26.99 MHz, not 27 MHz"),
        (report(126.1, other=20.5), "timing is not met: other is good for 20.50 MHz, not 27 MHz"),
        (report(126.1, 12.0), "cd_sync.clk must be checked at 27 MHz, not 12 MHz"),
        ({"fmax": {}}, "nextpnr must have checked a clock, and has checked none"),
        ({}, "nextpnr must have checked a clock, and has checked none"),
    ]:
        assert refused(slowest_clock, wrong, 27_000_000) == message


def test_only_hold_times_that_are_violated_are_violations() -> None:
    assert COUNT in FALSE_HOLD
    assert FALSE_HOLD.count(LEFT) == 8
    check_holds()


def test_every_table_of_gowin_has_a_time() -> None:
    """nextpnr has times for four inputs alone; those that are added change no value."""
    values = {"LUT3": "01101001", "LUT1": "01", "LUT4": "0111111111111111", "DFF": "0"}
    cells: dict[str, Any] = {kind: {"type": kind, "parameters": {"INIT": value}} for kind, value in values.items()}
    widen_tables({"modules": {"top": {"cells": cells}}})
    made = [(cell["type"], cell["parameters"]["INIT"]) for cell in cells.values()]
    assert made == [("LUT4", "01101001" * 2), ("LUT4", "01" * 8), ("LUT4", values["LUT4"]), ("DFF", "0")]


def test_a_recorded_design_that_is_too_slow() -> None:
    """Its hold times are false, and its frequency is not."""
    log = (LOGS / "gowin_slow_and_false_hold.log").read_text()
    assert "Max frequency for clock 'cd_sync.clk': 123.73 MHz (FAIL at 200.00 MHz)" in log
    check_hold(log)
    with pytest.raises(TimingError, match=r"^timing is not met: cd_sync.clk is good for 123.73 MHz, not 200 MHz$"):
        slowest_clock(report(123.73, 200.0), 200_000_000)


def test_programs_of_this_python_come_before_those_on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    FakeTools(tmp_path / "path", monkeypatch, "here there")
    FakeTools(tmp_path / "scripts", monkeypatch, "here")
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    assert tools.find("here") == str(tmp_path / "scripts" / "here")
    assert tools.find("there") == str(tmp_path / "path" / "there")
    with pytest.raises(tools.ToolError, match=r"^nowhere is needed for boards and not installed: pip install 'tach"):
        tools.find("nowhere")


def test_versions_are_those_that_are_installed() -> None:
    assert tools.versions(["amaranth"]) == {"amaranth": importlib.metadata.version("amaranth")}
    with pytest.raises(tools.ToolError, match=r"^nonsense-of-nobody is needed for boards and not installed: pip "):
        tools.versions(["amaranth", "nonsense-of-nobody"])
