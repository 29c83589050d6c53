"""Which tests `make test` leaves to `make test-all`, as CI must end in time.

They are marked `long`: those that show on more cores, or for longer, what another test shows; and all that break
something on purpose (`mutant`, `caught` or `noticed` in their name), as these ask what the tests notice, not whether
the product is right.
"""

import re
from collections.abc import Iterable
from typing import Any

import pytest

long = pytest.mark.long


def is_long(item: pytest.Item) -> bool:
    """Whether a test breaks something on purpose, by its name."""
    return re.search("mutant|_caught$|_noticed$", item.name.partition("[")[0]) is not None


def only(short: Iterable[Any], cases: Iterable[Any]) -> list[Any]:
    """Parameters of a test, of which only some are short."""
    kept = list(short)
    return [case if case in kept else pytest.param(case, marks=long) for case in cases]
