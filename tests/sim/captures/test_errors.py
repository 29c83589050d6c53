"""Captures that are wrong are refused in a line."""

import gzip
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from support.captures import assert_error, make_csv, make_sr, random_trace
from support.damage import damaged

from tachometry.sim.captures.file import CaptureError
from tachometry.sim.captures.read import read_capture
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.captures.text import read_csv


@pytest.mark.parametrize("name", ["x.doc", "x", "x.sr.gz"])
def test_suffix(tmp_path: Path, name: str) -> None:
    assert_error(
        tmp_path / name, "a capture must be a .sr, .vcd, .fst, .csv, .txt, .tsv or .teeth file, or .csv.gz, not PATH"
    )


@pytest.mark.parametrize("name", ["x.sr", "x.csv", "X.SR"])
def test_missing_or_unreadable_file(tmp_path: Path, name: str) -> None:
    assert_error(tmp_path / name, "PATH does not exist")
    (tmp_path / name).mkdir()
    with pytest.raises(CaptureError, match=f"^cannot read .*{re.escape(name)}: [^\n]+$"):
        read_capture(tmp_path / name)


def test_cut_compressed_text(tmp_path: Path) -> None:
    content = gzip.compress(b"time,a,b\n0,0,0\n1,1,0\n")
    (tmp_path / "x.csv.gz").write_bytes(content)
    assert read_capture(tmp_path / "x.csv.gz").a.tolist() == [0, 1]
    (tmp_path / "x.csv.gz").write_bytes(content[:-9])
    assert_error(
        tmp_path / "x.csv.gz", "cannot read PATH: Compressed file ended before the end-of-stream marker was reached"
    )


def test_text_that_is_not_compressed(tmp_path: Path) -> None:
    (tmp_path / "x.csv.gz").write_text("time,a,b\n0,0,0\n")
    assert_error(tmp_path / "x.csv.gz", "cannot read PATH: Not a gzipped file (b'ti')")


@pytest.mark.parametrize("keep", [0, 1, 100, -1, -22])
def test_cut_session(tmp_path: Path, keep: int) -> None:
    make_sr(tmp_path / "x.sr", [bytes(1000)])
    data = (tmp_path / "x.sr").read_bytes()
    (tmp_path / "x.sr").write_bytes(data[:keep])
    wanted = "PATH must be a whole sigrok session (a zip file), but is cut or damaged: File is not a zip file"
    assert_error(tmp_path / "x.sr", wanted)


def test_damaged_samples(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [])
    with zipfile.ZipFile(tmp_path / "x.sr", "a", zipfile.ZIP_STORED) as archive:
        archive.writestr("logic-1-1", bytes(100) + b"HERE")
    data = (tmp_path / "x.sr").read_bytes()
    (tmp_path / "x.sr").write_bytes(data.replace(b"HERE", b"THER"))
    assert_error(
        tmp_path / "x.sr",
        "PATH must be a whole sigrok session (a zip file), but is cut or damaged: Bad CRC-32 for file 'logic-1-1'",
    )


def test_any_damage_is_a_capture_error(tmp_path: Path) -> None:
    good = tmp_path / "x.sr"
    write_sr(good, random_trace(20, 500), 1000)
    data = np.frombuffer(good.read_bytes(), np.uint8)
    rng = np.random.default_rng(8)
    messages = []
    flipped = [data.copy() for _ in data]
    for position, bad in enumerate(flipped):
        bad[position] ^= rng.integers(1, 256)
    for content in (*(bad.tobytes() for bad in flipped), *damaged(data.tobytes(), "sr", 100)):
        (tmp_path / "y.sr").write_bytes(content)
        try:
            read_capture(tmp_path / "y.sr")
        except CaptureError as error:
            messages.append(str(error))
    assert not any("\n" in message for message in messages)
    assert len(messages) > len(data) // 2  # the rest is what does not matter: dates, attributes, the like


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": None}, "PATH must be a sigrok session, but has no member 'version'"),
        ({"version": "3"}, "version of sigrok session PATH must be 1 or 2, not '3'"),
        ({"version": "a\nb"}, "version of sigrok session PATH must be 1 or 2, not 'a\\nb'"),
        ({"capturefile": None}, "PATH must have logic samples, but its metadata names no capturefile"),
        ({"capturefile": "logic-3"}, "PATH must have logic samples, but has no member logic-3 or logic-3-1"),
        ({"unitsize": None}, "unitsize of PATH must be 1 to 8 bytes, not none"),
        ({"unitsize": "0"}, "unitsize of PATH must be 1 to 8 bytes, not 0"),
        ({"unitsize": "9"}, "unitsize of PATH must be 1 to 8 bytes, not 9"),
        ({"unitsize": "3"}, "length of logic-1-1 in PATH must be a multiple of unitsize 3, not 4 bytes"),
        ({"probe9": "X"}, "probes of PATH must be 1 to 8 (unitsize 1), not 9"),
        ({"probe0": "X"}, "probes of PATH must be 1 to 8 (unitsize 1), not 0"),
        ({"probe1": None}, "PATH must have at least two logic channels, not B (1)"),
        ({"probe1": None, "probe2": None}, "PATH must have at least two logic channels, not none"),
        ({"samplerate": "fast"}, "samplerate of PATH must be a number and Hz, kHz, MHz or GHz, not 'fast'"),
        ({"samplerate": "-1 Hz"}, "samplerate of PATH must be a number and Hz, kHz, MHz or GHz, not '-1 Hz'"),
        (
            {"samplerate": "1 MHz\nsamplerate=1 MHz"},
            "metadata of PATH must be an INI text: line 8 must not be 'samplerate=1 MHz'",
        ),
    ],
)
def test_wrong_session(tmp_path: Path, change: dict[str, str | None], message: str) -> None:
    make_sr(tmp_path / "x.sr", [bytes(4)], **change)  # type: ignore[arg-type]
    assert_error(tmp_path / "x.sr", message)


