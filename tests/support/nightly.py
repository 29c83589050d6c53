"""The mark `nightly`: a case that takes seconds and shows on more what another shows, left to `make test-all`.

`make test` keeps every kind of check on the smallest case that shows it, as it must end in five minutes. A comment at
the mark says why the rest is enough. What breaks something on purpose is `nightly`, too: it asks what the tests notice,
not whether the product is right.

What only nightly cases notice, so that whoever changes these runs them:

- clocks that CXXRTL skips in a tracking core, or about a change of a loop's commands: tests/sim/engines/test_idle.py;
- the tracking datapath alone with external ticks as close as they may be: tests/hdl/methods/test_track.py;
- a wheel of which one tooth is missing, or a pair of twelve, in every bit: tests/hdl/front_end/test_tooth_wheel.py.
"""

from collections.abc import Iterable
from typing import Any

import pytest

nightly = pytest.mark.nightly


def only(short: Iterable[Any], cases: Iterable[Any]) -> list[Any]:
    """Return parameters of a test: all cases, of which `make test` has only these."""
    kept = list(short)
    return [case if case in kept else pytest.param(case, marks=nightly) for case in cases]


def only_rows(short: Iterable[tuple[Any, ...]], rows: Iterable[tuple[Any, ...]]) -> list[Any]:
    """Return rows of several parameters, of which `make test` has only these."""
    kept = list(short)
    return [row if row in kept else pytest.param(*row, marks=nightly) for row in rows]
