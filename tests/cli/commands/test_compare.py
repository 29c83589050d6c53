"""`tachometry compare`."""

import csv
import re
from pathlib import Path

import pytest
from support import docs
from support.command import run
from support.nightly import nightly

from tachometry.cli.commands import compare as command
from tachometry.sim.studies import size as synthesis
from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES
from tachometry.spec import METHODS, TachometerSpec

CORE = "--ppr 100 --clock 1MHz --tick 1ms --max-time 20ms".split()
MOTION = ["--motion", "ramp:0:40rad/s:200ms+sine:30rad/s:10Hz:200ms"]


def test_all_methods_in_one_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--csv", tmp_path / "c.csv", "--plot", tmp_path / "c.png"]
    assert run("compare", *CORE, *MOTION, *files) == 0
    told = capsys.readouterr().out.splitlines()
    names = [line.split()[0] for line in told[1 : 1 + len(METHODS) + len(BASELINES)]]
    assert names == [*METHODS, *BASELINES]
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == names
    assert all(0 < float(row["rms_rad_s"]) < float(row["max_rad_s"]) for row in rows)
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")


def test_options_of_methods(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("compare", *CORE, *MOTION, "--methods", "s, s:cancel=no,m:average=10") == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()[1:4]]
    assert names == ["s", "s:cancel=no", "m:average=10"]


def test_a_capture_in_place_of_a_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Edges of a capture give the same updates, and no errors, for nobody knows the truth."""
    saved = [*"simulate --method s --motion ramp:0:40rad/s:200ms --save-capture".split(), tmp_path / "c.sr"]
    assert run(*saved, *CORE) == 0
    capsys.readouterr()
    names = ["--methods", "s,m,odrive"]
    for source in (["--motion", "ramp:0:40rad/s:200ms"], ["--replay", tmp_path / "c.sr", "--plot", tmp_path / "c.png"]):
        assert run("compare", *CORE, *names, *source, "--csv", tmp_path / "c.csv") == 0
    motion, replayed = (
        [line.split() for line in part.splitlines()[:3]] for part in capsys.readouterr().out.split("method ")[1:]
    )
    for known, unknown in zip(motion[1:], replayed[1:], strict=True):
        assert known[:4] == unknown[:4]
        assert unknown[4:] == ["-", "-", "-"]
    with (tmp_path / "c.csv").open() as file:
        assert [row["rms_rad_s"] for row in csv.DictReader(file)] == ["", "", ""]
    assert (tmp_path / "c.png").stat().st_size > 1000


@nightly
def test_the_guide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The other tests of this file run the same command on shorter captures."""
    (command,) = re.findall(r"^tachometry (compare --replay .*)", docs.page("guides/captures.md"), re.MULTILINE)
    (tmp_path / "tests").symlink_to(docs.DOCS.parent / "tests")
    monkeypatch.chdir(tmp_path)
    assert run(*command.split()) == 0
    told = capsys.readouterr().out
    assert [
        line.split()[0] for line in told.partition("method ")[2].splitlines()[1:7]
    ] == "s m t mt rairan track".split()
    assert (tmp_path / "build" / "wheel_methods.png").stat().st_size > 1000


def test_what_the_reader_says_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{k / 1000},{'0110'[k % 4] if k != 7 else 'X'},0,{k % 2}" for k in range(200)]
    (tmp_path / "c.csv").write_text("\n".join(["time,a,b,c", *rows, ""]))
    assert run("compare", *CORE, "--replay", tmp_path / "c.csv", "--methods", "s") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert (
        "lines a from a, b from b captured 0.199 s, 100 changes of the lines note 1 cell with an X: the level" in told
    )
    assert "WARNING: b never changes; c does: see --b" in told
    assert run("compare", *CORE, "--motion", "stop:100ms", "--methods", "s") == 0
    assert "captured" not in capsys.readouterr().out


