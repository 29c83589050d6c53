"""Outputs appear whole and all together, or not at all."""

import fcntl
import os
import resource
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from support.command import run
from support.nightly import only_rows
from support.pipes import read

from tachometry.cli.files import Outputs


def everything(folder: Path) -> dict[str, str | None]:
    """Return contents of all files below a folder; None for folders."""
    return {str(p.relative_to(folder)): p.read_text() if p.is_file() else None for p in folder.rglob("*")}


def test_all_appear_at_the_end(tmp_path: Path) -> None:
    (tmp_path / "b").write_text("before")
    with Outputs({"a": tmp_path / "new" / "deep" / "a", "b": tmp_path / "b"}) as outputs:
        outputs["a"].write_text("A")
        outputs["b"].write_text("B")
        assert not (tmp_path / "new" / "deep" / "a").exists()
        assert (tmp_path / "b").read_text() == "before"
        assert outputs["a"].name == "a"
        assert outputs.get("c") is None
    assert everything(tmp_path) == {"new": None, "new/deep": None, "new/deep/a": "A", "b": "B"}


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_nothing_is_left_after_an_error(tmp_path: Path, error: type[BaseException]) -> None:
    (tmp_path / "b").write_text("before")

    def work() -> None:
        with Outputs({"a": tmp_path / "new" / "deep" / "a", "b": tmp_path / "b"}) as outputs:
            outputs["a"].write_text("A")
            outputs["b"].write_text("B")
            raise error

    with pytest.raises(error):
        work()
    assert everything(tmp_path) == {"b": "before"}


def test_a_folder_that_others_use_meanwhile_stays(tmp_path: Path) -> None:
    def work() -> None:
        with Outputs({"a": tmp_path / "new" / "a"}):
            (tmp_path / "new" / "other").write_text("other")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        work()
    assert everything(tmp_path) == {"new": None, "new/other": "other"}


def test_if_one_cannot_be_renamed_all_are_as_before(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("before")

    def work() -> None:
        with Outputs({name: tmp_path / name for name in ("a", "b", "c")}) as outputs:
            outputs["a"].write_text("A")
            outputs["b"].write_text("B")  # c is missing

    with pytest.raises(OSError, match=r"cannot write .*/c: No such file"):
        work()
    assert everything(tmp_path) == {"a": "before"}


def test_a_target_below_a_file_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(OSError, match=r"cannot write .*/file/a: Not a directory"),
        Outputs({"first": tmp_path / "new" / "b", "second": tmp_path / "file" / "a"}),
    ):
        pass
    assert everything(tmp_path) == {"file": ""}


def test_two_outputs_need_two_files(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="--vcd and --plot must be different files, not both"):
        Outputs({"--vcd": tmp_path / "x", "--plot": tmp_path / "sub" / ".." / "x"})


def test_an_input_is_not_overwritten(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="--trace must be another file than the input"):
        Outputs({"--trace": tmp_path / "x"}, inputs=[tmp_path / "." / "x"])


@pytest.mark.parametrize("path", [".", "/dev/null"])
def test_a_target_must_be_a_file(path: str) -> None:
    with pytest.raises(ValueError, match=r"--trace must be a file, which .* is not"):
        Outputs({"--trace": Path(path)})


def test_a_link_is_replaced_and_what_it_points_at_stays(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("before")
    (tmp_path / "link").symlink_to("file")
    with Outputs({"a": tmp_path / "link"}) as outputs:
        outputs["a"].write_text("A")
    assert everything(tmp_path) == {"file": "before", "link": "A"}


def in_a_child(folder: Path, work: Callable[[Outputs], None]) -> tuple[int, int]:
    """Return a process that is within the block, its files not yet renamed; and what it waits for until it ends."""
    ready, let = os.pipe(), os.pipe()
    child = os.fork()
    if child == 0:
        try:
            with Outputs({"a": folder / "a", "b": folder / "b"}) as outputs:
                work(outputs)
                os.write(ready[1], b".")
                os.close(let[1])
                os.read(let[0], 1)
                raise KeyboardInterrupt
        finally:
            os._exit(0)
    os.close(ready[1])
    os.close(let[0])
    assert read(ready[0]) == b"."
    os.close(ready[0])
    return child, let[1]


def test_what_a_killed_process_has_left_is_removed_and_what_a_living_one_has_stays(tmp_path: Path) -> None:
    (tmp_path / "b").write_text("before")

    def killed_while_renaming(outputs: Outputs) -> None:
        outputs["a"].write_text("half")
        (tmp_path / "b").replace(outputs["b"].parent.parent / "old" / "b")

    child, gate = in_a_child(tmp_path, killed_while_renaming)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(gate)
    assert not (tmp_path / "b").exists()
    assert len(list(tmp_path.glob(".tachometry-*"))) == 1

    living, gate = in_a_child(tmp_path, lambda outputs: None)
    kept = list(tmp_path.glob(".tachometry-*"))
    assert len(kept) == 1
    assert (tmp_path / "b").read_text() == "before"
    with Outputs({"a": tmp_path / "a"}) as outputs:
        outputs["a"].write_text("A")
    assert list(tmp_path.glob(".tachometry-*")) == kept
    os.close(gate)
    os.waitpid(living, 0)
    assert everything(tmp_path) == {"a": "A", "b": "before"}


def test_a_folder_that_another_process_makes_meanwhile_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "new").mkdir()
    with monkeypatch.context() as patch:
        there = Path.exists
        patch.setattr(Path, "exists", lambda path: path.name != "new" and there(path))
        outputs = Outputs({"a": tmp_path / "new" / "a"}).__enter__()
    outputs["a"].write_text("A")
    outputs.__exit__(None, None, None)
    assert everything(tmp_path) == {"new": None, "new/a": "A"}


def test_one_process_at_a_time_puts_files_into_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another one could take a file away between the look at it and its replacement."""
    held, replace = [], Path.replace

    def looked_at(path: Path, target: Path) -> Path:
        descriptor = os.open(tmp_path, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            held.append(path.name)
        finally:
            os.close(descriptor)
        return replace(path, target)

    (tmp_path / "a").write_text("before")
    with monkeypatch.context() as patch, Outputs({"a": tmp_path / "a"}) as outputs:
        outputs["a"].write_text("A")
        patch.setattr(Path, "replace", looked_at)
    assert held == ["a", "a"]


def test_a_full_disk_names_the_output(tmp_path: Path) -> None:
    def written() -> None:
        with Outputs({"a": tmp_path / "a", "b": tmp_path / "b"}) as outputs:
            outputs["a"].write_text("A")
            with limited(resource.RLIMIT_FSIZE, 1000), outputs["b"].open("w") as file:
                file.write("B" * 100_000)

    with pytest.raises(OSError, match=rf"^cannot write {tmp_path}/b: File too large$"):
        written()
    assert everything(tmp_path) == {}


@contextmanager
def limited(what: int, soft: int) -> Iterator[None]:
    before = resource.getrlimit(what)
    resource.setrlimit(what, (soft, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(what, before)


def test_an_error_that_names_a_temporary_file_is_of_its_output(tmp_path: Path) -> None:
    def written() -> None:
        with Outputs({"a": tmp_path / "a"}) as outputs:
            outputs["a"].mkdir()
            outputs["a"].write_text("A")

    with pytest.raises(OSError, match=rf"^cannot write {tmp_path}/a: Is a directory$"):
        written()


# Every file that a command writes may be the one that does not fit on the disk.
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
