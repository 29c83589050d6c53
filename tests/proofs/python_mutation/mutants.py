"""Mutants of the Python side: the same source with one thing wrong, as a changed syntax tree."""

import ast
import copy
import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

# Mutants that change nothing that could be seen, by their names, each with the argument.
ARGUED: dict[str, str] = {
    f"{where}: {change}": argument
    for where, argument, *changes in json.loads(Path(__file__).with_name("equivalent.json").read_text(encoding="utf-8"))
    for change in changes
}
# What is mutated, by room: what describes cores, the golden models, and the comparison.
ROOMS = {
    "spec": ("spec", "hdl/export"),  # and the files that are written of them
    "golden models": ("sim/golden",),
    "comparison": ("sim/signals/run.py", "sim/studies/lockstep.py"),
}
_COMPARED = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_OPERATED = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.FloorDiv,
    ast.FloorDiv: ast.Mult,
    ast.Div: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitOr,
    ast.Pow: ast.Mult,
}
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "floor": "ceil", "ceil": "floor"}
_NAMES |= {"minimum": "maximum", "maximum": "minimum"}
# Texts that people read, and what only type checkers read, are no part of what a core is.
_WORDS = ("ParameterError", "ValueError", "AttributeError", "TypeVar", "plural", "format_time")


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Parameters
    ----------
    file : str
        Path in the repository.
    place : int
        Number of the changed node, in the order of `ast.walk`.
    variant : int
        Which of the changes that this node can have.
    line : int
    where : str
        Name of the function or class.
    change : str
        Source before and after.
    """

    file: str
    place: int
    variant: int
    line: int
    where: str
    change: str

    @property
    def name(self) -> str:
        """The name that tells it from others, whatever lines are added elsewhere."""
        return f"{self.file}: {self.where}: {self.change}"

    @property
    def room(self) -> str:
        """Where it belongs."""
        return next(room for room, paths in ROOMS.items() if self.file.startswith(paths))


def changes(node: ast.AST) -> list[ast.AST]:
    """Return what a node may become."""
    found: list[ast.AST] = []
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        found += [_with(node, ops=[new()]) for new in _COMPARED[type(node.ops[0])]]
    elif isinstance(node, ast.BinOp | ast.AugAssign):
        if type(node.op) in _OPERATED:
            found.append(_with(node, op=_OPERATED[type(node.op)]()))
    elif isinstance(node, ast.BoolOp):
        found.append(_with(node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And()))
    elif isinstance(node, ast.UnaryOp) and not isinstance(node.op, ast.UAdd):
        found.append(node.operand)
    elif isinstance(node, ast.IfExp):
        found.append(_with(node, body=node.orelse, orelse=node.body))
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        found.append(_with(node, value=not node.value))
    elif isinstance(node, ast.Constant) and isinstance(node.value, int):
        found += [_with(node, value=node.value + 1), _with(node, value=node.value - 1)]
    elif isinstance(node, ast.Name) and node.id in _NAMES:
        found.append(_with(node, id=_NAMES[node.id]))
    elif isinstance(node, ast.Attribute) and node.attr in _NAMES:
        found.append(_with(node, attr=_NAMES[node.attr]))
    elif isinstance(node, ast.Constant) and node.value in ("left", "right"):
        found.append(_with(node, value="left" if node.value == "right" else "right"))
    return found


def _with(node: ast.AST, **fields: object) -> ast.AST:
    changed = copy.copy(node)
    for name, value in fields.items():
        setattr(changed, name, value)
    return changed


def _readable(node: ast.AST) -> bool:
    """Tell whether a node only makes a text that people read."""
    if isinstance(node, ast.JoinedStr | ast.Raise | ast.Assert | ast.arg):
        return True
    if isinstance(node, ast.Call):
        called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        return called in _WORDS
    return False


def nodes(tree: ast.Module) -> Iterator[tuple[int, ast.AST, str]]:
    """Yield all nodes that may change, with their number and the name of what they are in."""
    numbers = {id(node): number for number, node in enumerate(ast.walk(tree))}

    def inside(node: ast.AST, where: str) -> Iterator[tuple[int, ast.AST, str]]:
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "type_params"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and not _readable(child):
                    there = f"{where}.{child.name}".lstrip(".") if isinstance(child, _NAMED) else where
                    yield numbers[id(child)], child, there
                    yield from inside(child, there)

    return inside(tree, "")


_NAMED = (ast.FunctionDef, ast.ClassDef)


def mutants_of(root: Path, file: str) -> list[Mutant]:
    """Return all mutants of a file."""
    tree = ast.parse((root / file).read_text(encoding="utf-8"))
    found, times = [], Counter[str]()
    for number, node, where in nodes(tree):
        for variant, new in enumerate(changes(node)):
            text = f"{_short(node)} → {_short(new)}"
            times[f"{where}: {text}"] += 1
            nth = times[f"{where}: {text}"]
            text += f" #{nth}" * (nth > 1)
            found.append(Mutant(file, number, variant, getattr(node, "lineno", 0), where, text))
    return found


def _short(node: ast.AST) -> str:
    text = " ".join(ast.unparse(node).split())
    return text if len(text) <= 100 else f"{text[:97]}…"


def files(root: Path) -> list[str]:
    """Return all files that are mutated."""
    paths = [root / path for room in ROOMS.values() for path in room]
    found = [file for path in paths for file in (sorted(path.rglob("*.py")) if path.is_dir() else [path])]
    return [str(file.relative_to(root)) for file in found if file.name != "__init__.py"]


def sample(root: Path, n: int, seed: int) -> list[Mutant]:
    """Return so many mutants of all files, at random; whether one is among them hardly depends on
    what else there is.
    """
    everything = [mutant for file in files(root) for mutant in mutants_of(root, file)]
    chosen = sorted(everything, key=lambda mutant: hashlib.sha256(f"{seed} {mutant.name}".encode()).digest())[:n]
    return sorted(chosen, key=lambda mutant: (mutant.file, mutant.place, mutant.variant))


def mutated(root: Path, mutant: Mutant) -> ast.Module:
    """Return the syntax tree of the file with the change."""
    tree = ast.parse((root / mutant.file).read_text(encoding="utf-8"))
    old = next(node for number, node in enumerate(ast.walk(tree)) if number == mutant.place)
    new = changes(old)[mutant.variant]

    class Change(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST:
            return new if node is old else self.generic_visit(node)

    changed = Change().visit(tree)
    assert isinstance(changed, ast.Module)
    return ast.fix_missing_locations(changed)


def lines_of(mutants: Sequence[Mutant]) -> set[tuple[str, int]]:
    """Return the lines that they change."""
    return {(mutant.file, mutant.line) for mutant in mutants}
