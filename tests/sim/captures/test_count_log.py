"""Logs of time and count become the lines of an encoder that turns evenly between two rows."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from support.command import run
from support.nightly import only

from tachometry.sim.captures.count_log import ShaftLog, read_angle_log, read_count_log
from tachometry.sim.captures.file import CaptureError
from tachometry.spec import Encoder

ROOT = Path(__file__).parents[3]


def log(folder: Path, counts: list[int], wrap: int | None = None, head: str = "time [ms],n") -> ShaftLog:
    rows = [f"{5 * k},{count}" for k, count in enumerate(counts)]
    (folder / "log.csv").write_text("\n".join([head, *rows, ""]))
    return read_count_log(folder / "log.csv", "n", wrap=wrap)


@pytest.mark.parametrize("decoding", [1, 2, 4])
def test_edges_are_even_between_rows(decoding: int, tmp_path: Path) -> None:
    recording = log(tmp_path, [8, 12, 12, 10]).recording(Encoder(9, decoding=decoding))
    quarters = 4 // decoding
    steps = np.diff(np.unwrap([(0, 1, 3, 2)[n] for n in recording.level], period=4))
    assert steps.tolist() == [1] * 4 * quarters + [-1] * 2 * quarters
    n = 4 * quarters
    expected = [*(5e-3 * np.arange(1, n + 1) / n), *(10e-3 + 5e-3 * np.arange(1, n // 2 + 1) / (n // 2))]
    np.testing.assert_allclose(recording.time[1:], expected, rtol=1e-12)
    assert recording.duration == 15e-3


@pytest.mark.parametrize(
    ("counts", "wrap", "total"),
    [
        ([65530, 4, 10], None, [0, 10, 16]),
        ([4, 65530], None, [0, -10]),
        ([32760, -32766], None, [0, 10]),
        ([4294967290, 4], None, [0, 10]),
        ([0, 32769], None, [0, -32767]),
        ([0, 32768, 0], None, [0, 32768, 0]),
        ([0, 1 << 31, 0], None, [0, 1 << 31, 0]),
        ([0, 40000, 70000], None, [0, 40000, 70000]),
        ([4090, 4], 4096, [0, 10]),
        ([65530, 4], 0, [0, -65526]),
        ([7, 7, 7], None, [0, 0, 0]),
    ],
)
def test_a_counter_wraps(counts: list[int], wrap: int | None, total: list[int], tmp_path: Path) -> None:
    read = log(tmp_path, counts, wrap)
    assert read.place.tolist() == total
    told = " ".join(read.notes)
    assert ("wraps" in told) == (np.diff(counts).tolist() != np.diff(total).tolist())
    assert "the shaft is taken to turn evenly" in told


def test_of_rows_with_one_time_the_last_holds(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("; by hand\nn;time [ms]\n1;0,0\n2;0,0\n\n5;2,5\n6;2,5\n")
    read = read_count_log(tmp_path / "log.csv", "0")
    assert (read.time.tolist(), read.place.tolist()) == ([0, 2.5e-3], [0, 4])
    assert "2 rows have the time of the next one, which holds" in read.notes


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0,0", "must have at least two rows after its header, not 1"),
        ("0,0\n0,1", "must not all be equal"),
        ("0,0\n1,x", "line 3: n must be a whole number up to 2^53, not 'x'"),
        ("0,0\n1", "line 3: a row must have 2 fields (time,n), not 1"),
        ("0,0\n1,1.5", "line 3: n must be a whole number up to 2^53, not '1.5'"),
        ("0,0\n1,inf", "line 3: n must be a whole number up to 2^53, not 'inf'"),
        ("0,0\nnan,1", "line 3: time must be"),
        ("2,0\n1,1", "line 3: time must be at least 2.0 s as before, not 1.0 s"),
        ("0,0\n1,99999999", "at most 10000000 edges to and fro, not 99999999"),
    ],
)
def test_what_cannot_be_is_told(rows: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(f"time,n\n{rows}\n")
    with pytest.raises(CaptureError, match=re.escape(message)):
        read_count_log(tmp_path / "log.csv", "n").recording(Encoder(9))


@pytest.mark.parametrize(
    ("head", "values", "column", "turns"),
    [
        ("time_ms,shaft_deg", [350, 10, 100, 350], "shaft_deg", [0, 20, 110, 0]),
        ("time_ms,theta [rad]", [3.1, -3.1, 3.1, 2.1], "theta", [0, 4.7662, 0, -57.2958]),
        ("time_ms,n", [0, 0.5, 2.5, 2.25], "n:turn", [0, 180, 900, 810]),
        ("time,n\nms,degrees", [0, 340, 700], "n", [0, 340, 700]),
    ],
)
def test_an_angle_wraps_at_a_turn(
    head: str, values: list[float], column: str, turns: list[float], tmp_path: Path
) -> None:
    rows = [f"{5 * k},{value}" for k, value in enumerate(values)]
    (tmp_path / "log.csv").write_text("\n".join([head, *rows, ""]))
    read = read_angle_log(tmp_path / "log.csv", column)
    np.testing.assert_allclose(np.degrees(read.place), turns, atol=1e-4)
    recording = read.recording(Encoder(90))
    steps = np.diff(np.unwrap([(0, 1, 3, 2)[n] for n in recording.level], period=4))
    assert steps.sum() == round(turns[-1])
    assert (steps.min(), steps.max()) == (-1 if min(np.diff(turns)) < 0 else 1, 1)


def test_an_edge_comes_where_the_angle_passes_it(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,a_deg\n0.0,0\n0.1,0.75\n0.3,-1.25\n")
    recording = read_angle_log(tmp_path / "log.csv", "a_deg").recording(Encoder(90))
    np.testing.assert_allclose(recording.time, [0, 0.1 * 0.5 / 0.75, 0.1 + 0.25 * 0.1, 0.1 + 1.25 * 0.1])
    assert recording.level.tolist() == [0, 1, 0, 2]


@pytest.mark.parametrize(
    ("rows", "options", "counts"),
    [
        ("time_us\n700\n3200\n5700\n8200\n", "", 4),
        ("n,time_ms\n5,0\n6,2.5\n7,5.0\n", "--pulse-times time_ms", 3),
        ("gap_us,flag\n2500,0\n2500,1\n2600,0\n", "--pulse-periods gap_us", 3),
        ("700\n3200\n5700\n", "--pulse-times 0 --time-unit us", 3),
    ],
)
def test_rows_are_pulses(
    rows: str, options: str, counts: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "log.csv").write_text(rows)
    core = "--sensor pulses --decoding 1 --ppr 100 --clock 1MHz --tick 1ms --method m".split()
    assert run("replay", tmp_path / "log.csv", *core, *options.split()) == 0
    assert f"counts out {counts} " in " ".join(capsys.readouterr().out.split())
    assert run("replay", tmp_path / "log.csv", *core[4:], *options.split()) == 2
    assert "--sensor must be pulses for" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("head", "rows", "hint"),
    [
        ("time_ms,n", [0, 1, 2, 9], "(of a counter, --count n takes its counts)"),
        ("time_ms,count", [0, 1, 2], "(of a counter, --count count takes its counts)"),
        ("time_ms,pos_deg", [0, 1.5], "(of an angle, --angle pos_deg takes it)"),
        ("time_ms,speed [rpm]", [300, 301], "(a speed is a motion: simulate --motion csv:FILE:'speed [rpm]')"),
        ("time_ms,n,m", ["0,0", "1,9"], "(of a counter, --count m takes its counts)"),
        ("time_ms,theta", [0.0, 1.5], "(of an angle, --angle theta:deg takes it)"),
        ("n,Zeit (ms),a,b", ["0.0,0,0", "0.5,1,0"], "or --time 'Zeit (ms)' must be given, not 'n,Zeit (ms),a,b'"),
        ("time_ms,ab", [0, 1, 3], "lines in one number are --a ab[0] --b ab[1]"),
    ],
)
def test_a_refusal_names_the_option(
    head: str, rows: list[object], hint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "log.csv").write_text("\n".join([head, *(f"{k},{row}" for k, row in enumerate(rows)), ""]))
    assert run("replay", tmp_path / "log.csv", *"--ppr 100 --clock 1MHz --tick 1ms".split()) == 2
    assert capsys.readouterr().err.rstrip().endswith(hint)


def test_the_guide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    page = (ROOT / "docs/guides/captures.md").read_text(encoding="utf-8").partition("## Logs of time and count")[2]
    page = page.partition("\n## ")[0]
    (tmp_path / "build").mkdir()
    rows = page.partition("```csv\n")[2].partition("```")[0]
    (tmp_path / "build" / "counts.csv").write_text(rows)
    monkeypatch.chdir(tmp_path)
    soon = ("--method", "m")  # whose core is compiled sooner than that of track
    replay, simulate = re.findall(r"^tachometry (.*)", page, re.MULTILINE)
    assert run(*shlex.split(replay), *soon) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "lines count from left wheel captured 0.015 s, 30 changes of the lines" in told
    assert "counts out 30" in told
    assert "note between two of the 4 rows the shaft is taken to turn evenly" in told
    assert "note the counter wraps at 65536, 1 times here" in told
    assert run(*shlex.split(simulate), *soon) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "lines count from left wheel captured 0.015 s, 30 changes of the lines" in told
    assert re.search(r"note between two of the 4 rows .* counts in (2[0-9]|30) counts out \1 errors flagged 0", told)


# The engine counts in every decoding in test_matrix.py; x2 could be either of the others by mistake.
@pytest.mark.parametrize("decoding", only(["2"], ["1", "2", "4"]))
def test_a_motion_counts_what_the_log_says(
    decoding: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    log(tmp_path, [3, 13, 13, 9, 9, 9])
    core = f"--method s --ppr 9 --clock 100kHz --tick 1ms --decoding {decoding}".split()
    assert run("simulate", "--motion", "counts:log.csv:time:n", *core) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "counts in 6 counts out 6 errors flagged 0" in told
    assert run("simulate", "--motion", "counts:log.csv", *core) == 2
    assert "--motion must be counts:FILE:TIME:COUNT alone, not 'counts:log.csv'" in capsys.readouterr().err
    assert run("simulate", "--motion", "counts:log.csv:time:n", *core, "--trace", "log.csv") == 2
    assert "must be another file than the input" in capsys.readouterr().err
