"""Captures that are made for tests."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.captures.file import CaptureError
from tachometry.sim.captures.header import PLAIN, TextOptions
from tachometry.sim.captures.read import read_capture
from tachometry.sim.signals.recording import PinTrace, Recording

MEGAHERTZ = 1_000_000


def random_trace(n_edges: int, n_clocks: int, seed: int = 1) -> PinTrace:
    """Give a trace in which each row differs from the one before."""
    rng = np.random.default_rng(seed)
    clock = np.unique(np.append(0, rng.integers(1, n_clocks, n_edges)))
    level = np.cumsum(rng.integers(1, 4, len(clock))) % 4
    return PinTrace(clock, (level & 1).astype(np.uint8), (level >> 1).astype(np.uint8), n_clocks)


def assert_same(got: PinTrace | Recording, wanted: PinTrace | Recording) -> None:
    assert type(got) is type(wanted)
    for name, value in vars(wanted).items():
        if name != "source":  # what is written does not say where it was read from
            np.testing.assert_array_equal(getattr(got, name), value, err_msg=name)


def make_sr(
    path: Path, chunks: list[bytes] | bytes, probes: dict[int, str] | None = None, **metadata: str | None
) -> Path:
    """Make a session as sigrok-cli does: deflated, chunks or a single member, keys of the metadata in its order."""
    probes = {1: "A", 2: "B"} if probes is None else probes
    version = metadata.pop("version", "2")
    keys: dict[str, str | None] = {"capturefile": "logic-1", "total probes": "8", "samplerate": "1 MHz"}
    keys |= {"total analog": "0"} | {f"probe{number}": name for number, name in probes.items()} | {"unitsize": "1"}
    keys |= {key.replace("_", " "): value for key, value in metadata.items()}
    text = "[global]\nsigrok version=0.5.2\n\n[device 1]\n"
    text += "".join(f"{key}={value}\n" for key, value in keys.items() if value is not None)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        if version is not None:
            archive.writestr("version", version)
        archive.writestr("metadata", text)
        if isinstance(chunks, bytes):
            archive.writestr("logic-1", chunks)
        else:
            for number, chunk in enumerate(chunks, 1):
                archive.writestr(f"logic-1-{number}", chunk)
    return path


def make_csv(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


# Round trips


def assert_error(
    path: Path, message: str, *, time: str | None = None, text: TextOptions = PLAIN, **options: str | int | float | None
) -> None:
    with pytest.raises(CaptureError) as caught:
        read_capture(path, text=replace(text, time=time), **options)  # type: ignore[arg-type]
    assert str(caught.value) == message.replace("PATH", str(path))
    assert "\n" not in str(caught.value)
