"""A tool that fails says many lines, of which one says why."""

import pytest

from tachometry.spec.language.tools import complaint


@pytest.mark.parametrize(
    ("said", "line"),
    [
        ("", ""),
        ("one\n\n  two \n", "two"),
        ("Info: no\nERROR: it is too big\nERROR: and too slow\n2 errors\n", "ERROR: it is too big"),
        ("begins\nmodel.cc:3: error: no\nmore\n", "model.cc:3: error: no"),
        ('Traceback (most recent call last):\n  File "a.py"\n    raise Error(error)\na.Error: so\n', "so"),
        (
            "Traceback (most recent call last):\nError: mmap\n\nCannot allocate memory (os error 12)",
            "Cannot allocate memory (os error 12); it needs some 5 GB of addresses, see ulimit -v",
        ),
        ("x" * 1000, "x" * 300),
    ],
)
def test_one_line_says_why(said: str, line: str) -> None:
    assert complaint(said) == line
