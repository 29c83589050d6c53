"""Outputs appear whole and all together, or not at all."""

from pathlib import Path

import pytest

from tachometry.cli.files import Outputs


def everything(folder: Path) -> dict[str, str | None]:
    """Contents of all files below a folder; None for folders."""
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
