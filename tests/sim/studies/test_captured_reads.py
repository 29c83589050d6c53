"""Captures of the lines of absolute encoders."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.command import run

from tachometry.sim.encoder.absolute import Answers, answer
from tachometry.spec import of_texts
from tachometry.spec.core.chips import SpiReads
from tachometry.spec.core.reads import Reads
from tachometry.spec.core.tformat import REQUEST, TformatReads

CORE = {"clock": "50MHz", "tick": "200us", "max-time": "20ms"}
KINDS = {
    "biss": {"sensor": "biss", "bits": "4+13", "encoder-clock": "2MHz"},
    "ssi": {"sensor": "ssi", "bits": "4+13", "encoder-clock": "1MHz", "line-delay": "700ns"},
    "spi": {"sensor": "spi", "chip": "as5047p", "bits": "14"},
    "amt22": {"sensor": "spi", "chip": "amt22", "bits": "12", "line-delay": "400ns"},
    "tformat": {"sensor": "tformat", "bits": "4+17", "line-delay": "100ns"},
}
KINDS["ssi"] |= {"gray": "yes", "reverse": "yes"}
BITS = {kind: [int(bits) for bits in texts["bits"].split("+")] for kind, texts in KINDS.items()}
SPEED, N = 40.0, 120  # rad/s, frames


def changes(reads: Reads) -> NDArray[np.int64]:
    """Return when line A changes, from the begin of a read on."""
    if isinstance(reads, SpiReads):
        rises = np.array(reads.changes) + reads.half * (not reads.facts.falling)
        return np.sort(np.append(rises, rises + reads.half))
    if isinstance(reads, TformatReads):
        request = np.array([1, 0, *(REQUEST >> bit & 1 for bit in range(8)), 1])
        return 1 + reads.bit * np.flatnonzero(np.diff(request))
    return 1 + reads.half * np.arange(2 * (reads.sent_bits + (2 if reads.biss else 1)))


def capture(kind: str, folder: Path) -> list[str]:
    """Write a capture of another master, whose clock is no part of the core's; return the options of the command."""
    texts, (*_, bits) = KINDS[kind], BITS[kind]
    words = [word for name, text in texts.items() for word in ([f"--{name}"] if text == "yes" else [f"--{name}", text])]
    reads = of_texts("track", {**CORE, **texts}).reads
    assert reads is not None
    start = 9000 * np.arange(N) + 100 + np.random.default_rng(N).integers(0, 3000, N)
    taken = np.append(0, start[:-1] + reads.longest) if reads.late else start + reads.taken
    place = np.floor(taken / reads.clock_hz * SPEED / (2 * np.pi) * (1 << bits)).astype(np.int64) - 4000
    flip = np.where((np.arange(N) % 20 == 7) & (kind != "ssi"), 5, -1)
    at, level = answer(reads, start, Answers(place & (1 << reads.width) - 1, reads.delay, flip=flip))
    edges = np.unique(start[:, None] + changes(reads))
    edges = np.delete(edges, slice(1000, 1002 if kind == "spi" else 1000))  # a frame lacks a clock
    every = np.unique(np.concatenate([[0], at, edges]))
    clock = np.isin(every, edges).cumsum() + (not isinstance(reads, SpiReads)) & 1
    data = level[np.searchsorted(at, every, side="right") - 1]
    seconds = every * 1.013 / reads.clock_hz
    rows = (f"{time:.10f},{slo},{ma},0" for time, slo, ma in zip(seconds, data, clock, strict=True))
    (folder / "c.csv").write_text("\n".join(["time,SLO,MA,x", *rows, ""]))
    core = [word for name, text in CORE.items() for word in (f"--{name}", text)]
    return [str(folder / "c.csv"), *words, *core, "--method", "m"]


@pytest.mark.parametrize("kind", KINDS)
def test_frames_of_another_master_are_replayed(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("replay", *capture(kind, tmp_path), "--a", "MA", "--b", "SLO", "--counts", tmp_path / "t.csv") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "from MA, " in told
    assert f"{N} frames; between two the shaft is taken to turn evenly" in told
    wrong = {"ssi": "", "spi": "8 frames not taken: no answer 2, a wrong check 6"}
    assert wrong.get(kind, "6 frames not taken: a wrong check 6") in told
    position = np.genfromtxt(tmp_path / "t.csv", delimiter=",", names=True)["position"][1:]
    way, slope = (-1 if "reverse" in KINDS[kind] else 1), SPEED / 1.013 * 200e-6 / (2 * np.pi) * (1 << BITS[kind][-1])
    assert position[0] == pytest.approx(-4000 * way % (1 << sum(BITS[kind])), abs=4 * slope)
    off = position[9:] - way * slope * np.arange(9, len(position))
    assert np.ptp(off) < 2 + slope / 40


def test_what_is_no_frame_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = capture("biss", tmp_path)
    other = [word.replace("4+13", "4+14") for word in words]
    for line, more, why in (
        (words, ["--b", "x"], "two right frames, with --bits and --crc as they are: no answer 120"),
        (other, ["--b", "SLO"], "a wrong check 1"),
        (words, ["--b", "MA", "--a", "x"], "line A must be the encoder's clock"),
    ):
        assert run("replay", *line, *more, *(() if "--a" in more else ("--a", "MA"))) == 2
        assert why in capsys.readouterr().err
    read = ["--sensor", "tformat", "--bits", "17", "--clock", "20MHz", "--tick", "200us"]
    assert run("replay", *[words[0], *read, "--a", "x", "--b", "MA"]) == 2
    assert "line A must be the request" in capsys.readouterr().err


def test_a_capture_of_positions_that_are_read_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their lines are not A and B: it would have two lines that rest."""
    read = ["--sensor", "biss", "--bits", "17", "--clock", "20MHz", "--tick", "200us", "--motion", "stop:1ms"]
    assert run("simulate", *read, "--save-capture", str(tmp_path / "x.sr")) == 2
    assert "--save-capture must not be given with positions that are read" in capsys.readouterr().err