def test_zip_without_metadata(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "x.sr", "w") as archive:
        archive.writestr("version", "2")
    assert_error(tmp_path / "x.sr", "PATH must be a sigrok session, but has no member 'metadata'")


@pytest.mark.parametrize("text", [b"\xff[device 1]\n", b"capturefile=x\n", b"[device 1]\nno value\n"])
def test_metadata_that_is_no_ini(tmp_path: Path, text: bytes) -> None:
    with zipfile.ZipFile(tmp_path / "x.sr", "w") as archive:
        archive.writestr("version", "2")
        archive.writestr("metadata", text)
    with pytest.raises(CaptureError, match=r"^metadata of .*x\.sr must be an INI text: [^\n]+$"):
        read_capture(tmp_path / "x.sr")


def test_missing_chunk(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [bytes(4)])
    with zipfile.ZipFile(tmp_path / "x.sr", "a") as archive:
        archive.writestr("logic-1-3", bytes(4))
    assert_error(tmp_path / "x.sr", "2 chunks of PATH must be logic-1-1 to logic-1-2, but logic-1-2 is missing")


def test_two_members_of_one_chunk(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [bytes(4)])
    with zipfile.ZipFile(tmp_path / "x.sr", "a") as archive:
        archive.writestr("logic-1-01", bytes(4))
    assert_error(tmp_path / "x.sr", "chunks of PATH must be members with a number each, but two of logic-1 share one")


