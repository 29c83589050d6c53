"""Results of a sweep on disk."""

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from filelock import FileLock

from tachometry.sim.studies.sweeping import results as sweep_results
from tachometry.sim.studies.sweeping.results import Results
from tachometry.sim.studies.sweeping.sweep import COLUMNS, code_digest


def row(point: str, **more: Any) -> dict[str, Any]:
    return dict.fromkeys(COLUMNS) | {"point": point, "rms_error_rad_s": 0.1 + 0.2} | more


def names(path: Path) -> list[str]:
    found: list[str] = pq.read_table(path)["point"].to_pylist()
    return found


def test_rows_are_in_the_order_of_the_sweep(tmp_path: Path) -> None:
    path = tmp_path / "new" / "r.parquet"
    with Results(path, ["a", "b", "c"], ["speed"]) as results:
        assert results.missing == ["a", "b", "c"]
        for name in "ca":
            results.add(row(name, speed=1.5))
        assert results.missing == ["b"]
    assert names(path) == ["a", "c"]
    table = pq.read_table(path)
    assert table.column_names == [*COLUMNS, "speed"]
    assert table["speed"].to_pylist() == [1.5, 1.5]
    assert table["rms_error_rad_s"].to_pylist() == [0.1 + 0.2] * 2
    assert [file.name for file in path.parent.iterdir()] == ["r.parquet"]


def test_a_lock_that_cannot_be_written_is_told_of_the_file(tmp_path: Path) -> None:
    (tmp_path / ".r.parquet.lock").symlink_to(tmp_path / "missing" / "x")
    with (
        pytest.raises(OSError, match=r"^cannot write .*/r\.parquet: No such file"),
        Results(tmp_path / "r.parquet", [], []),
    ):
        pass


