"""`tachometry calibrate` from a capture to the files, as docs/guides/disc.md has it, and nothing where it refuses."""

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from matplotlib.image import imread
from support import docs
from support.command import run
from support.serial import encode_answer

from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.spec import of_texts
from tachometry.spec.core.disc import Disc
from tachometry.spec.registers import frames
from tachometry.spec.registers.edges import HEADER, MAGIC
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import RegisterMap

PAGE = docs.page("guides/disc.md")
COMMANDS = [shlex.split(line) for line in re.findall(r"^tachometry (.*)", PAGE, re.MULTILINE)]
EVEN = VirtualEncoder(24, index=True, seed=7, jitter=0.05)
ENCODER = replace(EVEN, nonuniformity=0.1, eccentricity=0.25)


def save(path: Path, motion: str, encoder: VirtualEncoder = ENCODER) -> None:
    recording = encoder.record(parse_motion(motion)).recording
    write_sr(path, recording.place(2_000_000), 2_000_000)


def test_commands_of_the_guide_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In order; the report and the picture of the page are those that they make."""
    monkeypatch.chdir(tmp_path)
    for words in COMMANDS:
        capsys.readouterr()
        assert run(*words) == 0, words
        if words[:2] == ["calibrate", "build/coast.sr"] and "--plot" in words:
            report = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    shown = PAGE.partition("```text\n")[2].partition("```")[0]
    assert report == shown.splitlines()
    made, drawn = (imread(path) for path in (tmp_path / "build/disc.png", docs.DOCS / "guides/disc.png"))
    assert abs(made - drawn).mean() < 0.01, "put build/disc.png into docs/guides"


def test_a_map_and_a_picture_are_written_or_neither(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "coast.sr", "ramp:150rad/s:60rad/s:3s")
    save(tmp_path / "even.sr", "constant:100rad/s:2s")
    files = ["--ppr", "24", "--index", "-o", "out/disc.json", "--plot", "out/disc.svg"]
    capsys.readouterr()
    assert run("calibrate", "even.sr", *files) == 2
    told = capsys.readouterr()
    assert re.search(r"^verdict +refused", told.out, re.MULTILINE)
    assert told.err.startswith("tachometry: error: the map is refused: there is one speed")
    assert len(told.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()
    assert run("calibrate", "even.sr", *files, "--one-speed") == 0
    assert Disc.parse((tmp_path / "out/disc.json").read_text()).one_speed
    assert run("calibrate", "coast.sr", *files) == 0
    first = [(tmp_path / "out" / name).read_bytes() for name in ("disc.json", "disc.svg")]
    assert run("calibrate", "coast.sr", *files) == 0
    assert [(tmp_path / "out" / name).read_bytes() for name in ("disc.json", "disc.svg")] == first
    disc = Disc.parse(first[0].decode())
    assert (disc.counts_per_rev, disc.index_place, disc.one_speed) == (96, 2, False)
    capsys.readouterr()
    assert run("calibrate", "coast.sr", "--ppr", "24", "--against", "out/disc.json") == 0
    assert re.search(r"^since --against +0\.00\d\d counts RMS", capsys.readouterr().out, re.MULTILINE)


class Core:
    """A serial port of a core that confirms what is written, and answers with its numbers."""

    described: ClassVar[dict[str, Any]] = {}
    written: ClassVar[list[tuple[str, int]]] = []

    def __init__(self, name: str, baud: int) -> None:
        self.bytes = b""
        assert (name, baud) == ("/dev/ttyUSB1", 115_200)

    __enter__ = __exit__ = lambda self, *_: self

    def write(self, data: bytes, /) -> None:
        request, registers = frames.decode_request(data), self.described["registers"]
        name = {one["offset"]: one["name"] for one in registers["map"]}[4 * request.address]
        reads = request.type is frames.Type.READ
        if not reads:
            self.written.append((name, request.value))
        self.bytes += encode_answer(request, frames.Answer((registers[name.lower()],) if reads else (), False))

    def read(self, size: int, /) -> bytes:
        found, self.bytes = self.bytes, b""
        return found


def test_the_number_that_aligns_a_core_is_printed_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    save(tmp_path / "coast.sr", "ramp:150rad/s:60rad/s:3s")
    words = ["calibrate", tmp_path / "coast.sr", "--ppr", "24"]
    assert run(*words, "--index", "-o", tmp_path / "disc.json") == 0
    begins = int(ENCODER.disc.quarter(np.zeros(1))[0]) % 96
    spec = of_texts("mt", {"ppr": "24", "disc-table": "edges"})
    Core.described |= manifest(spec) | {"registers": RegisterMap(spec).described(), "baud": 115_200}
    (tmp_path / "core.json").write_text(json.dumps(Core.described))
    monkeypatch.setattr("tachometry.cli.commands.calibrate.SerialPort", Core)
    aligns = [*words, "--against", tmp_path / "disc.json", "--align", "/dev/ttyUSB1"]
    assert run(*aligns) == 2
    for text in ("", "[]", "{}"):
        (tmp_path / "wrong.json").write_text(text)
        capsys.readouterr()
        assert run(*aligns, "--manifest", tmp_path / "wrong.json") == 2
        assert "--manifest must be of a core on a UART with a map and no index, not " in capsys.readouterr().err
    assert run(*aligns, "--manifest", tmp_path / "core.json") == 0
    assert Core.written == [("DISC_TURN", begins | 1 << 8)]
    assert f"DISC_TURN             {begins}, if the core was reset as the capture began" in capsys.readouterr().out


def test_a_disc_without_faults_gains_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save(tmp_path / "even.sr", "ramp:150rad/s:60rad/s:3s", EVEN)
    assert run("calibrate", tmp_path / "even.sr", "--ppr", "24", "--index") == 0
    assert "the disc is better than the map: there is nothing to gain" in capsys.readouterr().out


class Board:
    """A serial port of a board that records a bit more than four turns of a shaft, at another speed each time."""

    def __init__(self, name: str, baud: int) -> None:
        self.asked, self.bytes = 0, b""

    __enter__ = __exit__ = lambda self, *_: self

    def write(self, data: bytes, /) -> None:
        speed, self.asked = 150 - 6 * self.asked, self.asked + 1
        made = replace(ENCODER, start_angle_rad=self.asked, jitter=0.03).record(
            parse_motion(f"ramp:{speed}rad/s:{speed - 4}rad/s:{30 / speed}s")
        )
        trace = made.recording.place(12_000_000)
        gap, level = np.diff(trace.clock, prepend=0), trace.a + 2 * trace.b + 4 * trace.lines["z"]
        words = b"".join(int(one << 3 | two).to_bytes(3, "little") for one, two in zip(gap, level, strict=True))
        self.bytes = HEADER.pack(MAGIC, 12_000_000, len(gap)) + words

    def read(self, size: int, /) -> bytes:
        found, self.bytes = self.bytes[:size], self.bytes[size:]
        return found


def test_a_board_is_a_capture_at_many_speeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tachometry.cli.commands.calibrate.SerialPort", Board)
    for index in ((), ("--index",)):
        words = ("calibrate", "/dev/ttyUSB1", "--port", "--ppr", "24", *index, "-o", tmp_path / "disc.json")
        assert run(*words) == 0
        disc = Disc.parse((tmp_path / "disc.json").read_text())
        offset = ENCODER.disc.offset
        assert disc.turns > 10
        assert min(np.std(disc.displacement - np.roll(offset - offset.mean(), by)) for by in range(96)) < 0.02
