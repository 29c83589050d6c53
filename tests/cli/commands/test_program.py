"""`tachometry program`, with a program that stands for openFPGALoader."""

import json
from pathlib import Path

import pytest
from support.command import run
from support.fake_tools import FakeTools

LOADER = "openfpgaloader-cli"
NO_LIBRARY = (
    "bin/openFPGALoader: error while loading shared libraries: libusb-1.0.so.0: cannot open shared "
    "object file: No such file or directory"
)
# As openFPGALoader 1.1.1 says it without a board.
NO_ICEBREAKER = "unable to open ftdi device: -3 (device not found)\nError: Failed to claim cable"
NO_TANG = (
    "empty\nwrite to ram\nunable to open ftdi device: -3 (device not found)\nJTAG init failed with: unable to open"
)


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeTools:
    monkeypatch.chdir(tmp_path)
    return FakeTools(tmp_path / "tools", monkeypatch, LOADER)


def built(folder: str, board: str, name: str) -> Path:
    """Return a bitstream and its manifest."""
    file = Path(folder, name)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("bits")
    file.with_suffix(".json").write_text(json.dumps({"board": {"name": board}}))
    return file


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert run("program", *words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    return str(err.removeprefix("tachometry: error: ").rstrip("\n"))


@pytest.mark.parametrize(
    ("board", "name", "options", "flash"),
    [
        ("icebreaker", "x.bin", ["-b", "ice40_generic", "-f"], []),
        ("tang-nano-9k", "x.fs", ["-b", "tangnano9k"], ["-f"]),
        ("ulx3s-12f", "x.bit", ["-b", "ulx3s"], ["-f"]),
        ("arty-a7-35", "x.bit", ["-b", "arty_a7_35t"], ["-f"]),
        ("de10-nano", "x.rbf", ["-b", "de10nano"], ["-f"]),
    ],
)
def test_what_openfpgaloader_is_told(
    board: str, name: str, options: list[str], flash: list[str], fake: FakeTools, capsys: pytest.CaptureFixture[str]
) -> None:
    file = built(f"build/{board}", board, name)
    assert run("program", board) == 0
    assert capsys.readouterr().out.startswith(f"{file} is in the ")
    assert run("program", board, file) == 0
    assert run("program", board, file.parent, "--flash") == 0
    assert fake.calls == [
        [LOADER, *options, str(file)],
        [LOADER, *options, str(file)],
        [LOADER, *options, *flash, str(file)],
    ]


def test_a_bitstream_of_another_board_is_not_loaded(fake: FakeTools, capsys: pytest.CaptureFixture[str]) -> None:
    built("rig", "ulx3s-85f", "x.bit")
    assert (
        refused(capsys, "arty-a7-35", "rig/x.bit") == "rig/x.bit must be a bitstream for arty-a7-35, not for ulx3s-85f"
    )
    message = "rig must have one bitstream for {} and its manifest, as tachometry build writes them, not {}"
    assert refused(capsys, "ulx3s-12f", "rig") == message.format("ulx3s-12f", "none")
    built("rig", "ulx3s-85f", "y.bit")
    assert refused(capsys, "ulx3s-85f", "rig") == message.format("ulx3s-85f", "x.bit, y.bit")
    assert refused(capsys, "icebreaker", "rig/x.bit") == "a bitstream for icebreaker must end in .bin, not 'x.bit'"
    assert refused(capsys, "icebreaker").endswith("not 'build/icebreaker': type tachometry build icebreaker")
    Path("rig/alone.bit").write_text("bits")
    assert run("program", "ulx3s-85f", "rig/alone.bit") == 0
    assert len(fake.calls) == 1


@pytest.mark.parametrize(
    ("status", "output", "said"),
    [
        (
            127,
            NO_LIBRARY,
            "openFPGALoader needs libusb-1.0.so.0; on Debian and Ubuntu: apt install libusb-1.0-0 libftdi1-2",
        ),
        (
            1,
            NO_ICEBREAKER,
            "there is no iCEBreaker, iCE40UP5K on USB, or another program has it, or you may not use it",
        ),
        (1, NO_TANG, "there is no iCEBreaker, iCE40UP5K on USB, or another program has it, or you may not use it"),
        (1, "Error: flash is protected", "openFPGALoader: Error: flash is protected"),
        (1, "", "openFPGALoader: exit status 1"),
    ],
)
def test_what_goes_wrong_is_told(
    status: int, output: str, said: str, fake: FakeTools, capsys: pytest.CaptureFixture[str]
) -> None:
    fake.tell(LOADER, status=status, output=output)
    assert refused(capsys, "icebreaker", built("rig", "icebreaker", "x.bin")) == said


def test_without_openfpgaloader(fake: FakeTools, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "tools" / LOADER).unlink()
    said = refused(capsys, "icebreaker", built("rig", "icebreaker", "x.bin"))
    assert said == f"{LOADER} is needed for boards and not installed: pip install 'tachometry[boards]'"