def test_other_compression(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [])
    with zipfile.ZipFile(tmp_path / "x.sr", "a", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("logic-1-1", bytes(4))
    assert_error(tmp_path / "x.sr", "logic-1-1 of PATH must be stored or deflated, not method 12")


@pytest.mark.parametrize("chunks", [b"", [b""]])
def test_session_without_samples(tmp_path: Path, chunks: list[bytes] | bytes) -> None:
    make_sr(tmp_path / "x.sr", chunks)
    assert_error(tmp_path / "x.sr", "PATH must have at least one sample, not 0")


def test_samplerate_option(tmp_path: Path) -> None:
    make_sr(tmp_path / "x.sr", [bytes(4)])
    wanted = "samplerate of PATH must be 1000000 Hz as the file has it, not 2000000 Hz"
    assert_error(tmp_path / "x.sr", wanted, samplerate_hz=2e6)
    for wrong in (0.0, -1.0, float("nan"), float("inf")):
        assert_error(
            tmp_path / "x.sr", f"samplerate must be above 0 Hz and finite, not {wrong} Hz", samplerate_hz=wrong
        )
    make_csv(tmp_path / "x.csv", "time,a,b\n0,0,0\n")
    wanted = "samplerate must not be given for PATH: its rows have their times"
    assert_error(tmp_path / "x.csv", wanted, samplerate_hz=1e6)


@pytest.mark.parametrize("name", ["x.sr", "x.csv"])
def test_wrong_channels(tmp_path: Path, name: str) -> None:
    make_sr(tmp_path / "x.sr", [bytes(4)], {1: "A", 2: "B", 3: "Z"})
    make_csv(tmp_path / "x.csv", "time,A,B,Z\n0,0,0,0\n")
    path = tmp_path / name
    assert_error(path, "channel a of PATH must be one of A (0), B (1), Z (2), not 'C'", a="C")
    assert_error(path, "channel b of PATH must be one of A (0), B (1), Z (2), not '3'", b="3")
    assert_error(path, "channel b of PATH must be one of A (0), B (1), Z (2), not -1", b=-1)
    assert_error(path, "channel a of PATH must be one of A (0), B (1), Z (2), not 'time'", a="time")
    assert_error(path, "channels a and b of PATH must be two of A (0), B (1), Z (2), not both Z", a="z", b="2")
    assert_error(path, "channels a and b of PATH must be two of A (0), B (1), Z (2), not both B", a="B")


@pytest.mark.parametrize("header", ["time,a", "time;a"])
def test_csv_with_one_channel(tmp_path: Path, header: str) -> None:
    make_csv(tmp_path / "x.csv", f"{header}\n0,0\n")
    assert_error(
        tmp_path / "x.csv",
        "PATH must have at least two logic channels, not a (0); lines in one number are --a a[0] --b a[1]",
    )


@pytest.mark.parametrize("header", ["a", "time,a,a", "a,,b", "y,0,1", "a b c"])
def test_csv_header(tmp_path: Path, header: str) -> None:
    make_csv(tmp_path / "x.csv", f"{header}\n0,0,1\n")
    wanted = "must name the columns, as time,a,b does: one channel at least, each name once"
    assert_error(tmp_path / "x.csv", f"header of PATH {wanted}, not {header!r}")


@pytest.mark.parametrize("first", ["", "0,0,1", "0,1,2"])
def test_csv_without_names(tmp_path: Path, first: str) -> None:
    make_csv(tmp_path / "x.csv", f"{first}\n0,0,1\n")
    how = "put one such as time,a,b before its rows, or give its columns by number, as --time 0 --a 1 --b 2"
    assert_error(tmp_path / "x.csv", f"PATH has no line of names: {how}")


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (
            "a,b,c\n0,0,1\n",
            {},
            "header of PATH must have a column named time, or --time or --samplerate must be given, not 'a,b,c'",
        ),
        ("a,b,c\n0,0,1\n", {"time": "d"}, "time of PATH must be one of the columns a (0), b (1), c (2), not 'd'"),
        ("a,b,c\n0,0,1\n", {"time": "3"}, "time of PATH must be one of the columns a (0), b (1), c (2), not '3'"),
        (
            "a,b\n0,0\n",
            {"time": "a"},
            "PATH must have at least two logic channels, not b (0); lines in one number are --a b[0] --b b[1]",
        ),
        (
            "Time [samples],a,b\n0,0,1\n",
            {},
            "time_unit must be given for PATH: the rate of Time [samples], such as 16MHz",
        ),
        ("Time [us],a,b\n2,0,1\n1,0,1\n", {}, "PATH line 3: time must be at least 2.0 us as before, not 1.0 us"),
        (
            "us,a,b\n29750,0,1\n30000,0,1\n0,0,1\n",
            {},
            "PATH line 4: time must be at least 30000.0 us as before, not 0.0 us",
        ),
        ("Time [us],a,b\ninf,0,1\n", {}, "PATH line 2: Time [us] must be a number, not 'inf'"),
        ("#\n;\ntime,a,b\n#,\n0,0,1\n;x\n\n1,0\n", {}, "PATH line 8: a row must have 3 fields (time,a,b), not 2"),
        (
            "#\n;\ntime,a,b\n#,\n0,0,1\n;x\n1,0,2\n",
            {},
            "PATH line 7: level of b must be 0 or 1, not '2' (of both lines in one number, --a b[0] is the lowest bit)",
        ),
        ("#\n;\ntime,a,b\n#,\n0,0,1\n;x\n1,0,Y\n", {}, "PATH line 7: level of b must be 0 or 1, not 'Y'"),
        ("time,a,b\n#0,0,1\n", {}, "PATH must have at least one row after its header, not 0"),
        (
            "; Samplerate: fast\na,b\n0,0\n",
            {},
            "samplerate of PATH must be a number and Hz, kHz, MHz or GHz, not 'fast'",
        ),
        (
            "; Samplerate: 1 MHz\na,b\n0,0\n",
            {"samplerate_hz": 2e6},
            "samplerate of PATH must be 1000000 Hz as the file has it, not 2000000 Hz",
        ),
        (
            "a,b\n0,2\n",
            {"samplerate_hz": 2e6},
            "PATH line 2: level of b must be 0 or 1, not '2' (of both lines in one number, --a b[0] is the lowest bit)",
        ),
    ],
)
def test_csv_of_others(tmp_path: Path, text: str, options: dict[str, str | float], message: str) -> None:
    make_csv(tmp_path / "x.csv", text)
    assert_error(tmp_path / "x.csv", message, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["x.sr", "x.vcd"])
