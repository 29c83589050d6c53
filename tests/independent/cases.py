"""The cores of cases.toml: every option of every method, every unit, and the ends of every range."""

import tomllib
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from reference.settings import Settings

_PLAIN = {"ppr": "500", "clock": "1000000Hz"}


@dataclass(frozen=True)
class Case:
    """A core, and what its motion must keep from.

    - `clocks`: Length of the motion; a rest of three times the maximum time follows.
    - `least`, `turns`, `within`: See `stimulus.motion`.
    - `seed`: Of its random numbers; the name if it is empty.
    """

    name: str
    settings: Settings
    clocks: int
    least: int = 1
    turns: bool = True
    within: int = 0
    seed: str = ""


def parameters(cases: Iterable[Case], nightly: Container[str] = ()) -> list[Any]:
    """Return cases as parameters of a test; those of the names in `nightly` are only in `make test-all`."""
    mark = pytest.mark.nightly
    return [pytest.param(case, id=case.name, marks=mark if case.name in nightly else ()) for case in cases]


_DATA = tomllib.loads(Path(__file__).with_name("cases.toml").read_text(encoding="utf-8"))
_MORE: dict[str, str] = _DATA["more"]


def _case(name: str, words: str, clocks: int = 6000, **motion: Any) -> Case:
    """Return a case of words such as `tick=40 index=yes`; its name begins with that of the method."""
    for one in ("ALL", "PORTS"):
        words = words.replace(one, _MORE[one])
    given = dict(word.split("=") for word in words.split())
    return Case(name, Settings(name.split("_")[0], {**_PLAIN, **given}), clocks, **motion)


CASES, DESCRIBED, LONG = (
    [_case(name, **about) for name, about in _DATA[group].items()] for group in ("cases", "described", "long")
)
# Cores with a tick of 50 clocks and a maximum time of 10 ticks, which test_silence.py plays more on.
SILENT = [case for case in CASES if case.name.endswith("_native") or case.name == "mt_lattice"]
