"""Lists of methods, such as `s,m:average=10`, and what is left out of `all`."""

from collections.abc import Collection
from dataclasses import dataclass, field

from tachometry.cli.options.core import Make, Texts, own_texts
from tachometry.cli.options.option import message_of
from tachometry.spec import AUTO, METHODS, TachometerSpec, method_named


@dataclass(frozen=True)
class Methods:
    """Holds the methods of a list."""

    specs: dict[str, TachometerSpec | None]  # by name, in order; None for what is no method of a core
    # methods of `all` that are impossible with these options, and why
    left_out: dict[str, str] = field(default_factory=dict)


def named_methods(text: str, make: Make, others: Collection[str] = ()) -> Methods:
    """Return the methods of a list with commas, `all` being every method and all `others`.

    It raises ValueError if a name is not known, or a method that is named cannot be with its options.

    - `text`: Of names, a core's with options after a colon: `m:average=10`.
    - `others`: Names that are no methods of cores; what is behind a colon of such a name is not read here.
    """
    if text.strip() == "all":
        specs: dict[str, TachometerSpec | None] = {}
        wrong: dict[str, ValueError] = {}
        for name in METHODS:
            try:
                specs[name] = make(name, {})
            except ValueError as error:
                wrong[name] = error
        left_out = {name: message_of(error) for name, error in wrong.items()}
        return Methods(specs | dict.fromkeys(others), left_out)
    specs = {}
    for name, method, given in listed_methods(text, others):
        spec = None if method is None else make(method, given)
        specs[name if spec is None else shown_name(name, spec)] = spec
    return Methods(specs)


def shown_name(name: str, spec: TachometerSpec) -> str:
    """Return what a method of a list is called: the one that was taken, if none was named."""
    return spec.method if spec.chosen else name


def listed_methods(text: str, others: Collection[str] = ()) -> list[tuple[str, str | None, Texts]]:
    """Return the members of a list with commas: each with its method, None of `others`, and its options as given.

    It raises ValueError if a name is not known.
    """
    methods: list[tuple[str, str | None, Texts]] = []
    for name in (word.strip() for word in text.split(",")):
        word, *words = name.split(":")
        method = method_named(word)
        if method in METHODS or method == AUTO:
            methods.append((name, method, own_texts(method, words)))
        elif method in others:
            methods.append((name, None, {}))
        elif name == "all":
            raise ValueError(f"--methods must be all alone, or a list without it, not {text!r}")
        else:
            raise ValueError(f"--methods must be of {', '.join([AUTO, *METHODS, *others])}, or all, not {name!r}")
    return methods