def test_time_is_of_csv_only(tmp_path: Path, name: str) -> None:
    make_sr(tmp_path / name, [bytes(4)])
    assert_error(tmp_path / name, "time must not be given for PATH: it has its times", time="A")


def test_csv_header_of_a_binary_file(tmp_path: Path) -> None:
    make_csv(tmp_path / "x.csv", bytes(1000))
    with pytest.raises(CaptureError, match=r"^header of [^\n]+\.\.\.'$"):
        read_capture(tmp_path / "x.csv")


@pytest.mark.parametrize("rows", ["", "\n\n", "\r\n"])
def test_csv_without_rows(tmp_path: Path, rows: str) -> None:
    make_csv(tmp_path / "x.csv", "time,a,b\n" + rows)
    assert_error(tmp_path / "x.csv", "PATH must have at least one row after its header, not 0")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("x,0,0", "PATH line 4: time must be a number, not 'x'"),
        (",0,0", "PATH line 4: time must be a number, not ''"),
        ("1_0,0,0", "PATH line 4: time must be a number, not '1_0'"),
        ("2,0,high", "PATH line 4: level of b must be 0 or 1, not 'high'"),
        ("2,,0", "PATH line 4: level of a must be 0 or 1, not ''"),
        ("nan,0,0", "PATH line 4: time must be a number, not 'nan'"),
        ("inf,0,0", "PATH line 4: time must be a number, not 'inf'"),
        (
            "2,2,0",
            "PATH line 4: level of a must be 0 or 1, not '2' (of both lines in one number, --a a[0] is the lowest bit)",
        ),
        ("2,0,-1", "PATH line 4: level of b must be 0 or 1, not '-1' VOLTAGE"),
        ("2,0,0.5", "PATH line 4: level of b must be 0 or 1, not '0.5' VOLTAGE"),
        (
            "2,0,01",
            "PATH line 4: level of b must be 0 or 1, not '01' "
            "(of both lines in one number, --a b[0] is the lowest bit)",
        ),
        ("2,0,8", "PATH line 4: level of b must be 0 or 1, not '8' (of a counter, --count b takes its counts)"),
        ("2,nan,0", "PATH line 4: level of a must be 0 or 1, not 'nan'"),
        ("0.1,0,0", "PATH line 4: time must be at least 0.5 s as before, not 0.1 s"),
        ("2", "PATH line 4: a row must have 3 fields (time,a,b), not 1"),
        ("2,0", "PATH line 4: a row must have 3 fields (time,a,b), not 2"),
        ("2,0,0,0", "PATH line 4: a row must have 3 fields (time,a,b), not 4"),
        ("2,0,0\r2,0,0", "lines of PATH must end in LF or CR LF, not CR"),
        ("2,0\r,0", "lines of PATH must end in LF or CR LF, not CR"),
    ],
)
@pytest.mark.parametrize("block", [1, 12, 1 << 22])
def test_csv_row(tmp_path: Path, row: str, message: str, block: int) -> None:
    message = message.replace("VOLTAGE", "(of a voltage, --threshold 1.65V says from where on it is high)")
    path = make_csv(tmp_path / "x.csv", f"time,a,b\n0,0,1\n0.5,1,1\n{row}\n3,1,1\n")
    assert_error(path, message)
    with pytest.raises(CaptureError, match=f"^{re.escape(message.replace('PATH', str(path)))}$"):
        read_csv(path, _block=block)


@pytest.mark.parametrize("text", ["time,a,b\r0,0,1\r1,1,1\r", "ti\rme,a,b\n0,0,1\n"])
def test_csv_with_cr_in_the_header(tmp_path: Path, text: str) -> None:
    make_csv(tmp_path / "x.csv", text)
    assert_error(tmp_path / "x.csv", "lines of PATH must end in LF or CR LF, not CR")


def test_csv_cut_in_its_last_line(tmp_path: Path) -> None:
    make_csv(tmp_path / "x.csv", "time,a,b\n0,0,1\n0.25,1")
    assert_error(tmp_path / "x.csv", "PATH line 3: a row must have 3 fields (time,a,b), not 2")
    make_csv(tmp_path / "x.csv", "time,a,b\n0,0,1\n0.25,1,")
    assert_error(tmp_path / "x.csv", "PATH line 3: level of b must be 0 or 1, not ''")
