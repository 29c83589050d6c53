"""Captures that are small on disk and would be large in memory: they are refused by the limits that are stated."""

import io
import os
import threading
from pathlib import Path

import numpy as np
import pytest
from support.captures import assert_error, assert_same, make_csv, make_sr

from tachometry.sim.captures import file, sigrok, waveform
from tachometry.sim.captures.read import read_capture
from tachometry.sim.signals.recording import MAX_EDGES, MAX_TICKS, PinTrace, Recording, check_ticks
from tachometry.spec import Encoder, STachometer, Timing

HEAD = '$timescale 1 us $end $var wire 1 ! a $end $var wire 1 " b $end $enddefinitions $end\n#0\n0!\n0"\n'


def test_a_session_that_never_changes_takes_no_memory(tmp_path: Path) -> None:
    quiet = read_capture(make_sr(tmp_path / "x.sr", [bytes(1 << 24)] * 2))
    assert len(quiet.time) == 1
    assert quiet.duration == pytest.approx(2 * (1 << 24) / 1e6)


@pytest.mark.parametrize("name", ["x.sr", "x.csv", "x.vcd"])
def test_too_many_changes(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, n = tmp_path / name, 50
    levels = [k & 1 for k in range(n)]
    if name == "x.sr":
        make_sr(path, [bytes(levels), bytes(levels)])
    elif name == "x.csv":
        make_csv(path, "time,a,b\n" + "".join(f"{k},{k & 1},0\n" for k in range(2 * n)))
    else:
        path.write_text(HEAD + "".join(f"#{k}\n{k & 1}!\n" for k in range(2 * n)))
    monkeypatch.setattr(file, "MAX_EDGES", 2 * n)
    assert len(read_capture(path).time) == 2 * n
    monkeypatch.setattr(file, "MAX_EDGES", 2 * n - 1)
    assert_error(path, f"PATH must have at most {2 * n - 1} changes of the lines, and has more")


def test_samples_that_unpack_to_too_much(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make_sr(tmp_path / "x.sr", [bytes(1000), bytes(1000)])
    monkeypatch.setattr(sigrok, "_MOST_SAMPLES", 1999)
    assert_error(path, "samples of PATH must have at most 1999 bytes, not 2000")


def test_a_long_list_of_members(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make_sr(tmp_path / "x.sr", [b"\0"] * 40)
    read_capture(path)
    monkeypatch.setattr(sigrok, "_MOST_LISTED", 2000)
    monkeypatch.setattr(sigrok, "CHUNK", 2000)
    assert_error(path, "the list of members of PATH must have at most 2000 bytes, not 2338")


@pytest.mark.parametrize("name", ["x.sr", "x.fst"])
def test_an_endless_device_is_no_file(name: str, tmp_path: Path) -> None:
    (tmp_path / name).symlink_to("/dev/zero")
    kinds = ".csv, .txt, .tsv, .teeth and .vcd, also with .gz,"
    assert_error(tmp_path / name, f"PATH must be a regular file: only {kinds} are read from a pipe or a device")


@pytest.mark.parametrize("name", ["x.csv", "x.vcd", "x"])
def test_a_pipe_is_read_once(name: str, tmp_path: Path) -> None:
    """Although line B never moves, for which other channels of a file are looked at; without a suffix it is a CSV."""
    text = HEAD + "#9\n1!\n" if name == "x.vcd" else "time,a,b,c\n0,0,0,0\n1,1,0,1\n"
    (plain := tmp_path / f"plain{Path(name).suffix or '.csv'}").write_text(text)
    os.mkfifo(tmp_path / name)
    threading.Thread(target=(tmp_path / name).write_text, args=[text], daemon=True).start()
    assert_same(read_capture(tmp_path / name), read_capture(plain))


@pytest.mark.parametrize("suffix", [".csv", ".vcd"])
def test_the_standard_input_is_a_pipe(suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (path := tmp_path / f"x{suffix}").write_text(HEAD + "#9\n1!\n" if suffix == ".vcd" else "time,a,b\n0,0,0\n1,1,0\n")
    with path.open(encoding="utf-8") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        assert_same(read_capture(file.STDIN), read_capture(path))
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BufferedReader(io.BytesIO(b"time,a,b\n0,0,x\n"))))
    with pytest.raises(file.CaptureError, match=r"^- must have at least one row"):
        read_capture(file.STDIN)


def test_a_head_of_too_many_variables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (path := tmp_path / "x.vcd").write_text(HEAD)
    monkeypatch.setattr(waveform, "_MOST_NAMED", 2 * (64 + 2))
    read_capture(path)
    monkeypatch.setattr(waveform, "_MOST_NAMED", 2 * (64 + 2) - 1)
    with pytest.raises(file.CaptureError, match="must have names of variables of at most 131 characters, each with 64"):
        read_capture(path)
    path.write_text("$scope module deep $end\n" * 900)
    assert_error(path, "names of PATH with their scopes must have at most 4096 characters")


def test_times_that_overflow(tmp_path: Path) -> None:
    path = make_csv(tmp_path / "x.csv", "time,a,b\n-1e308,0,0\n1e308,1,0\n")
    assert_error(path, "PATH line 2: time must be at most 1e+30 s, not '-1e308'")


def test_more_ticks_than_fit() -> None:
    spec = STachometer(encoder=Encoder(1), timing=Timing(1_000_000, 10, 4))
    longest = MAX_TICKS * 10e-6
    check_ticks(longest, spec)
    quiet = np.zeros(1, dtype=np.uint8)
    for duration in (longest + 1e-5, 1e30, float("inf")):
        recording = Recording(np.zeros(1), quiet, quiet, duration)
        with pytest.raises(
            ValueError, match=rf"^what is run must have at most {MAX_TICKS} ticks, 100s of this tick, not"
        ):
            PinTrace.of(recording, spec)
    assert MAX_EDGES == MAX_TICKS == 10_000_000
