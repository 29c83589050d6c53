"""Captures: round trips, and files as sigrok makes them."""

import os
import re
import time
import tracemalloc
import zipfile
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from support import docs
from support.captures import MEGAHERTZ, assert_same, make_csv, make_sr, random_trace

from tachometry.sim.captures.file import CaptureError, Channels
from tachometry.sim.captures.header import TextOptions
from tachometry.sim.captures.read import read_capture
from tachometry.sim.captures.sigrok import divide, read_sr, write_sr
from tachometry.sim.captures.text import read_csv, write_csv
from tachometry.sim.signals.recording import PinTrace, Recording


@pytest.mark.parametrize("piece", [1, 7, 64, 1 << 22])
@pytest.mark.parametrize("chunk", [1, 259, 1000, 1 << 22])
def test_sr_round_trip_of_any_chunks(tmp_path: Path, chunk: int, piece: int) -> None:
    trace = random_trace(700, 2000)
    write_sr(tmp_path / "x.sr", trace, 50 * MEGAHERTZ, _chunk=chunk)
    recording = read_sr(tmp_path / "x.sr", _piece=piece).whole()
    assert recording.duration == pytest.approx(2000 / 50e6)
    assert_same(recording.place(50 * MEGAHERTZ), trace)


@pytest.mark.parametrize("clock_hz", [1, 49, 12 * MEGAHERTZ, 12_500_000, 33_333_333, 50 * MEGAHERTZ, 1_000_000_000])
def test_sr_round_trip_at_any_clock(tmp_path: Path, clock_hz: int) -> None:
    trace = random_trace(20_000, 3_000_001)
    write_sr(tmp_path / "x.sr", trace, clock_hz)
    assert_same(read_capture(tmp_path / "x.sr").place(clock_hz), trace)
    assert_same(read_capture(tmp_path / "x.sr", samplerate_hz=clock_hz).place(clock_hz), trace)


@pytest.mark.parametrize("n_clocks", [1, 2, 258, 259, 260, 261])
def test_sr_round_trip_of_lines_at_rest(tmp_path: Path, n_clocks: int) -> None:
    trace = PinTrace(np.zeros(1, np.int64), np.ones(1, np.uint8), np.zeros(1, np.uint8), n_clocks)
    write_sr(tmp_path / "x.sr", trace, 1000)
    assert_same(read_capture(tmp_path / "x.sr").place(1000), trace)


@pytest.mark.parametrize("block", [1, 16, 100, 1 << 22])
def test_csv_round_trip_of_any_blocks(tmp_path: Path, block: int) -> None:
    rng = np.random.default_rng(3)
    trace = random_trace(500, 10_000)
    times = np.append(0.0, np.sort(rng.random(len(trace.clock) - 1)))
    for duration in (float(times[-1]), 1.5):
        recording = Recording(times, trace.a, trace.b, duration)
        write_csv(tmp_path / "x.csv", recording)
        assert_same(read_csv(tmp_path / "x.csv", _block=block).whole(), recording)


def test_csv_as_written(tmp_path: Path) -> None:
    recording = Recording(np.array([-0.0, 1e-7]), np.array([0, 1], np.uint8), np.array([1, 1], np.uint8), 0.1)
    write_csv(tmp_path / "x.csv", recording)
    assert (tmp_path / "x.csv").read_bytes() == b"time,a,b\n0.0,0,1\n1e-07,1,1\n0.1,1,1\n"


# Times


@pytest.mark.parametrize("rate", [49, 44_100, 1e6, 12.5e6, 24e6, 48e6, 50e6, 100e6, 1e9, 1e6 / 3])
def test_sample_k_is_found_at_clock_k(rate: float) -> None:
    rng = np.random.default_rng(5)
    k = np.concatenate([np.arange(300_000), rng.integers(1, 10**9, 300_000), [10**9]])
    assert np.any(np.ceil(k / rate * rate) != k)  # what rounding to nearest gets wrong
    np.testing.assert_array_equal(np.ceil(divide(k, rate, up=False) * rate), k)
    np.testing.assert_array_equal(np.floor(divide(k, rate, up=True) * rate), k)