def test_an_external_tick_is_nominal(capsys: pytest.CaptureFixture[str]) -> None:
    tables = []
    for options in ([], ["--external-tick"]):
        assert run("compare", *CORE, *MOTION, "--methods", "s,m", *options) == 0
        tables.append(capsys.readouterr().out)
    assert tables[0].splitlines()[2].split()[2] == tables[1].splitlines()[2].split()[2] == "1ms"


def test_sizes(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def measured(spec: TachometerSpec, *_: object, **__: object) -> synthesis.Measurement:
        return synthesis.Measurement({"COMB": 100 + len(spec.method), "FF": 50, "Fmax": 123.4}, "")

    monkeypatch.setattr(command, "versions", lambda: {"yosys": "0.70"})
    monkeypatch.setattr(command, "measure_core", measured)
    assert run("compare", *CORE, *MOTION, "--methods", "s,odrive", "--size", "--csv", tmp_path / "c.csv") == 0
    heads, s, odrive, *_ = capsys.readouterr().out.splitlines()
    assert heads.split()[-3:] == ["COMB", "FF", "Fmax"]
    assert s.split()[-3:] == ["101", "50", "123MHz"]
    assert odrive.split()[-3:] == ["-", "-", "-"]
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert (rows[0]["Fmax"], rows[1]["Fmax"]) == ("123.4", "")


def test_sizes_need_their_tools(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(synthesis, "PACKAGES", ("yowasp-nothing",))
    assert run("compare", *CORE, *MOTION, "--size") == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == (
        "tachometry: error: --size needs the extra `size`: yowasp-nothing is not installed: "
        "pip install 'tachometry[size]'\n"
    )


def test_what_it_takes_to_get_going_can_be_left_out(tmp_path: Path) -> None:
    worst = []
    for options in ([], ["--from", "200ms"]):
        motion = ["--motion", "constant:40rad/s:400ms", "--methods", "difference"]
        assert run("compare", *CORE, *motion, *options, "--csv", tmp_path / "c.csv") == 0
        with (tmp_path / "c.csv").open() as file:
            worst.append(float(next(csv.DictReader(file))["max_rad_s"]))
    assert worst[0] > 30
    assert worst[1] < 10


# --- tuning


def rows_of(path: Path) -> dict[str, dict[str, str]]:
    with path.open() as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def test_the_best_settings_are_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = [*CORE, "--motion", "constant:40rad/s:200ms", "--from", "50ms", "--jitter", "0.05"]
    methods = ["s", "mt", "mt:min-time=2ms", "hostmot2", "hostmot2:period=2ms", "kalman"]
    for name, more in (("usual", []), ("tuned", ["--tune"])):
        names = ["--methods", ",".join(methods)]
        assert run("compare", *options, *names, *more, "--csv", tmp_path / name) == 0
    usual, tuned = rows_of(tmp_path / "usual"), rows_of(tmp_path / "tuned")
    assert list(usual) == methods
    told = capsys.readouterr().out
    for name in ("s", "mt:min-time=2ms", "hostmot2:period=2ms"):
        assert tuned[name] == usual[name]
    for method in ("mt", "hostmot2", "kalman"):
        found = [row for name, row in tuned.items() if name.startswith(f"{method}:")]
        assert min(float(row["rms_rad_s"]) for row in found) < 0.8 * float(usual[method]["rms_rad_s"])
    assert told.count("; best of ") == 3
    assert "best of 9 settings" in told
    again = [*options, "--methods", ",".join(tuned), "--csv", tmp_path / "again"]
    assert run("compare", *again) == 0
    assert rows_of(tmp_path / "again") == tuned


def test_figure_of_error_over_delay(tmp_path: Path) -> None:
    options = ["--motion", "constant:40rad/s:200ms", "--from", "50ms", "--methods", "s,m,mt:min-time=2ms,hostmot2"]
    assert run("compare", *CORE, *options, "--tradeoff", tmp_path / "t.csv") == 0
    with (tmp_path / "t.csv").open() as file:
        rows = list(csv.DictReader(file))
    names = [row["name"] for row in rows]
    assert names[0] == "s"
    assert names.count("mt:min-time=2ms") == 1
    assert "m:average=10" in names
    assert {row["method"] for row in rows} == {"s", "m", "mt:min-time=2ms", "hostmot2"}
    by = {row["name"]: row for row in rows}
    slow, quick = by["hostmot2:period=8ms"], by["hostmot2:period=250us"]
    assert float(slow["rms_rad_s"]) < float(quick["rms_rad_s"])
    assert float(slow["equivalent_delay"]) > float(quick["equivalent_delay"])
    assert [by["s"]["shown"], slow["shown"]] == ["1", "1"]
    assert "0" in {row["shown"] for row in rows}
    assert run("compare", *CORE, *options, "--tradeoff", tmp_path / "t.png") == 0
    assert (tmp_path / "t.png").read_bytes().startswith(b"\x89PNG")


def test_settings_that_cannot_be_are_left_out(tmp_path: Path) -> None:
    """A minimum time beyond the maximum, a loop that is not stable, a period that is too long for the motion."""
    core = "--ppr 100 --clock 1MHz --tick 1ms --max-time 3ms".split()
    options = ["--motion", "constant:40rad/s:12ms", "--methods", "mt,odrive,hostmot2", "--tradeoff", tmp_path / "t.csv"]
    assert run("compare", *core, *options, "--tune") == 0
    with (tmp_path / "t.csv").open() as file:
        names = {row["name"] for row in csv.DictReader(file)}
    assert {"mt:min-time=2ms", "odrive:period=33us:bandwidth=4000rad/s", "hostmot2:period=2ms"} <= names
    assert not {"mt:min-time=10ms", "odrive:period=125us:bandwidth=4000rad/s", "hostmot2:period=8ms"} & names


def test_delays_are_those_with_an_ideal_encoder(tmp_path: Path) -> None:
    """The error is that with the faults that are given; the index line is there if the core wants it."""
    found = []
    for more in ([], ["--nonuniformity", "0.3", "--jitter", "0.2"], ["--index"]):
        options = ["--motion", "constant:40rad/s:100ms", "--from", "20ms", "--methods", "s,kalman:period=1ms", *more]
        assert run("compare", *CORE, *options, "--tradeoff", tmp_path / "t.csv") == 0
        with (tmp_path / "t.csv").open() as file:
            found.append([(row["rms_rad_s"], row["equivalent_delay"]) for row in csv.DictReader(file)])
    ideal, faulty, with_index = found
    assert with_index == ideal
    assert [delay for _, delay in faulty] == [delay for _, delay in ideal]
    assert all(float(worse) > 1.2 * float(rms) for (worse, _), (rms, _) in zip(faulty, ideal, strict=True))


def test_speeds_of_the_figure_are_in_the_unit_of_the_core(tmp_path: Path) -> None:
    found = []
    for unit in ([], ["--unit", "rpm"]):
        options = ["--motion", "constant:40rad/s:100ms", "--methods", "m:average=2", *unit]
        assert run("compare", *CORE, *options, "--tradeoff", tmp_path / "t.csv") == 0
        with (tmp_path / "t.csv").open() as file:
            found.append(next(csv.DictReader(file)))
    assert float(found[1]["rms_rpm"]) == pytest.approx(float(found[0]["rms_rad_s"]) * 30 / 3.14159265, rel=1e-6)


def test_tuning_needs_the_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "c.csv").write_text("time,a,b\n0,0,0\n0.1,1,0\n")
    for option in (["--tune"], ["--tradeoff", tmp_path / "new" / "t.png"]):
        assert run("compare", *CORE, "--replay", tmp_path / "c.csv", *option) == 2
        assert capsys.readouterr().err == f"tachometry: error: {option[0]} must be given together with --motion\n"
    assert [path.name for path in tmp_path.iterdir()] == ["c.csv"]
