"""Wrong cores for the proofs: the source of a box with one thing wrong, for each row of mutants.json.

A row has the entries of a `Mutant`, the box by its name.
"""

import importlib
import inspect
import json
import pkgutil
import sys
import types
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import tachometry.hdl
from tachometry.hdl.core.bus_tachometer import BRIDGES
from tachometry.hdl.methods import DATAPATHS


def modules() -> list[types.ModuleType]:
    """Return all modules of `hdl`."""
    found = pkgutil.walk_packages(tachometry.hdl.__path__, "tachometry.hdl.")
    return [importlib.import_module(one.name) for one in found]


@contextmanager
def mutant(box: Any, right: str, wrong: str) -> Iterator[None]:
    """Yield within this context, `right` in the source of the class `box` reads `wrong`, wherever the class is used.

    The text must stand in the source of its module exactly once.
    """
    modules()  # one loaded within would keep it
    module = sys.modules[box.__module__]
    source = inspect.getsource(module)
    assert source.count(right) == 1, f"{right!r} stands {source.count(right)} times in {module.__name__}"
    changed = types.ModuleType(module.__name__)
    exec(compile(source.replace(right, wrong), f"<mutant of {module.__file__}>", "exec"), changed.__dict__)
    with pytest.MonkeyPatch.context() as patch:
        for user in list(sys.modules.values()):
            if getattr(user, "__name__", "").startswith(("tachometry.", "tests.", "support.")) or user is module:
                for name, value in list(vars(user).items()):
                    if value is box:
                        patch.setattr(user, name, getattr(changed, box.__name__))
        tables: tuple[dict[str, Any], ...] = (DATAPATHS, BRIDGES)
        for table in tables:
            for method, used in table.items():
                if used is box:
                    patch.setitem(table, method, getattr(changed, box.__name__))
        yield


@dataclass(frozen=True)
class Mutant:
    """`right` in the source of `box` made `wrong`: violates `refuted` within `steps` clocks in the proof's core."""

    proof: str
    refuted: str
    box: Any
    right: str
    wrong: str
    steps: int = 24


# Extras have boxes of one name: theirs are `over_speed.Gates` and so on.
_BOXES = {
    key: box
    for module in modules()
    for name, box in vars(module).items()
    if getattr(box, "__module__", None) == module.__name__
    for key in (name, f"{module.__name__.rpartition('.')[2]}.{name}")
}
MUTANTS = [
    Mutant(proof, refuted, _BOXES[box], *change)
    for proof, refuted, box, *change in json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
]
