"""Measures the house: rooms and the imports between them, sizes of specs, lines. `python bench/house.py`."""

import ast
import subprocess
from collections.abc import Iterator
from pathlib import Path

FOLDERS = ("spec", "hdl", "sim", "sim/studies", "cli")
PRODUCT = ("spec", "hdl", "sim", "cli", "boards", "package")
SPECS = {"TachometerSpec", "AxesSpec", "LoopSpec"}


def imported(tree: ast.AST) -> Iterator[str]:
    """Give the paths that a module imports, without an ending."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tachometry"):
            for alias in node.names:
                yield f"{node.module}.{alias.name}".removeprefix("tachometry.").replace(".", "/")
        elif isinstance(node, ast.Import):
            yield from (alias.name.removeprefix("tachometry.").replace(".", "/") for alias in node.names)


def child(folder: str, path: str) -> str | None:
    """Name the room of a folder in which a path lies: a folder within it, or a file."""
    name = path.removeprefix(f"{folder}/").split("/")[0].removesuffix(".py")
    place = Path(folder, name)
    is_room = path.startswith(f"{folder}/") and (place.is_dir() or place.with_suffix(".py").exists())
    return name if is_room and name != "__init__" else None


def rooms(folder: str) -> tuple[set[str], set[tuple[str, str]]]:
    """Find the rooms of a folder, and which imports which."""
    found, arrows = set[str](), set[tuple[str, str]]()
    for file in Path(folder).rglob("*.py"):
        if (room := child(folder, file.as_posix())) is None:
            continue
        found.add(room)
        others = {child(folder, path) for path in imported(ast.parse(file.read_text(encoding="utf-8")))}
        arrows |= {(room, other) for other in others - {room, None} if other}
    return found, arrows


def ladders(files: list[Path]) -> int:
    """Count what asks whether a spec is of one axis, of many or with a loop, outside the files of these classes."""
    count = 0
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        if SPECS & {node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}:
            continue
        asks = (
            node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"
        )
        count += sum(bool(SPECS & {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}) for node in asks)
    return count


def code_alone(file: Path) -> int:
    """Count the lines of a file without docstrings, comments and blank lines."""
    text = file.read_text(encoding="utf-8")
    documented = set[int]()
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Module() | ast.ClassDef() | ast.FunctionDef() if ast.get_docstring(node, clean=False) is not None:
                documented |= {*range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1)}
    lines = enumerate(text.splitlines(), 1)
    return sum(bool(line.strip()) and line.strip()[0] != "#" for number, line in lines if number not in documented)


def quoted(tests: list[Path], product: list[Path]) -> int:
    """Count the string literals of tests that quote a piece of a line of source with an operator in it."""
    lines = "\n".join(file.read_text(encoding="utf-8") for file in product)
    count = 0
    for file in tests:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            text = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
            code = (
                len(text) >= 8 and "\n" not in text and any(mark in text for mark in ("(", " = ", "==", ".eq", " + "))
            )
            count += code and text in lines
    return count


def main() -> None:
    """Print one line for each figure."""
    for folder in FOLDERS:
        found, arrows = rooms(folder)
        print(f"{folder}: {len(found)} rooms, {len(arrows)} imports between them")
    from tachometry.spec import METHODS, of_texts

    specs = [
        of_texts(method, {"ppr": "500", "tick": "100us"} if method != "rairan" else {"ppr": "500"})
        for method in METHODS
    ]
    members = [sum(not name.startswith("_") for name in dir(spec)) for spec in specs]
    print(f"public members of a spec: {min(members)} to {max(members)}")
    print(f"depth of its classes: at most {max(len(type(spec).__mro__) - 1 for spec in specs)}")
    listed = subprocess.run(["git", "ls-files", "*.py"], capture_output=True, text=True, check=True).stdout.split()
    product = [Path(file) for file in listed if file.split("/")[0] in PRODUCT]
    tests = [Path(file) for file in listed if file.startswith("tests/")]
    print(f"isinstance of specs outside their files: {ladders(product)}")
    parts = [(room, [file for file in product if file.parts[0] == room]) for room in PRODUCT]
    for what, files in [*parts, ("product", product), ("tests", tests)]:
        lines = sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files)
        print(f"lines of Python, {what}: {lines}, of which {sum(map(code_alone, files))} are code alone")
    print(f"string literals of tests that quote a line of source: {quoted(tests, product)}")


if __name__ == "__main__":
    main()