def test_what_is_there_is_not_missing_and_stays(tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    with Results(path, ["a", "b"], ["speed"]) as results:
        results.add(row("b", speed=2.0))
        results.add(row("a", speed=1.0))
    with Results(path, ["c", "b"], ["angle"]) as results:
        assert results.missing == ["c"]
        results.add(row("c", angle=3.0))
        assert results.columns("point", "angle") == {"point": ["c", "b"], "angle": [3.0, None]}
    table = pq.read_table(path)
    assert table["point"].to_pylist() == ["c", "b", "a"]
    assert table["speed"].to_pylist() == [None, 2.0, 1.0]
    assert table["angle"].to_pylist() == [3.0, None, None]


def killed(path: Path, *rows: dict[str, Any]) -> None:
    """Rows that arrive, and then the end: the system closes all files."""
    results = Results(path, [row["point"] for row in rows], ["speed"])
    results.__enter__()
    for each in rows:
        results.add(each)
    assert results._lock is not None
    results._lock.release()
    if results._journal is not None:
        results._journal.close()


def test_a_row_is_on_disk_when_it_is_there(tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    killed(path, row("a", speed=1.0), row("b", speed=2.0))
    assert not path.exists()
    with (tmp_path / ".r.parquet.new").open("a") as journal:
        journal.write('{"point": "c", "rms')
    with Results(path, ["c", "a", "b"]) as results:
        assert names(path) == ["a", "b"]
        assert results.missing == ["c"]
    assert pq.read_table(path)["speed"].to_pylist() == [1.0, 2.0]
    assert [file.name for file in tmp_path.iterdir()] == ["r.parquet"]


def test_killed_between_the_file_and_the_end_of_the_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.parquet"
    monkeypatch.setattr(Results, "_begin_journal", lambda _: None)
    monkeypatch.setattr(sweep_results, "_PATIENCE", 0.0)
    killed(path, row("a"))
    assert names(path) == ["a"]
    monkeypatch.undo()
    killed(tmp_path / "other.parquet", row("a"), row("b"))
    (tmp_path / ".other.parquet.new").replace(tmp_path / ".r.parquet.new")
    with Results(path, ["a", "b"]) as results:
        assert results.missing == []
    assert names(path) == ["a", "b"]


def test_the_file_is_written_now_and_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_results, "_PATIENCE", 0.0)
    path = tmp_path / "r.parquet"
    with Results(path, ["a", "b"]) as results:
        results.add(row("a"))
        assert names(path) == ["a"]
        assert (tmp_path / ".r.parquet.new").read_text().count("\n") == 1  # which code it is of


def test_a_file_that_cannot_be_written_leaves_the_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.parquet"

    def full(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(OSError, match=r"^cannot write .*: disk full; 1 row is kept, "), Results(path, ["a"]) as results:
        results.add(row("a"))
    monkeypatch.undo()
    assert not path.exists()
    assert (tmp_path / ".r.parquet.new").read_text().count("\n") == 2
    with Results(path, ["a"]) as results:
        assert results.missing == []
    assert names(path) == ["a"]


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """Yield what goes beyond so many bytes of a file cannot be written, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_disk_that_is_full_in_the_middle(tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    message = r"^cannot write .*/r\.parquet: .*; 2 rows are kept, and the same command goes on from there$"
    results = Results(path, list("abc")).__enter__()
    for name in "ab":
        results.add(row(name))
    with files_up_to((tmp_path / ".r.parquet.new").stat().st_size + 99):
        with pytest.raises(OSError, match=r"^cannot write .*/r\.parquet: .*; 2 rows are kept, "):
            results.add(row("c"))
        with pytest.raises(OSError, match=message):
            results.__exit__()
    assert [file.name for file in tmp_path.iterdir()] == [".r.parquet.new"]
    with Results(path, list("abc")) as results:
        assert results.missing == ["c"]
    assert names(path) == ["a", "b"]


def test_a_disk_that_is_full_at_the_start(tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    with files_up_to(9), pytest.raises(OSError, match=r"^cannot write .*/r\.parquet: [^;]*$"):
        Results(path, ["a"]).__enter__()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["", "0123"])
def test_a_journal_without_a_whole_line(text: str, tmp_path: Path) -> None:
    (tmp_path / ".r.parquet.new").write_text(text)
    with Results(tmp_path / "r.parquet", ["a"]) as results:
        assert results.missing == ["a"]


def test_one_sweep_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    with Results(path, []), pytest.raises(ValueError, match=r"^results must be of one sweep at a time: .* is in use$"):
        Results(path, []).__enter__()
    with Results(path, []):
        pass


@pytest.mark.parametrize("metadata", [None, {"tachometry.code": "another"}])
def test_files_of_others_are_refused(metadata: dict[str, str] | None, tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    pq.write_table(pa.table({"point": ["a"]}).replace_schema_metadata(metadata), path)
    before = path.read_bytes()
    message = "of this version of tachometry, and .* is of another" if metadata else "a Parquet file of a sweep, which"
    with pytest.raises(ValueError, match=f"^results must be {message}"):
        Results(path, []).__enter__()
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["r.parquet"]


def test_a_journal_of_another_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.parquet"
    killed(path, row("a"))
    monkeypatch.setattr(sweep_results, "code_digest", lambda **_: "another")
    with pytest.raises(ValueError, match=r"\.r\.parquet\.new is of another"):
        Results(path, []).__enter__()
    assert (tmp_path / ".r.parquet.new").exists()


@pytest.mark.parametrize("engine", [None, "pysim"])
@pytest.mark.parametrize("finished", [False, True])
def test_other_hardware_is_refused_only_with_rows_of_an_engine(
    engine: str | None, finished: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.parquet"
    if finished:
        with Results(path, ["a"]) as results:
            results.add(row("a", engine=engine))
    else:
        killed(path, row("a", engine=engine))
    monkeypatch.setattr(sweep_results, "code_digest", lambda hardware=False: "new" if hardware else code_digest())
    if engine is None:
        with Results(path, ["a", "b"]) as results:
            assert results.missing == ["b"]
            results.add(row("b", engine="pysim"))
        with Results(path, ["a", "b"]) as results:
            assert results.missing == []
    else:
        with pytest.raises(ValueError, match=r"^results must be of this version of tachometry, and .* is of another"):
            Results(path, ["a"]).__enter__()


def test_nothing_is_kept_without_a_file() -> None:
    with Results(None, ["a", "b"]) as results:
        results.add(row("b", method="s"))
        assert results.missing == ["a"]
        assert results.columns("method") == {"method": ["s"]}


def test_what_a_killed_sweep_was_writing_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "r.parquet"
    (tmp_path / ".r.parquet.123.part").write_bytes(b"PAR1")
    with Results(path, ["a"]) as results:
        results.add(row("a"))
    assert [file.name for file in tmp_path.iterdir()] == ["r.parquet"]


@pytest.mark.parametrize("function", [(FileLock, "acquire"), (Path, "unlink"), (Path, "open")])
def test_a_signal_while_the_file_is_taken_or_given_back_leaves_nothing(
    function: tuple[type, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = getattr(*function)

    def stopped(*arguments: Any, **named: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        done = real(*arguments, **named)
        signal.raise_signal(signal.SIGINT)
        return done

    def use() -> None:
        with Results(tmp_path / "r.parquet", ["a"]):
            pass

    monkeypatch.setattr(*function, stopped)
    with pytest.raises(KeyboardInterrupt):
        use()
    monkeypatch.undo()
    assert list(tmp_path.iterdir()) == []
