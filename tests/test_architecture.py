"""Which room may import which, and what folders promise. docs/concepts/architecture.md explains them."""

import ast
import re
import sys
from collections import Counter
from collections.abc import Callable, Collection
from functools import cache
from pathlib import Path

import pytest

from tachometry.spec import Port, of_texts
from tachometry.spec.core.extras import EXTRAS
from tachometry.spec.language.option import options_of

ROOT = Path(__file__).parent.parent
LAYERS = ("spec", "hdl", "sim", "boards", "cli")
# What each room may import beside itself; a layer stands for all of its rooms.
ALLOWED = {
    "spec/language": set[str](),
    "spec/formats": {"spec/language"},
    "spec/core": {"spec/formats", "spec/language"},
    "spec/methods": {"spec/core", "spec/formats", "spec/language"},
    "spec": {"spec/control", "spec/core", "spec/language", "spec/methods"},
    "spec/control": {"spec/core", "spec/language", "spec/methods"},
    "spec/registers": {"spec/control", "spec/core", "spec/language", "spec/methods"},
    "hdl": {"hdl/core"},
    "hdl/wires": {"spec"},
    "hdl/arithmetic": {"hdl/wires", "spec"},
    "hdl/front_end": {"hdl/arithmetic", "hdl/wires", "spec"},
    "hdl/output": {"hdl/arithmetic", "hdl/wires", "spec"},
    "hdl/methods": {"hdl/arithmetic", "hdl/front_end", "hdl/output", "hdl/wires", "spec"},
    "hdl/axes": {"hdl/arithmetic", "hdl/front_end", "hdl/methods", "hdl/output", "hdl/wires", "spec"},
    "hdl/bus": {"hdl/wires", "spec"},
    "hdl/control": {"hdl/arithmetic", "hdl/wires", "spec"},
    "hdl/extras": {"hdl/arithmetic", "hdl/front_end", "hdl/output", "hdl/wires", "spec"},
    "hdl/core": {
        "hdl/arithmetic",
        "hdl/axes",
        "hdl/bus",
        "hdl/control",
        "hdl/extras",
        "hdl/front_end",
        "hdl/methods",
        "hdl/output",
        "hdl/wires",
        "spec",
    },
    "hdl/export": {"hdl/core", "hdl/wires", "spec"},
    "sim": {"sim/signals", "spec"},
    "sim/signals": {"spec"},
    "sim/encoder": {"sim/captures", "sim/signals", "spec"},
    "sim/captures": {"sim/signals", "spec"},
    "sim/theory": {"spec"},
    "sim/golden": {"sim", "sim/signals", "spec"},
    "sim/engines": {"sim", "sim/signals", "hdl", "spec"},
    "sim/testbench": {"sim/encoder", "sim/golden", "sim/signals", "spec"},
    "sim/studies": {
        "sim",
        "sim/captures",
        "sim/encoder",
        "sim/engines",
        "sim/golden",
        "sim/signals",
        "sim/theory",
        "spec",
    },
    "sim/plots": {"sim/encoder", "sim/signals", "sim/studies", "spec"},
    "boards": set[str](),
    "boards/fpga": {"hdl", "sim/signals", "spec"},
    "boards/host": {"spec"},
    "boards/monitor": {"boards/host", "sim/encoder", "sim/golden", "sim/signals", "spec"},
    "boards/simulated": set[str](),
    "cli": {"cli", "boards", "sim", "hdl", "spec"},
    "cli/explore": {"cli", "boards", "sim", "hdl", "spec"},
    "cli/options": {"boards", "sim", "spec"},
    "cli/reports": {"boards", "sim", "spec"},
    "cli/commands": {"cli", "boards", "sim", "hdl", "spec"},
}


@cache
def nodes(file: Path) -> list[ast.AST]:
    """Return all that a file has."""
    return [*ast.walk(ast.parse(file.read_text(encoding="utf-8")))]


def imports(file: Path) -> set[str]:
    found = set()
    for node in nodes(file):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"relative import in {file}"
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def room_of(place: str) -> str:
    """Return the room of a module or file below a layer, by its path."""
    parts = place.split("/")
    return "/".join(parts[:2]) if "/".join(parts[:2]) in ALLOWED else parts[0]


