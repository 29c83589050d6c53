"""Recordings: a row for each frame, with units, and only values that were there."""

import csv
import sys
from pathlib import Path

import pyarrow.parquet
import pytest
from support.demo import demo_map, manifest_of

from tachometry.boards.host.registers import HostRegisters
from tachometry.boards.monitor.columns import columns
from tachometry.boards.monitor.recorder import Recorder
from tachometry.boards.monitor.session import Frame
from tachometry.spec.registers.demo import DemoMap

ROWS = 10_000  # more than a group


def frame_of(registers: DemoMap, time: float, **values: int) -> Frame:
    """Return a frame in which ports show these values, and others 0."""
    host = HostRegisters(manifest_of(registers))
    words = []
    for register in registers:
        if register.captured:
            word = 0
            for field in register.fields:
                word |= (values.get(field.port, 0) >> field.shift & (1 << field.width) - 1) << field.low
            words.append(word)
    return Frame(time, host.snapshot(words))


def frames(registers: DemoMap) -> list[Frame]:
    lsb, none = registers.spec.velocity.rad_per_s_per_lsb, registers.spec.velocity.shown_absent
    assert lsb < 1
    return [
        frame_of(registers, 0.0, position=-3, bounds_valid=0),
        frame_of(
            registers, 0.25, velocity=-2, bounds_valid=1, velocity_lower=-3, velocity_upper=none, standstill=1, age=7
        ),
        frame_of(registers, 1e-7, velocity=3, bounds_valid=1, velocity_lower=-none, velocity_upper=5),
    ]


def written(path: Path, registers: DemoMap, rows: list[Frame]) -> None:
    with Recorder(path, path.suffix, columns(registers)) as recorder:
        for row in rows:
            recorder.write(row)
        assert recorder.rows == len(rows)


@pytest.mark.parametrize("unit", ["count/tick", "rpm"])
def test_csv(unit: str, tmp_path: Path) -> None:
    registers = demo_map("s", bounds="yes", age="yes", unit=unit)
    written(tmp_path / "a.csv", registers, frames(registers))
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    shown = registers.spec.scale.shown_unit
    lsb = shown.of(registers.spec.velocity.rad_per_s_per_lsb)
    assert shown.name == ("rpm" if unit == "rpm" else "rad/s")
    speed, lower, upper = (f"{name} [{shown.name}]" for name in ("velocity", "velocity_lower", "velocity_upper"))
    assert [row["time [s]"] for row in rows] == ["0.0", "0.25", "1e-07"]
    assert [float(row[speed]) for row in rows] == pytest.approx([0, -2 * lsb, 3 * lsb], rel=1e-12)
    assert [row[lower] for row in rows][0::2] == ["", ""]
    assert [row[upper] for row in rows][:2] == ["", ""]
    assert float(rows[1][lower]) == pytest.approx(-3 * lsb, rel=1e-12)
    assert float(rows[2][upper]) == pytest.approx(5 * lsb, rel=1e-12)
    assert [row["position [counts]"] for row in rows] == ["-3", "0", "0"]
    assert [row["standstill"] for row in rows] == ["0", "1", "0"]
    assert [row["age [ticks]"] for row in rows] == ["0", "7", "0"]
    heads = {name.split(" ")[0] for name in rows[0]}
    assert heads == {port.name for port in registers.ports}


def test_parquet_says_the_same(tmp_path: Path) -> None:
    registers = demo_map("s", bounds="yes", age="yes")
    some = frames(registers) * (ROWS // 3)
    for suffix in (".csv", ".parquet"):
        written(tmp_path / f"a{suffix}", registers, some)
    table = pyarrow.parquet.read_table(tmp_path / "a.parquet")
    assert table.num_rows == len(some)
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert table.column_names == rows[0]

    def text(value: object) -> str:
        return "" if value is None else str(int(value) if isinstance(value, bool) else value)

    assert [[text(value) for value in row.values()] for row in table.to_pylist()] == rows[1:]


def test_parquet_without_a_row(tmp_path: Path) -> None:
    written(tmp_path / "a.parquet", demo_map(), [])
    assert pyarrow.parquet.read_table(tmp_path / "a.parquet").num_rows == 0
    assert [file.name for file in tmp_path.iterdir()] == ["a.parquet"]


def test_without_pyarrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(OSError, match=r"^recordings in Parquet need pyarrow: pip install 'tachometry\[host\]'$"):
        Recorder(tmp_path / "a.parquet", ".parquet", columns(demo_map()))
    assert not list(tmp_path.iterdir())
