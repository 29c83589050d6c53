"""Stands in for what the equations of `sim.theory` need of NumPy, in a browser, where there is none.

An array has one dimension and is a list. With another of its length, or with a number, it acts element by element.
Functions and members mean what those of NumPy mean; they are explained where they are not as general.
"""

import builtins
import contextlib
import math
import operator
from collections.abc import Callable, Iterable
from typing import Any

float64, int64, bool_ = float, int, bool


class ndarray(list[Any]):
    """Acts element by element, and is what `numpy.typing` names."""

    @property
    def shape(self) -> tuple[int]:
        """Its length."""
        return (len(self),)

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, list):
            return ndarray(value for value, chosen in zip(self, key, strict=True) if chosen)
        found = list.__getitem__(self, key)
        return ndarray(found) if isinstance(key, slice) else found

    def astype(self, kind: Callable[[Any], Any]) -> "ndarray":
        return ndarray(map(kind, self))

    def tolist(self) -> list[Any]:
        return list(self)

    def all(self) -> bool:
        return builtins.all(self)

    def any(self) -> bool:
        return builtins.any(self)


NDArray, ArrayLike = ndarray, Any  # the names of types of `numpy.typing`


def _by_element(function: Callable[..., Any]) -> Callable[..., Any]:
    def act(*values: Any) -> Any:
        lengths = {len(value) for value in values if isinstance(value, list)}
        if not lengths:
            return function(*values)
        (length,) = lengths
        rows = zip(*(value if isinstance(value, list) else [value] * length for value in values), strict=True)
        return ndarray(function(*row) for row in rows)

    return act


def _quotient(a: float, b: float) -> float:
    """Return a/b, which is infinite or not a number for b = 0."""
    return a / b if b else math.nan if a == 0 or math.isnan(a) else math.copysign(math.inf, a * math.copysign(1, b))


def _whole(function: Callable[[float], int]) -> Callable[..., Any]:
    return _by_element(lambda value: float(function(value)) if math.isfinite(value) else value)


def _operator(function: Callable[..., Any], *, reflected: bool = False) -> Callable[..., Any]:
    act = _by_element(function)
    return (lambda self, other: act(other, self)) if reflected else lambda self, *other: act(self, *other)


for _name in "add sub mul truediv floordiv mod pow and or gt ge lt le eq ne".split():
    _function = _quotient if _name == "truediv" else getattr(operator, f"__{_name}__")
    setattr(ndarray, f"__{_name}__", _operator(_function))
    setattr(ndarray, f"__r{_name}__", _operator(_function, reflected=True))
for _name, _function in (("neg", operator.neg), ("abs", operator.abs), ("invert", operator.not_)):
    setattr(ndarray, f"__{_name}__", _operator(_function))

floor, ceil, rint = _whole(math.floor), _whole(math.ceil), _whole(round)
minimum, maximum = _by_element(min), _by_element(max)
log2, sqrt, isnan = _by_element(math.log2), _by_element(math.sqrt), _by_element(math.isnan)
clip = _by_element(lambda value, low, high: min(max(value, low), high))
where = _by_element(lambda condition, a, b: a if condition else b)
abs = _by_element(operator.abs)


def asarray(values: Any, dtype: Callable[[Any], Any] | None = None) -> Any:
    """Return an array, or a number as it is."""
    if not isinstance(values, Iterable):
        return dtype(values) if dtype else values
    return ndarray(map(dtype, values)) if dtype else ndarray(values)


def all(values: Any) -> bool:
    return asarray(values).all() if isinstance(values, list) else bool(values)


def any(values: Any) -> bool:
    return asarray(values).any() if isinstance(values, list) else bool(values)


def full(length: int, value: Any) -> ndarray:
    return ndarray([value] * length)


def zeros(length: Any, dtype: Callable[[int], Any] = float) -> ndarray:
    return full(length[0] if isinstance(length, tuple) else length, dtype(0))


def ones_like(values: ndarray) -> ndarray:
    return full(len(values), 1.0)


def choose(which: ndarray, values: list[ndarray]) -> ndarray:
    return ndarray(values[number][place] for place, number in enumerate(which))


def atleast_1d(values: Any) -> ndarray:
    return values if isinstance(values, ndarray) else ndarray([values])


def concatenate(arrays: Iterable[list[Any]]) -> ndarray:
    return ndarray(value for array in arrays for value in array)


def unique(values: list[Any]) -> ndarray:
    return ndarray(sorted(set(values)))


def argmax(values: list[Any]) -> int:
    return values.index(max(values))


def nanmin(values: list[float]) -> float:
    return min(value for value in values if not math.isnan(value))


def nanmax(values: list[float]) -> float:
    return max(value for value in values if not math.isnan(value))


def geomspace(first: float, last: float, number: int) -> ndarray:
    inside = (first * (last / first) ** (place / (number - 1)) for place in range(1, number - 1))
    return ndarray([first, *inside, last])


def errstate(**_: str) -> contextlib.AbstractContextManager[None]:
    return contextlib.nullcontext()


class _Missing(type):
    """Stands for all else of NumPy, which constants of modules may be made of; to compute with it is refused."""

    def __getattr__(cls, name: str) -> "_Missing":
        if name.startswith("__"):
            raise AttributeError(name)
        return _Missing(f"{cls.__name__}.{name}", (), {})

    def __call__(cls, *_: object, **__: object) -> "_Missing":
        return cls


def _refuse(missing: _Missing, *_: object) -> None:
    raise ValueError(f"needs {missing.__name__}, which a browser does not have: type the command instead")


for _name in "iter len bool getitem add radd sub rsub mul rmul lt le gt ge eq".split():
    setattr(_Missing, f"__{_name}__", _refuse)
__getattr__ = _Missing("numpy", (), {}).__getattr__
