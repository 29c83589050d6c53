"""Every file that a command writes may be the one that does not fit on the disk."""

import os
from pathlib import Path

import pytest
from support.command import run
from support.nightly import only_rows

from tachometry.cli.files import Outputs

CORE = "--ppr 9 --clock 1MHz --tick 100us --max-time 1ms"
MOTION = "--motion constant:3000rpm:1ms"
LOOP = f"loop {CORE} --motion constant:3000rpm:80ms --from 40ms --seeds 1"
RUN = f"{CORE} --engine pysim --trace t.csv --counts n.csv --events e.csv --plot p.png --vcd v.vcd"
KIT = f"generate {CORE} -o out --bus spi --testbench cocotb --for"
COMMANDS = {
    f"simulate {RUN} {MOTION} --save-capture s.sr": "t.csv n.csv e.csv p.png v.vcd v.gtkw s.sr",
    f"replay in.csv {RUN}": "t.csv n.csv e.csv p.png v.vcd v.gtkw",
    f"compare {CORE} {MOTION} --methods s,m --csv c.csv --plot p.pdf --tradeoff t.csv": "c.csv p.pdf t.csv",
    f"plan {CORE} --csv c.csv --plot p.png": "c.csv p.png",
    f"plan {CORE} --methods s,m --csv c.csv --plot p.pdf": "c.csv p.pdf",
    f"{LOOP} --csv c.csv --log l.csv --plot p.png": "c.csv l.csv p.png",
    f"{KIT} none": "out/tachometer.v out/tachometer.json out/test_tachometer.py out/tachometer_driver.h",
    f"generate {CORE} -o out --for litex": "out/tachometer_litex.py",
    "build arty-a7-35 --ppr 9 -o out": "out/tachometer.zip out/tachometer.json out/tachometer.v",
}
CASES = [(line, file) for line, files in COMMANDS.items() for file in files.split()]
# One of every kind of writer: a table, a waveform, a capture, a figure, a text.
SHORT = [case for case in CASES if case[0].startswith(f"plan {CORE} --methods")]
SHORT += [case for case in CASES if case[0].startswith("replay") and case[1] in ("t.csv", "v.vcd")]
SHORT += [case for case in CASES if case[1] in ("s.sr", "out/tachometer.v") and "build" not in case[0]]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
@pytest.mark.parametrize(("line", "full"), only_rows(SHORT, CASES))
def test_all_files_stay_as_they_were(
    line: str, full: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    (tmp_path / "in.csv").write_text("time,a,b\n0,0,0\n0.0005,1,0\n0.001,1,1\n0.002,0,1\n")
    before = {"out": None, "in.csv": (tmp_path / "in.csv").read_text()}
    for file in COMMANDS[line].split():
        (tmp_path / file).write_text("before")
        before[file] = "before"
    real = Outputs._stage

    def stage(outputs: Outputs) -> None:
        real(outputs)
        for what, target in outputs._targets.items():
            if target == tmp_path / full and not (place := outputs[what]).is_symlink():
                place.symlink_to("/dev/full")
                place.with_name(f".{place.name}.{os.getpid()}.part").symlink_to("/dev/full")  # as captures are written

    monkeypatch.setattr(Outputs, "_stage", stage)
    assert run(*line.split()) == 2
    told = capsys.readouterr()
    full = full.replace(".gtkw", ".vcd")  # whose companion it is
    assert told.err == f"tachometry: error: cannot write {tmp_path / full}: No space left on device\n"
    assert told.out == ""
    assert {str(p.relative_to(tmp_path)): p.read_text() if p.is_file() else None for p in tmp_path.rglob("*")} == before