@pytest.mark.parametrize(("rate", "clock"), [(1e6, 50e6), (24e6, 48e6), (1e6, 27e6), (50e6, 1e6), (24e6, 50e6), (7, 3)])
def test_other_clocks_see_a_change_at_the_next_edge(rate: float, clock: float) -> None:
    k = np.random.default_rng(6).integers(0, 10**6, 10**5)
    seen = np.ceil(divide(k, rate, up=False) * clock).astype(np.int64)
    np.testing.assert_array_equal(seen, -(-k * int(clock) // int(rate)))


def test_quotients_are_rounded_as_told() -> None:
    for k in range(1, 2000):
        down, up = (float(divide(np.array([k]), 49.7, up=up)[0]) for up in (False, True))
        exact = k / Fraction(49.7)
        assert Fraction(down) <= exact <= Fraction(up)
        assert up in (down, np.nextafter(down, np.inf))


# Sessions as sigrok makes them


def test_change_is_dated_at_the_first_sample_that_shows_it(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [bytes([0, 0, 1, 1]), bytes([1, 3, 3, 2, 2])])
    recording = read_capture(tmp_path / "x.sr")
    np.testing.assert_allclose(recording.time, [0, 2e-6, 5e-6, 7e-6], rtol=1e-15)
    assert recording.a.tolist() == [0, 1, 1, 0]
    assert recording.b.tolist() == [0, 0, 1, 1]
    assert recording.a.dtype == recording.b.dtype == np.uint8
    assert recording.duration == pytest.approx(9e-6)


@pytest.mark.parametrize("unitsize", range(1, 9))
def test_all_unit_sizes_and_disabled_probes(tmp_path: Path, unitsize: int) -> None:
    rng = np.random.default_rng(unitsize)
    samples = rng.integers(0, 256, (500, unitsize), dtype=np.uint8)
    first, last = unitsize * 3, unitsize * 8  # two probes of all, as numbered from 1
    data = samples.tobytes()
    split = 100 * unitsize
    make_sr(tmp_path / "x.sr", [data[:split], data[split:]], {first: "SCK", last: "MISO"}, unitsize=str(unitsize))
    bits = np.unpackbits(samples, axis=1, bitorder="little")
    for piece in (1, 24, 1 << 20):
        trace = read_sr(tmp_path / "x.sr", Channels("MISO", "SCK"), _piece=piece).whole().place(MEGAHERTZ)
        row = np.searchsorted(trace.clock, np.arange(500), "right") - 1
        np.testing.assert_array_equal(trace.a[row], bits[:, last - 1])
        np.testing.assert_array_equal(trace.b[row], bits[:, first - 1])


@pytest.mark.parametrize("version", ["1", "2", "2\n"])
def test_versions_and_a_single_member(tmp_path: Path, version: str) -> None:
    make_sr(tmp_path / "x.sr", bytes([0, 1, 3]), version=version)
    assert read_capture(tmp_path / "x.sr").a.tolist() == [0, 1, 1]


def test_chunks_are_read_by_number_not_by_name(tmp_path: Path) -> None:
    trace = random_trace(30, 120)
    write_sr(tmp_path / "x.sr", trace, 1000, _chunk=10)
    with zipfile.ZipFile(tmp_path / "x.sr") as archive, zipfile.ZipFile(tmp_path / "y.sr", "w") as shuffled:
        for name in sorted(archive.namelist(), reverse=True):
            shuffled.writestr(name, archive.read(name))
    assert_same(read_capture(tmp_path / "y.sr").place(1000), trace)


@pytest.mark.parametrize(
    ("text", "hertz"),
    [
        ("1 MHz", 1e6),
        ("24 MHz", 24e6),
        ("12.5 MHz", 12.5e6),
        ("200 kHz", 2e5),
        ("200kHz", 2e5),
        ("1 GHz", 1e9),
        ("500 Hz", 500),
        ("1000000", 1e6),
        ("4M", 4e6),
    ],
)
def test_samplerate_texts(tmp_path: Path, text: str, hertz: float) -> None:
    make_sr(tmp_path / "x.sr", bytes(1000), samplerate=text)
    assert read_capture(tmp_path / "x.sr").duration == pytest.approx(1000 / hertz, rel=1e-15)


@pytest.mark.parametrize("text", [None, "", "0 Hz", "0"])
def test_samplerate_given_when_the_file_has_none(tmp_path: Path, text: str | None) -> None:
    make_sr(tmp_path / "x.sr", bytes(1000), samplerate=text)
    assert read_capture(tmp_path / "x.sr", samplerate_hz=2e6).duration == pytest.approx(5e-4)
    with pytest.raises(CaptureError, match=r"x\.sr has no samplerate: give it with --samplerate$"):
        read_capture(tmp_path / "x.sr")


def test_analogue_channels_and_other_devices_are_passed_over(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [bytes([0, 1])], total_analog="2", analog9="A0", analog10="50%")
    with zipfile.ZipFile(tmp_path / "x.sr", "a") as archive:
        archive.writestr("analog-1-9-1", bytes(64))
        archive.writestr("logic-2-1", bytes(64))
    assert read_capture(tmp_path / "x.sr").duration == pytest.approx(2e-6)


@pytest.mark.parametrize(
    ("names", "a", "b", "bits"),
    [
        (["D0", "D1", "D2"], None, None, (0, 1)),
        (["X", "B", "A"], None, None, (2, 1)),
        (["x", "b", "a"], None, None, (2, 1)),
        (["A", "X", "Y"], None, None, (0, 1)),
        (["D0", "D1", "D2"], "D2", "d0", (2, 0)),
        (["D0", "D1", "D2"], 2, "1", (2, 1)),
        (["D0", "D1", "D2"], "D2", None, (2, 1)),
        (["1", "2", "0"], "1", "0", (0, 2)),
        (["1", "2", "0"], 1, 0, (1, 0)),
        (["p", "P", "q"], "P", "p", (1, 0)),
    ],
)
def test_choice_of_channels(
    tmp_path: Path, names: list[str], a: str | int | None, b: str | int | None, bits: tuple[int, int]
) -> None:
    samples = np.arange(8, dtype=np.uint8)
    make_sr(tmp_path / "x.sr", [samples.tobytes()], dict(enumerate(names, 1)))
    rows = "".join(f"{k}e-6,{k & 1},{k >> 1 & 1},{k >> 2}\n" for k in samples)
    make_csv(tmp_path / "x.csv", f"time,{','.join(names)}\n{rows}")
    for name in ("x.sr", "x.csv"):
        trace = read_capture(tmp_path / name, a, b).place(MEGAHERTZ)
        levels = np.zeros(8, np.uint8)  # a and b of all samples but the last, where the CSV ends
        levels[trace.clock] = 1
        row = np.cumsum(levels)[:7] - 1
        np.testing.assert_array_equal(trace.a[row], samples[:7] >> bits[0] & 1)
        np.testing.assert_array_equal(trace.b[row], samples[:7] >> bits[1] & 1)


def test_number_of_a_probe_is_its_bit(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [bytes([0, 8, 0x88])], {4: "x", 8: "y"})
    recording = read_capture(tmp_path / "x.sr", 3, "7")
    assert recording.a.tolist() == [0, 1, 1]
    assert recording.b.tolist() == [0, 0, 1]


# CSV of others


@pytest.mark.parametrize(
    "text",
    [
        "time,a,b\n0,0,1\n1,1,1\n2,1,1\n",
        "time,a,b\r\n0,0,1\r\n1,1,1\r\n2,1,1\r\n",
        "\ufefftime,a,b\n0,0,1\n1,1,1\n2,1,1",
        "time, a, b\n0, 0, 1\n 1, 1, 1\n2, 1.0, 1e0\n\n\n",
        "time,note,A,x,B\n0,a b,0,,1\n0.5,é,0,nan,1\n1,#,1,7,1\n2,1,1,1,1\n",
        "time,a,b\n-1,0,1\n0,1,1\n1,1,1\n",
        "Time [s],a,b\n0,0,1\n1,1,1\n2,1,1\n",
        "a,b,Time[ms]\n0,1,-500\n1,1,500\n1,1,1500\n",
        "b;TIME (µs);a\n1;0;0\n1;1000000,0;1\n1;2e6;1\n",
        "# made by hand\n\n; or not\ntime\tB\tC\tA\n0\t1\t2\t0\n#\n;\n1\t1\t2\t1\n# so\n2\t1\t2\t1\n;\n",
        '"time","a","b"\n0,0,1\n1,1,1\n2,1,1\n',
    ],
)
@pytest.mark.parametrize("block", [1, 5, 1 << 22])
def test_csv_variants(tmp_path: Path, text: str, block: int) -> None:
    wanted = Recording(np.array([0.0, 1.0]), np.array([0, 1], np.uint8), np.array([1, 1], np.uint8), 2.0)
    assert_same(read_csv(make_csv(tmp_path / "x.csv", text), _block=block).whole(), wanted)


# As Saleae's Logic 2 exports it.
SALEAE = """\
Time [s],Channel 0,Channel 1
-0.000001500,0,0
0.000000000,1,0
0.000001500,1,1
0.000003000,0,1
"""


def test_saleae(tmp_path: Path) -> None:
    recording = read_capture(make_csv(tmp_path / "x.csv", SALEAE))
    np.testing.assert_allclose(recording.time, [0, 1.5e-6, 3e-6, 4.5e-6], rtol=1e-12)
    assert (recording.a.tolist(), recording.b.tolist()) == ([0, 1, 1, 0], [0, 0, 1, 1])
    turned = read_capture(tmp_path / "x.csv", "Channel 1", 0)
    assert (turned.a.tolist(), turned.b.tolist()) == ([0, 0, 1, 1], [0, 1, 1, 0])


# As sigrok-cli 0.7.2 makes it, of 13 samples at 24 MHz; times of 41 ns rather than of 41 2/3.
SIGROK = """\
; CSV generated by libsigrok 0.5.2
; from Session-emulating driver on Sun Nov 22 21:59:51 2026
; Channels (2/2): A, B
; Samplerate: 24 MHz
"""
SAMPLES = bytes([0, 0, 1, 1, 3, 3, 2, 2, 0, 0, 1, 1, 3])
ROWS = [f"{level & 1},{level >> 1}" for level in SAMPLES]
CHANGES = (0, 2, 4, 6, 8, 10, 12)  # of these samples; the last ends the file


@pytest.mark.parametrize(
    "text",
    [
        "\n".join([SIGROK + "logic,logic", *ROWS]),
        "\n".join([SIGROK.replace(";", "#") + "A,B", *ROWS]),
        "\n".join([SIGROK + "nanoseconds,logic,logic", *(f"{41 * k},{row}" for k, row in enumerate(ROWS, 1))]),
        "\n".join([SIGROK + "Time,A,B", *(f"{41 * (k + 1)},{ROWS[k]}" for k in CHANGES)]),
        "\n".join(
            [SIGROK + "nanoseconds;logic;logic", *(f"{41 * (k + 1)};{ROWS[k]}".replace(",", ";") for k in CHANGES)]
        ),
        "\n".join([SIGROK + "logic,logic,Trigger", *(f"{row},0" for row in ROWS)]),
    ],
    ids=["samples", "other comments", "times", "dedup", "semicolons", "trigger"],
)
@pytest.mark.parametrize("block", [1, 7, 1 << 22])
def test_csv_of_sigrok_is_its_session(tmp_path: Path, text: str, block: int) -> None:
    make_sr(tmp_path / "x.sr", SAMPLES, samplerate="24 MHz")
    wanted = read_sr(tmp_path / "x.sr").whole()
    recording = read_csv(make_csv(tmp_path / "x.csv", text + "\n"), _block=block).whole()
    assert_same(recording, wanted)
    assert_same(recording.place(48 * MEGAHERTZ), wanted.place(48 * MEGAHERTZ))


def test_rows_without_times_are_samples(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", SAMPLES)
    make_csv(tmp_path / "x.csv", "\n".join(["A,B", *ROWS]))
    assert_same(read_capture(tmp_path / "x.csv", samplerate_hz=1e6), read_capture(tmp_path / "x.sr"))


@pytest.mark.parametrize("time", ["when", "WHEN", "1", 1])
def test_column_of_the_times(tmp_path: Path, time: str | int) -> None:
    make_csv(tmp_path / "x.csv", "time,when [ms],left,right\n0,0,0,1\n1,1000,1,1\n1,2000,1,1\n")
    wanted = Recording(np.array([0.0, 1.0]), np.array([0, 1], np.uint8), np.array([1, 1], np.uint8), 2.0)
    for a, b in (("left", "right"), (1, 2), ("1", "right")):
        assert_same(read_capture(tmp_path / "x.csv", a, b, text=TextOptions(time)), wanted)


def test_examples_of_the_documentation(tmp_path: Path) -> None:
    page = docs.page("guides/captures.md").partition("## Logs of time and count")[0]
    examples = re.findall(r"```csv\n(.*?)```", page, re.DOTALL)
    assert len(examples) == 3
    for text in examples:
        time = "when" if "when" in text else None
        recording = read_capture(make_csv(tmp_path / "x.csv", text), text=TextOptions(time))
        np.testing.assert_allclose(recording.time, [0, 0.25e-3, 0.5e-3, 0.75e-3])
        assert (recording.a.tolist(), recording.b.tolist()) == ([0, 1, 1, 0], [0, 0, 1, 1])


# Writing


def test_equal_traces_give_equal_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whenever they are written; with the same zlib, which promises what its output unpacks to, not which bytes."""
    write_sr(tmp_path / "x.sr", random_trace(300, 30_000), 12_500_000, _chunk=10_000)
    now = time.time() + 4e6
    monkeypatch.setattr(time, "time", lambda: now)
    write_sr(tmp_path / "y.sr", random_trace(300, 30_000), 12_500_000, _chunk=10_000)
    assert (tmp_path / "x.sr").read_bytes() == (tmp_path / "y.sr").read_bytes()


def test_session_is_a_plain_zip(tmp_path: Path) -> None:
    trace = random_trace(300, 5000)
    write_sr(tmp_path / "x.sr", trace, 12_500_000, _chunk=2048)
    with zipfile.ZipFile(tmp_path / "x.sr") as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["version", "metadata", "logic-1-1", "logic-1-2", "logic-1-3"]
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {(info.create_system, info.external_attr) for info in archive.infolist()} == {(3, 0o600 << 16)}
        assert archive.read("version") == b"2"
        assert "samplerate=12500 kHz\n" in archive.read("metadata").decode()
        samples = np.frombuffer(b"".join(archive.read(f"logic-1-{n}") for n in (1, 2, 3)), np.uint8)
    row = np.searchsorted(trace.clock, np.arange(5000), "right") - 1
    np.testing.assert_array_equal(samples, trace.a[row] + 2 * trace.b[row])


@pytest.mark.parametrize(("n_clocks", "clock_hz", "message"), [(10, 0, "clock_hz"), (0, 10, "n_clocks")])
def test_wrong_trace(tmp_path: Path, n_clocks: int, clock_hz: int, message: str) -> None:
    trace = PinTrace(np.zeros(1, np.int64), np.zeros(1, np.uint8), np.zeros(1, np.uint8), n_clocks)
    with pytest.raises(ValueError, match=f"^{message} must be at least 1, not 0$"):
        write_sr(tmp_path / "x.sr", trace, clock_hz)
    assert os.listdir(tmp_path) == []


def test_nothing_is_left_of_a_failed_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trace = random_trace(300, 5000)
    write_sr(tmp_path / "x.sr", trace, 1000)
    write_csv(tmp_path / "x.csv", read_capture(tmp_path / "x.sr"))
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(zipfile.ZipFile, "writestr", full)
        with pytest.raises(CaptureError, match=r"^cannot write .*x\.sr: No space left on device$"):
            write_sr(tmp_path / "x.sr", trace, 1000)
    with monkeypatch.context() as patch:
        patch.setattr(zipfile.ZipFile, "writestr", stopped)
        with pytest.raises(KeyboardInterrupt):
            write_sr(tmp_path / "x.sr", trace, 1000)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(CaptureError, match=r"^cannot write .*x\.csv: No space left on device$"):
            write_csv(tmp_path / "x.csv", read_capture(tmp_path / "x.sr"))
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    with pytest.raises(CaptureError, match=r"^cannot write .*x\.sr: No such file or directory$"):
        write_sr(tmp_path / "nowhere" / "x.sr", trace, 1000)


def test_long_capture_takes_little_time_and_memory(tmp_path: Path) -> None:
    n_clocks = 50_000_000
    trace = random_trace(1000, n_clocks)
    start = time.process_time()
    write_sr(tmp_path / "x.sr", trace, 50 * MEGAHERTZ)
    assert (tmp_path / "x.sr").stat().st_size < n_clocks / 150
    recording = read_capture(tmp_path / "x.sr")
    assert time.process_time() - start < 10  # seconds of the processor; measured: below 1
    assert_same(recording.place(50 * MEGAHERTZ), trace)
    tracemalloc.start()
    try:
        write_sr(tmp_path / "x.sr", trace, 50 * MEGAHERTZ)
        read_capture(tmp_path / "x.sr")
        assert tracemalloc.get_traced_memory()[1] < n_clocks  # not even a byte a sample
    finally:
        tracemalloc.stop()


def test_large_single_member_is_read_in_pieces(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", bytes(60_000_000))
    tracemalloc.start()
    try:
        assert read_capture(tmp_path / "x.sr").duration == pytest.approx(60)
        assert tracemalloc.get_traced_memory()[1] < 40_000_000
    finally:
        tracemalloc.stop()
