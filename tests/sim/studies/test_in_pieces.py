"""A run in pieces of some ticks writes and prints what the whole does, to the last byte."""

from pathlib import Path

import pytest
from support.nightly import only

from tachometry.cli.main import main
from tachometry.sim.captures import text as captured
from tachometry.sim.captures.read import read_capture
from tachometry.sim.captures.text import write_csv
from tachometry.sim.encoder import crossings
from tachometry.sim.studies import simulation

CORE = "--ppr 500 --clock 1MHz --tick"
METHODS = {
    "m": f"{CORE} 100us",
    "s": f"{CORE} 100us --max-time 2ms --filter 3us --unit rpm",
    "t": f"{CORE} 100us --max-time 2ms --decoding 1",
    "mt": f"{CORE} 100us --max-time 2ms --bounds",
    "track": f"{CORE} 300us --max-time 3ms",
    "s --index --invert z": f"{CORE} 100us --max-time 2ms",
    "m --index": f"{CORE} 100us --index-at edge --index-reset --position-modulo rev/7 --preset 9 --pulse preset:20ms",
    "t --index --index-once": f"{CORE} 100us --max-time 2ms --pulse home:1ms,25ms",
}
MOTION = "--jitter 0.1 --motion ramp:0:90rad/s:20ms+stop:9ms+constant:-40rad/s:9.99ms"


def outputs(words: str, folder: Path, capsys: pytest.CaptureFixture[str], *more: str) -> dict[str, bytes]:
    """Return what a command prints and writes."""
    folder.mkdir(exist_ok=True)
    tables = [f"--{name}={folder / name}.csv" for name in ("trace", "counts", "events")]
    with pytest.raises(SystemExit, match=r"^0$"):
        main([*words.split(), *tables, *more])
    return {path.name: path.read_bytes() for path in folder.glob("*.csv")} | {"out": capsys.readouterr().out.encode()}


@pytest.mark.parametrize("method", only(["s", "t", "m --index"], METHODS))
def test_pieces_are_the_whole(
    method: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    core, saved, text = f"--method {method} {METHODS[method]} --engine cxxrtl", tmp_path / "x.sr", tmp_path / "x.csv"
    for words in (f"simulate {core} {MOTION} --illegal 0.01", f"simulate {core} {MOTION}", f"replay {text} {core}"):
        whole = outputs(words, tmp_path / "whole", capsys, f"--save-capture={saved}")
        write_csv(text, read_capture(saved, z="z" if "index" in core else None))
        with monkeypatch.context() as patch:
            patch.setattr(simulation, "PIECE", 7)
            patch.setattr(crossings, "_CHUNK", 101)
            patch.setattr(captured, "BLOCK", 5)
            assert outputs(words, tmp_path / "pieces", capsys) == whole
    assert b"PASS" in whole["out"]
    assert len(whole["trace.csv"]) > 1000
