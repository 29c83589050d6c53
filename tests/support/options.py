"""Options as far as a method has them."""

import re

from tachometry.spec import METHODS, ParameterError, of_texts


def had_by(method: str, texts: dict[str, str]) -> dict[str, str]:
    """Return the same options, without bounds if the method has none, and with a tick long enough for it.

    The tick, and the maximum time with it, is doubled until the method takes it.
    """
    texts = {name: text for name, text in texts.items() if name != "bounds" or METHODS[method].facts.bounds}
    while _is_short(method, texts):
        texts |= {name: _doubled(texts[name]) for name in ("tick", "max-time")}
    return texts


def _is_short(method: str, texts: dict[str, str]) -> bool:
    try:
        of_texts(method, texts)
    except ParameterError as error:
        if not error.brief.startswith("needs a tick"):
            raise
        return True
    return False


def _doubled(time: str) -> str:
    return re.sub(r"\d+", lambda number: str(2 * int(number[0])), time, count=1)