def files(room: str) -> list[Path]:
    """Return files of a room, those of rooms within it left out."""
    found = [file for file in (ROOT / room).rglob("*.py") if room_of(file.relative_to(ROOT).as_posix()) == room]
    assert found, room
    return found


def test_every_folder_is_a_room() -> None:
    folders = {file.parent.relative_to(ROOT).as_posix() for layer in LAYERS for file in (ROOT / layer).rglob("*.py")}
    assert {"/".join(folder.split("/")[:2]) for folder in folders} == {*ALLOWED}


def _is_in(room: str, allowed: str, asking: str) -> bool:
    """Return whether a room is an allowed one or within it; within its own layer each room is allowed by its name."""
    own = asking.split("/")[0] == allowed
    return room == allowed or (room.startswith(f"{allowed}/") and (not own or allowed == "cli"))


@pytest.mark.parametrize("room", ALLOWED)
def test_import_directions(room: str) -> None:
    for file in files(room):
        ours = {name.removeprefix("tachometry.") for name in imports(file) if name.startswith("tachometry.")}
        rooms = {room_of(name.replace(".", "/")) for name in ours if (ROOT / name.replace(".", "/")).is_dir()}
        rooms |= {room_of(name.replace(".", "/")) for name in ours if (ROOT / f"{name.replace('.', '/')}.py").exists()}
        # A package in the path of what is meant is not meant itself.
        meant = {other for other in rooms if not any(more.startswith(f"{other}/") for more in rooms)}
        outside = {other for other in meant - {room} if not any(_is_in(other, one, room) for one in ALLOWED[room])}
        assert not outside, f"{file.relative_to(ROOT)} imports {outside}"


def test_only_engines_import_hdl() -> None:
    """In `sim`; of the commands, `generate`, `check` and `build` export it, and `compare --size` measures it."""
    users = [file for layer in ("sim", "cli") for file in (ROOT / layer).rglob("*.py")]
    of_hdl = {
        file.relative_to(ROOT).as_posix()
        for file in users
        if any(f"{name}.".startswith("tachometry.hdl.") for name in imports(file))
    }
    assert {file for file in of_hdl if not file.startswith("sim/engines/")} == {
        "cli/commands/build.py",
        "cli/commands/check.py",
        "cli/commands/compare.py",
        "cli/commands/generate.py",
    }


def functions(file: Path, package: str) -> list[str]:
    """Return what a file imports from a package in lower case: functions and modules, no classes and constants."""
    froms = [node for node in nodes(file) if isinstance(node, ast.ImportFrom)]
    return [
        alias.name
        for node in froms
        if (node.module or "").startswith(package)
        for alias in node.names
        if alias.name.islower()
    ]


def test_reports_call_no_functions_of_sim() -> None:
    """They format results, and compute nothing."""
    assert {file.name: called for file in files("cli/reports") if (called := functions(file, "tachometry.sim"))} == {}


def test_a_command_calls_one_study() -> None:
    """It returns one result, which one report prints. Sizes are of Verilog, which no study can export."""
    called = {file.stem: functions(file, "tachometry.sim.studies") for file in files("cli/commands")}
    assert {name: names for name, names in called.items() if len(names) > 1} == {
        "compare": ["comparison", "measure_core", "versions"]
    }


@pytest.mark.parametrize("layer", LAYERS)
def test_there_is_no_circle(layer: str) -> None:
    """Rooms of a layer can be put in an order in which each imports only those before it."""
    left = {
        room: {other for other in may if other.startswith(layer) and other != room} - {"cli"}
        for room, may in ALLOWED.items()
        if room.startswith(layer)
    }
    while left:
        free = [room for room, needs in left.items() if not needs & left.keys()]
        assert free, left
        for room in free:
            del left[room]


def test_no_files_import_each_other() -> None:
    """Files can be put in an order in which each imports only those before it, also for types."""
    every = [file for layer in LAYERS for file in (ROOT / layer).rglob("*.py")]
    paths = {file: file.relative_to(ROOT).with_suffix("").as_posix().removesuffix("/__init__") for file in every}
    modules = {f"tachometry.{path.replace('/', '.')}": file for file, path in paths.items()}
    left = {name: _of_files(file, modules.keys()) - {name} for name, file in modules.items()}
    while left:
        free = [name for name, needs in left.items() if not needs & left.keys()]
        assert free, sorted(left)
        for name in free:
            del left[name]


