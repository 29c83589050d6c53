"""Mutants: the source of a box with one thing wrong, to show that a test would notice."""

import importlib
import inspect
import pkgutil
import sys
import types
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

import tachometry.hdl
from tachometry.hdl.core.bus_tachometer import BRIDGES
from tachometry.hdl.methods import DATAPATHS
from tachometry.sim.golden.methods import MODELS


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
        tables: tuple[dict[str, Any], ...] = (DATAPATHS, MODELS, BRIDGES)
        for table in tables:
            for method, used in table.items():
                if used is box:
                    patch.setitem(table, method, getattr(changed, box.__name__))
        yield
