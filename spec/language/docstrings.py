"""Docstrings of classes that have parameters of their bases."""

import inspect
import re

_SECTION = re.compile(r"\n\nParameters\n-{10}\n(.*?)(?=\n\n\w+\n-{3,}|\Z)", re.DOTALL)


def with_inherited(own: str | None, base: str | None) -> str | None:
    """Return a docstring, with the parameters of another behind its own; one that both have is told as its own."""
    text, above = inspect.cleandoc(own or ""), _SECTION.search(inspect.cleandoc(base or ""))
    if not text or above is None:
        return own
    here = _SECTION.search(text)
    if here is not None:
        own_names = _entries(here[1])
        more = [entry for name, entry in _entries(above[1]).items() if name not in own_names]
        return "\n".join([text[: here.end()], *more]) + text[here.end() :]
    end = re.search(r"\n\n\w+\n-{3,}|\Z", text)
    assert end is not None
    return text[: end.start()] + above[0] + text[end.start() :]


def _entries(parameters: str) -> dict[str, str]:
    """Return entries of a section by the names that they begin with."""
    return {entry.split(" : ")[0]: entry for entry in re.split(r"\n(?=\S)", parameters)}