def _of_files(file: Path, modules: Collection[str]) -> set[str]:
    """Return the modules that a file imports, or from which it imports names."""
    froms = [node for node in nodes(file) if isinstance(node, ast.ImportFrom) and node.module]
    full = {(node.module or "", f"{node.module}.{alias.name}") for node in froms for alias in node.names}
    return {name if name in modules else module for module, name in full}


@pytest.mark.parametrize("room", [*(room for room in ALLOWED if room.startswith("spec")), "boards/host"])
def test_it_needs_only_the_standard_library(room: str) -> None:
    for file in files(room):
        top = {name.split(".")[0] for name in imports(file)}
        assert top <= set(sys.stdlib_module_names) | {"tachometry"}, file


def test_golden_models_need_only_numpy() -> None:
    for file in files("sim/golden"):
        twin = {"ctypes", "importlib"} if file.name == "track.py" else set()  # which is in C++
        twin |= {"importlib", "types"} if file.parent.name == "extras" else set()  # which have the names of their files
        top = {name.split(".")[0] for name in imports(file)}
        assert top <= {"tachometry", "numpy", "typing", "collections", "dataclasses", "bisect", "functools", *twin}, (
            file
        )


def test_naive_models_of_tests_import_nothing_that_is_tested() -> None:
    """They are read from papers and pages alone."""
    for file in (ROOT / "tests" / "reference").glob("*.py"):
        top = {name.split(".")[0] for name in imports(file)}
        assert top <= {*sys.stdlib_module_names, "numpy", "reference"}, file


