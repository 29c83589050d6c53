"""Scripts of bench/, which are in no package."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

FOLDER = Path(__file__).parents[2] / "bench"
sys.path.append(str(FOLDER))  # they take from their neighbours


def load(name: str) -> ModuleType:
    """Return bench/NAME.py as a module."""
    file = FOLDER / f"{name}.py"
    described = importlib.util.spec_from_file_location(f"bench_{name}", file)
    assert described is not None
    assert described.loader is not None
    module = importlib.util.module_from_spec(described)
    sys.modules[module.__name__] = module  # dataclasses look their module up
    described.loader.exec_module(module)
    return module
