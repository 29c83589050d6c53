"""Captures of the lines of absolute encoders."""

from pathlib import Path

import numpy as np
import pytest
from support.command import run

from tachometry.sim.encoder.absolute import Answers, answer
from tachometry.spec import of_texts

CORE = {"clock": "50MHz", "tick": "200us", "max-time": "20ms"}
KINDS = {
    "biss": {"bits": "4+13", "encoder-clock": "2MHz"},
    "ssi": {"bits": "4+13", "encoder-clock": "1MHz", "line-delay": "300ns", "gray": "yes"},
}
SPEED, N = 40.0, 120  # rad/s, frames


def capture(sensor: str, texts: dict[str, str], folder: Path, wrong: int = 5) -> list[str]:
    """Write a capture of another master, whose clock is no part of the core's; return the options of the command."""
    words = [word for name, text in texts.items() for word in ([f"--{name}"] if text == "yes" else [f"--{name}", text])]
    reads = of_texts("track", {"sensor": sensor, **CORE, **texts}).reads
    assert reads is not None
    start = 9000 * np.arange(N) + 100
    place = np.floor(start / reads.clock_hz * SPEED / (2 * np.pi) * (1 << 13)).astype(np.int64) - 40
    flip = np.where(np.arange(N) % 20 == 7, wrong, -1)
    sent = Answers(place & (1 << 17) - 1, reads.delay, flip=flip)
    at, level = answer(reads, start, sent)
    n_bits = reads.sent_bits + (2 if sensor == "biss" else 1)
    edges = start[:, None] + 1 + reads.half * np.arange(2 * n_bits)
    every = np.unique(np.concatenate([[0], at, edges.ravel()]))
    clock = 1 - np.isin(every, edges[:, ::2]).cumsum() + np.isin(every, edges[:, 1::2]).cumsum()
    data = level[np.searchsorted(at, every, side="right") - 1]
    seconds = every * 1.013 / reads.clock_hz
    rows = (f"{time:.10f},{slo},{ma},0" for time, slo, ma in zip(seconds, data, clock, strict=True))
    (folder / "c.csv").write_text("\n".join(["time,SLO,MA,x", *rows, ""]))
    core = [word for name, text in CORE.items() for word in (f"--{name}", text)]
    return [str(folder / "c.csv"), "--sensor", sensor, *words, *core, "--method", "m"]


@pytest.mark.parametrize("sensor", KINDS)
def test_frames_of_another_master_are_replayed(sensor: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = capture(sensor, KINDS[sensor], tmp_path)
    assert run("replay", *words, "--a", "MA", "--b", "SLO", "--counts", tmp_path / "t.csv") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "encoder_clock from MA, encoder_data from SLO" in told
    assert f"{N} frames; between two the shaft is taken to turn evenly" in told
    if sensor == "biss":
        assert "6 frames not taken: a wrong check 6" in told
    position = np.genfromtxt(tmp_path / "t.csv", delimiter=",", names=True)["position"]
    assert position[1] == pytest.approx((1 << 17) - 40, abs=30)
    turns = (position[-1] - position[9]) / (1 << 13)
    assert turns * 2 * np.pi / ((len(position) - 10) * 200e-6) == pytest.approx(SPEED / 1.013, rel=0.01)


def test_what_is_no_frame_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = capture("biss", KINDS["biss"], tmp_path)
    other = [word.replace("4+13", "4+14") for word in words]
    for line, more, why in (
        (words, ["--b", "x"], "two right frames, with --bits and --crc as they are: no answer 120"),
        (other, ["--b", "SLO"], "a wrong check 1"),
        (words, ["--b", "MA", "--a", "x"], "line A must be the encoder's clock"),
    ):
        assert run("replay", *line, *more, *(() if "--a" in more else ("--a", "MA"))) == 2
        assert why in capsys.readouterr().err
