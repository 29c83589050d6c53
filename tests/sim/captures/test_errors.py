"""Captures that are wrong are refused in a line."""

import gzip
import json
import re
import zipfile
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from support.captures import assert_error, make_csv, make_sr, random_trace
from support.damage import damaged

from tachometry.sim.captures.file import CaptureError, OptionError
from tachometry.sim.captures.header import TextOptions
from tachometry.sim.captures.read import read_capture
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.captures.text import read_csv

# What is in a file, and what must be said of it.
REFUSED = json.loads(Path(__file__).with_name("refused.json").read_text(encoding="utf-8"))


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


def test_a_session_that_ends_early_is_told_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make_sr(tmp_path / "x.sr", [bytes(4)])
    monkeypatch.setattr(zipfile.ZipExtFile, "read", Mock(side_effect=EOFError))
    assert_error(path, "PATH must be a whole sigrok session (a zip file), but is cut or damaged: it ends early")


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


def test_csv_header_of_a_binary_file(tmp_path: Path) -> None:
    make_csv(tmp_path / "x.csv", bytes(1000))
    with pytest.raises(CaptureError, match=r"^header of [^\n]+\.\.\.'$"):
        read_capture(tmp_path / "x.csv")


@pytest.mark.parametrize(("change", "message"), REFUSED["sessions"])
def test_wrong_session(tmp_path: Path, change: dict[str, str | None], message: str) -> None:
    make_sr(tmp_path / "x.sr", [bytes(4)], **change)  # type: ignore[arg-type]
    assert_error(tmp_path / "x.sr", message)


@pytest.mark.parametrize(("text", "options", "message"), REFUSED["texts"])
def test_wrong_text(tmp_path: Path, text: str, options: dict[str, str | float], message: str) -> None:
    make_csv(tmp_path / "x.csv", text)
    assert_error(tmp_path / "x.csv", message, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(("row", "message"), REFUSED["rows"])
@pytest.mark.parametrize("block", [1, 12, 1 << 22])
def test_wrong_row(tmp_path: Path, row: str, message: str, block: int) -> None:
    path = make_csv(tmp_path / "x.csv", f"time,a,b\n0,0,1\n0.5,1,1\n{row}\n3,1,1\n")
    assert_error(path, message)
    with pytest.raises(CaptureError, match=f"^{re.escape(message.replace('PATH', str(path)))}$"):
        read_csv(path, _block=block).whole()


@pytest.mark.parametrize("first", ["10", "00"])
def test_the_first_edges_show_whether_times_are_seconds(first: str, tmp_path: Path) -> None:
    """A shaft that rests after some edges is no mistake; before them there are none to ask."""
    rows = [
        f"{time},{level},0\n"
        for time, level in zip((0, 0.1, 0.2, 0.3, 7.5, 14.5, 21.5, 28.5), 2 * first + "0101", strict=True)
    ]
    flow = read_csv(
        make_csv(tmp_path / "x.csv", f"time,a,b\n{''.join(rows)}"), options=TextOptions(slowest_s=1.0), _block=4
    )
    if first == "10":
        assert flow.whole().n_changes == 6
    else:
        with pytest.raises(OptionError, match=r"its edges would be 7 s apart"):
            flow.whole()
