"""`tachometry check` on every configuration, and on changes at random in every kind of file that is generated."""

import re
from collections.abc import Iterator
from functools import cache
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from cli.commands.test_check import CORES, Generated
from support.nightly import nightly

from tachometry.hdl.export.ci import ci_files
from tachometry.hdl.export.files import core_files, digest, file_names
from tachometry.sim.studies.pairs import configurations
from tachometry.sim.testbench.check import SAME, Make, check
from tachometry.spec import METHODS
from tachometry.spec.registers.buses import BUSES

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
    """Return what is the same in the names of files of one kind."""
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
