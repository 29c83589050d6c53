"""Parameters of a base class in the docstring of a class."""

from dataclasses import fields

import pytest

from tachometry.spec import METHODS
from tachometry.spec.language.docstrings import with_inherited

BASE = """A base.

    Parameters
    ----------
    one : int
        The first.
    two : str
        The second.

    Raises
    ------
    ValueError
        Never.
    """
OWN = "What it is.\n\nParameters\n----------\nthree : int\n    The third."
NONE = "What it is."
RAISES = "\n\nRaises\n------\nKeyError\n    At times."
OF_BASE = "one : int\n    The first.\ntwo : str\n    The second."


@pytest.mark.parametrize("after", ["", RAISES])
def test_parameters_of_the_base_follow_its_own(after: str) -> None:
    assert with_inherited(OWN + after, BASE) == f"{OWN}\n{OF_BASE}{after}"


@pytest.mark.parametrize("after", ["", RAISES])
def test_a_parameter_that_both_have_is_told_as_its_own(after: str) -> None:
    own = f"{OWN}\ntwo : float\n    Another second."
    assert with_inherited(own + after, BASE) == f"{own}\none : int\n    The first.{after}"


@pytest.mark.parametrize("after", ["", RAISES])
def test_a_class_without_parameters_has_those_of_the_base(after: str) -> None:
    assert with_inherited(NONE + after, BASE) == f"{NONE}\n\nParameters\n----------\n{OF_BASE}{after}"


@pytest.mark.parametrize("own", [None, "", OWN])
@pytest.mark.parametrize("base", [None, "", "A base without parameters."])
def test_without_parameters_of_a_base_the_docstring_stays(own: str | None, base: str | None) -> None:
    assert with_inherited(own, base) == own


@pytest.mark.parametrize("own", [None, "", "   "])
def test_a_class_without_a_docstring_gets_none(own: str | None) -> None:
    assert with_inherited(own, BASE) == own


def test_parameters_of_all_cores_are_in_the_docstring_of_each() -> None:
    for made in METHODS.values():
        for one in fields(made):
            assert f"\n{one.name}" in (made.__doc__ or "") or f", {one.name}" in (made.__doc__ or ""), (made, one.name)