def test_what_the_page_names_is_there() -> None:
    text = (ROOT / "docs/concepts/architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"`([\w.]+/[\w./]*)`", text)
    assert len(named) > 40
    assert [path for path in named if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("layer", LAYERS)
def test_files_can_be_read_on_a_few_screens(layer: str) -> None:
    for file in (ROOT / layer).rglob("*.py"):
        assert len(file.read_text(encoding="utf-8").splitlines()) <= 400, file


def test_docstrings_begin_with_a_sentence() -> None:
    rooms = (*LAYERS, "bench", "examples", "package", "tests")
    for file in (file for room in rooms for file in (ROOT / room).rglob("*.py")):
        for node in nodes(file):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                words = (ast.get_docstring(node) or "").split()
                assert words[:1] not in (["What"], ["See"]), (file, node)
                assert words[:2] != ["The", "same"], (file, node)


PRODUCT = (*LAYERS, "package")
SPECS = {"TachometerSpec", "AxesSpec", "LoopSpec"}


def sources(*folders: str) -> list[Path]:
    """Return the Python files below these folders."""
    return [file for folder in folders for file in sorted((ROOT / folder).rglob("*.py"))]


def lines(*folders: str) -> Counter[str]:
    """Return the lines of Python below these folders, by file."""
    return Counter({named(file): len(file.read_text(encoding="utf-8").splitlines()) for file in sources(*folders)})


def named(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


def calls(node: ast.AST, *names: str) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names


def every(found: Callable[[ast.AST], bool], *folders: str) -> Counter[str]:
    """Return how many nodes of the syntax trees below these folders are found, by file."""
    return Counter(named(file) for file in sources(*folders) for node in nodes(file) if found(node))


def is_long(node: ast.AST) -> bool:
    """Return whether it is a function of more than 40 lines, with its signature and docstring."""
    functions = ast.FunctionDef | ast.AsyncFunctionDef
    return isinstance(node, functions) and (node.end_lineno or 0) - node.lineno >= 40


def has_many_parameters(node: ast.AST) -> bool:
    """Return whether it is a function with more than 6 parameters, `self` and `cls` included."""
    if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        return False
    return sum(map(len, (node.args.posonlyargs, node.args.args, node.args.kwonlyargs))) > 6


def tells_kinds_apart(node: ast.AST) -> bool:
    """Return whether it asks a core for its kind: by `isinstance`, `kind`, `axes`, or as a function of the type."""
    if isinstance(node, ast.FunctionDef):
        return any("singledispatch" in ast.unparse(one) for one in node.decorator_list)
    if isinstance(node, ast.Compare):
        return isinstance(node.left, ast.Attribute) and node.left.attr in ("kind", "axes")
    return calls(node, "isinstance") and any(isinstance(one, ast.Name) and one.id in SPECS for one in ast.walk(node))


def has_a_broken_docstring(node: ast.AST) -> bool:
    """Return whether a docstring has "Return" before a sentence, or "Tell"."""
    if not isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
        return False
    broken = r"Return \w+ (is|are|may|has|counts)\b|Return (of|in)\b|Tells?\b"
    return re.match(broken, ast.get_docstring(node) or "") is not None


# What may only fall, with the rule by which it is counted. A change that brings a capability raises lines alone.
CEILING: dict[str, tuple[int, Callable[[], Counter[str]]]] = {
    "lines of Python of the product": (56351, lambda: lines(*PRODUCT)),
    "lines of Python of the tests": (45621, lambda: lines("tests")),
    "lines of Python of the benchmarks": (3515, lambda: lines("bench")),
    "functions over 40 lines": (14, lambda: every(is_long, *PRODUCT)),
    "functions with more than 6 parameters": (18, lambda: every(has_many_parameters, *PRODUCT)),
    "getattr and hasattr in hdl": (33, lambda: every(lambda node: calls(node, "getattr", "hasattr"), "hdl")),
    "places that tell kinds of core apart": (37, lambda: every(tells_kinds_apart, *PRODUCT)),
    "broken docstrings": (0, lambda: every(has_a_broken_docstring, *PRODUCT, "bench", "tests")),
}


@pytest.mark.parametrize("what", CEILING)
def test_it_only_falls(what: str) -> None:
    """When a number has fallen by more than 1 %, write the new one down."""
    ceiling, count = CEILING[what]
    found = count()
    assert found.total() <= ceiling, f"{found.total()} {what}, at most {ceiling}: {dict(found.most_common(20))}"
    assert found.total() >= 0.99 * ceiling, f"{found.total()} {what}: lower the ceiling, which is {ceiling}"


# Words outside extras that mean something else there, or belong to the wiring of an encoder as well.
OTHER_MEANINGS = {
    "boards/monitor/selftest.py": {"stream"},
    "boards/monitor/session.py": {"stream"},
    "cli/explore/server.py": {"stream"},
    "cli/options/capture.py": {"differential"},
    "sim/captures/sigrok.py": {"probe"},
    "sim/engines/gate_loop.py": {"lead"},
    "sim/encoder/virtual.py": {"stream"},
}


def names_of_extras() -> set[str]:
    """Return the options and ports of cores with every extra."""
    texts, of_reads = dict[str, str](), {"period-offsets": "yes"}
    ports = list[Port]()
    for test in (0, -1):
        for about in (about for extra in EXTRAS for about in options_of(extra)):
            if about.name in of_reads:
                continue
            if values := ["yes"] if about.flag else [*filter(None, about.tests or ())]:
                texts[about.name] = values[test]
        made = [of_texts("track", {"ppr": "25", "index": "yes", "max-speed": "100rad/s", **texts})]
        made.append(of_texts("track", {"sensor": "sampled", "bits": "9", "period": "64", **of_reads}))
        for spec in made:
            ports += [port for extra in spec.extras for port in extra.ports(spec)]
            ports += [pin.port for pin in spec.front_end.pins if not pin.of]  # wiring has complements, too
    texts |= of_reads
    return {*texts, *(name.replace("-", "_") for name in texts), *(port.name for port in ports)}


def named_in(file: Path) -> set[str]:
    """Return attributes, imports of this package and texts of a file, but its docstrings."""
    docstrings = {id(node.value) for node in nodes(file) if isinstance(node, ast.Expr)}
    words = {part for name in imports(file) if name.startswith("tachometry") for part in name.split(".")}
    words |= {node.attr for node in nodes(file) if isinstance(node, ast.Attribute)}
    texts = (node for node in nodes(file) if isinstance(node, ast.Constant) and id(node) not in docstrings)
    return words | {node.value for node in texts if isinstance(node.value, str)}


def test_only_extras_name_an_extra() -> None:
    names = names_of_extras()
    assert len(names) > 40
    for layer in LAYERS:
        for file in (file for file in (ROOT / layer).rglob("*.py") if "extras" not in file.parts):
            place = file.relative_to(ROOT).as_posix()
            found = names & named_in(file) - {"angle", "disc"}  # of every shaft and encoder
            assert found == OTHER_MEANINGS.get(place, set()), place
