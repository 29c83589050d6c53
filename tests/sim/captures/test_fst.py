"""Compressed waveforms tell what the plain ones of the same simulation do."""

import importlib.util
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.captures import assert_same

from tachometry.sim.captures import file, fst, waveform
from tachometry.sim.captures.file import CaptureError
from tachometry.sim.captures.fst_child import pieces
from tachometry.sim.captures.read import read_capture
from tachometry.sim.signals import temporary

BENCH = """\
`timescale 1 ns / 1 ps
module tb;
  reg a, b;
  reg [1:0] enc;
  real speed = 0.5;
  event never;
  integer k;
  initial begin
    if ($test$plusargs("plain")) $dumpfile("w.vcd"); else $dumpfile("w.fst");
    $dumpvars(0, tb);
    #5 a = 0; b = 0; enc = 0;
    for (k = 0; k < 40; k = k + 1) begin
      #250 if (k % 2) b = !b; else a = !a;
      enc = {b, a};
      if (k % 10 == 9) $dumpflush;
    end
    #100 a = 1'bx;
    #100 a = 0;
    enc = 2'bzz;
    #1000 $finish;
  end
endmodule
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fst")
    (folder / "tb.v").write_text(BENCH)
    for command in ("iverilog -o tb tb.v", "vvp tb -fst", "vvp tb +plain"):
        subprocess.run(command.split(), cwd=folder, check=True, capture_output=True)
    return folder


@pytest.mark.parametrize(("a", "b"), [(None, None), ("tb.enc[0]", "enc[1]"), ("b", "0")])
def test_it_is_read_as_the_plain_one(a: str | None, b: str | None, folder: Path) -> None:
    plain, compressed = (read_capture(folder / f"w.{suffix}", a, b) for suffix in ("vcd", "fst"))
    assert len(plain.time) == 41
    assert plain.duration == pytest.approx(11.2e-6)
    assert_same(compressed, plain)
    assert plain.source is not None
    assert compressed.source is not None
    assert compressed.source.lines == plain.source.lines
    assert set(compressed.source.notes) - set(plain.source.notes) == (
        {"bit 0 of tb.enc is its last one"} if a == "tb.enc[0]" else set()
    )


def test_a_block_is_read_at_a_time(folder: Path, tmp_path: Path) -> None:
    """The reader takes some 20 bytes for each change of a file, and a simulator begins a new block after many."""
    sizes = [piece.stat().st_size for piece in pieces(folder / "w.fst", tmp_path)]
    assert len(sizes) == 5  # four are flushed
    assert max(sizes) < (folder / "w.fst").stat().st_size - 4 * 100


@pytest.mark.parametrize(
    ("start", "end", "instead"),
    [
        pytest.param(0, 1, b"$", id="another type"),
        pytest.param(8, 9, b"\0", id="another length"),
        pytest.param(400, 420, b"", id="a piece is missing"),
        pytest.param(-40, None, b"", id="the end is missing"),
        pytest.param(10, None, b"", id="all is missing"),
    ],
)
def test_damage_is_refused(
    start: int, end: int | None, instead: bytes, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    data, path = (folder / "w.fst").read_bytes(), folder / "damaged.fst"
    path.write_bytes(data[:start] + instead + (b"" if end is None else data[end:]))
    with pytest.raises(CaptureError, match=rf"^{re.escape(str(path))} must be a whole FST file, but is cut or damaged"):
        read_capture(path)
    assert capfd.readouterr() == ("", "")


def test_the_extra_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(CaptureError, match=r"the extra `fst` must be installed: pip install 'tachometry\[fst\]'; or "):
        read_capture(folder / "w.fst")
    with pytest.raises(CaptureError, match=r"^samplerate must not be given for .*w\.fst: a waveform has its times$"):
        read_capture(folder / "w.fst", samplerate_hz=1e6)


def test_a_plain_waveform_of_this_name_is_refused(folder: Path) -> None:
    (folder / "plain.fst").write_bytes((folder / "w.vcd").read_bytes())
    with pytest.raises(CaptureError, match=r"plain\.fst must be a whole FST file, but is cut or damaged$"):
        read_capture(folder / "plain.fst")


@pytest.mark.parametrize(
    ("limit", "most", "said"),
    [("_MOST_NAMES", 10, "10 characters for its names"), ("_MOST_CHANGE", 5, "5 characters for a change")],
)
def test_a_file_beyond_a_limit_is_refused(
    limit: str, most: int, said: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fst, limit, most)
    with pytest.raises(CaptureError, match=rf"w\.fst needs more than {said}: dump only the lines of the encoder, or "):
        read_capture(folder / "w.fst")


@pytest.mark.parametrize(
    ("work", "said"),
    [("sys.stdin.read(); bytearray(1 << 32)", f"{2 << 30} bytes of memory"), ("all(iter(object, 1))", "1 s")],
)
def test_a_reader_that_takes_too_much_is_ended(
    work: str, said: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    greedy = [sys.executable, "-c", f"import sys; {work}"]
    monkeypatch.setattr(fst, "_LONGEST", 1)
    monkeypatch.setattr(fst, "_CHILD", greedy)
    with pytest.raises(CaptureError, match=rf"w\.fst needs more than {said}: dump only "):
        read_capture(folder / "w.fst")


ENDLESS = """\
import itertools, sys
sys.stdin.read()
if len(sys.argv) < 6:
    sys.exit(print('{"unit": [1, -9], "variables": [["a", 1], ["b", 1]]}'))
for k in itertools.count():
    print(k, k & 1, k >> 1 & 1)
"""


def test_changes_are_taken_as_they_come(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From a reader that would never end, which ends with those who take them, or with their refusal."""
    monkeypatch.setattr(fst, "_CHILD", [sys.executable, "-c", ENDLESS])
    monkeypatch.setattr(waveform, "ROWS", 16)
    flow = fst.read_fst(folder / "w.fst")
    assert len(next(flow.parts).time) == 16
    (child,) = temporary._running
    flow.parts.close()
    assert child.returncode == -signal.SIGKILL
    monkeypatch.setattr(file, "MAX_EDGES", 40)
    with pytest.raises(CaptureError, match=r"w\.fst must have at most 40 changes of the lines, and has more$"):
        read_capture(folder / "w.fst")
    assert not temporary._running


def test_a_missing_file_is_named(folder: Path) -> None:
    with pytest.raises(CaptureError, match=r"none\.fst does not exist$"):
        read_capture(folder / "none.fst")
