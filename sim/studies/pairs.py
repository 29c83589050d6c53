"""Configurations of every method in which every two options meet, and of many axes, as words of the command line.

The factors are the options that a method declares, with the values that these declare for tests. Pairs of values that
exclude each other are found by trying.
"""

from fractions import Fraction
from functools import cache
from importlib.metadata import version
from itertools import combinations, product
from operator import itemgetter

from tachometry.sim.build import cached_value, digest
from tachometry.spec import (
    AxesSpec,
    CoreSpec,
    STachometer,
    TachometerSpec,
    TrackTachometer,
    common_options,
    of_texts,
    own_options,
    spec_class,
)
from tachometry.spec.language.option import Option

_PPR = 500
_CLOCK_HZ = 48_000_000

Texts = dict[str, str]  # values of options by their names


@cache
def factors(method: str) -> dict[str, tuple[str, ...]]:
    """Return options of a method with the values that they take; the empty text leaves the option out.

    Values in words depend on the rest: `most - 20` fraction bits, 20 less than there can be; `needed - 2` bits of the
    velocity, two less than it can need, if no speed must fit; `some counts per tick`, about the speed of the motions;
    the `longest` minimum time. The maximum time is in ticks. An option that needs another is a value of that: `yes
    index-reset`, `yes edge-error 0.3`.
    """
    every = spec_class(method).facts.pairs_all
    common = {about.name: about.tested if every else about.tested[: about.few] for about in common_options()}
    own = {about.name: about.tested for about in own_options(method)}
    found = own | {name: values for name, values in common.items() if name not in own}
    known = _known(method)
    for name in [name for name in found if known[name].needs]:
        values = found.pop(name)
        if known[name].needs in found and values:
            flag = known[name].needs
            asked = "yes" if known[flag].flag else next(value for value in known[flag].tested if value)
            more = [f"{asked} {name}"] if known[name].flag else [f"{asked} {name} {value}" for value in values]
            # Where there are to be few values, the flag comes with the other option only.
            found[flag] = (*(value for value in found[flag] if every or value != "yes"), *more)
    possible = {
        name: tuple(value for value in values if _possible(method, {name: value})) for name, values in found.items()
    }
    return {name: values for name, values in possible.items() if len(values) > 1}


@cache
def apart(method: str) -> frozenset[frozenset[tuple[str, str]]]:
    """Return pairs of options with their values that cannot be together; an option that is left out goes with all."""
    found = set()
    for (one, its), (other, others) in combinations(factors(method).items(), 2):
        for pair in product(filter(None, its), filter(None, others)):
            row = dict(zip((one, other), pair, strict=True))
            if not _possible(method, row):
                found.add(frozenset(row.items()))
    return frozenset(found)


@cache
def rows(method: str) -> tuple[Texts, ...]:
    """Return values of all factors of a method, one row for each configuration."""
    from covertable import make

    never: dict[tuple[str, str], set[tuple[str, str]]] = {}
    for pair in apart(method):
        (one, its), (other, others) = sorted(pair)
        never.setdefault((one, other), set()).add((its, others))
    constraints = [
        {
            "operator": "fn",
            "requires": names,
            "evaluate": lambda row, names=names: itemgetter(*names)(row) not in never[names],
        }
        for names in never
    ]
    every = {name: list(values) for name, values in factors(method).items()}
    key = digest(every, sorted((names, sorted(pairs)) for names, pairs in never.items()), version("covertable"))
    return tuple(cached_value(key, lambda _: make(every, constraints=constraints)))


@cache
def configurations(method: str) -> tuple[tuple[str, ...], ...]:
    """Return words of the command line, for each configuration of a method."""
    return tuple(words_of(method, _texts(method, row)) for row in rows(method))


def words_of(method: str, texts: Texts) -> tuple[str, ...]:
    """Return the same options as words of the command line."""
    known = _known(method)
    words = ["--method", method]
    for name, text in texts.items():
        if known[name].flag:
            words.append(f"--{name}" if text == "yes" else f"--no-{name}")
        else:
            words += [f"--{name}", text]
    return tuple(words)


def spec_of(words: tuple[str, ...]) -> TachometerSpec:
    """Return the core that the command line makes of these words."""
    first, method, *rest = words
    assert first == "--method"
    known = _known(method)
    texts: Texts = {}
    each = iter(rest)
    for word in each:
        name = word.removeprefix("--")
        if name.startswith("no-") and name not in known:
            texts[name.removeprefix("no-")] = "no"
        else:
            texts[name] = "yes" if known[name].flag else next(each)
    return of_texts(method, texts)


def _axes_words(axes: int, tick: int, max_ticks: int, *more: str, method: str = "s") -> tuple[str, ...]:
    core = ("--ppr", "500", "--clock", "48000000", "--tick", f"{tick}clk", "--max-time", f"{tick * max_ticks}clk")
    return ("--method", method, *core, *more, "--axes", str(axes))


# Few and many axes, all slots taken and not, turns that fill the tick, and every option that many axes have.
AXES: tuple[tuple[str, ...], ...] = (
    _axes_words(8, 960, 20, "--max-speed", "1000rad/s"),
    (*_axes_words(5, 120, 3, "--max-speed", "10000rad/s", "--index", "--index-reset"), "--parallel"),
    _axes_words(3, 40, 2, "--decoding", "2", "--position-width", "8"),
    _axes_words(1, 63, 2048, "--no-cancel", "--index"),
    _axes_words(64, 960, 5, "--max-speed", "500rad/s", "--decoding", "1", "--frac-bits", "4", "--position-width", "48"),
    (*_axes_words(17, 1000, 4, "--frac-bits", "24", "--index", "--filter", "30", "--external-tick"), "--parallel"),
    (*_axes_words(5, 1440, 9, "--max-speed", "2000rad/s", "--unit", "rpm", method="track"), "--parallel"),
    _axes_words(2, 1920, 6, "--external-tick", "--filter", "9", "--index", "--electrical", "7", method="track"),
    _axes_words(3, 120, 4, "--unit", "rpm", "--velocity-width", "24", "--external-tick", "--filter", "5"),
)

# Cores of sensors that go with few options: teeth, and positions that are read.
_WHEEL = "--method s --ppr 12 --clock 48000000 --tick 96clk --max-time 960clk --sensor pulses --decoding 1"
_READ = "--clock 48000000 --sensor sampled --bits"
WHEELS = (
    (*_WHEEL.split(), "--teeth", "12-2"),
    (*f"--method m {_READ} 3+9 --tick 40clk --max-time 400clk --average 3 --external-tick --reverse".split(),),
    (*f"--method track {_READ} 17 --tick 1000clk --max-time 10000clk --period 128".split(),),
)


def core_of(words: tuple[str, ...]) -> CoreSpec:
    """Return the core that the command line makes of these words, which may be one of many axes."""
    if "--axes" not in words:
        return spec_of(words)
    place = words.index("--axes")
    alone = spec_of(words[:place])
    assert isinstance(alone, STachometer | TrackTachometer)
    return AxesSpec(tachometer=alone, axes=int(words[place + 1]), parallel="--parallel" in words)


def _possible(method: str, row: Texts) -> bool:
    try:
        of_texts(method, _texts(method, row))
    except ValueError:
        return False
    return True


@cache
def _known(method: str) -> dict[str, Option]:
    return {about.name: about for about in (*common_options(), *own_options(method))}


def _texts(method: str, row: Texts) -> Texts:
    """Return the options of a row, with numbers where it says what is special about them."""
    texts = {"ppr": str(_PPR), "clock": str(_CLOCK_HZ)}
    for name, value in row.items():
        first, _, more = value.partition(" ")
        other, _, given = more.partition(" ")
        if other in _known(method):
            texts |= {name: first, other: given or "yes"}
        elif value:
            texts[name] = value
    cycles, decoding = int(texts.get("tick", "960")), int(texts.get("decoding", "4"))
    longest = f"{cycles * int(texts.get('max-time', '500'))}clk"
    texts |= {"tick": f"{cycles}clk", "max-time": longest} if "tick" in texts else {"max-time": longest}
    if "min-time" in texts:
        texts["min-time"] = longest
    if "max-speed" in texts:
        counts = Fraction(9, 4) if cycles > 2 else Fraction(3, 4)
        if blanking := texts.get("blanking"):  # two edges of a line in a period
            counts = min(counts, Fraction(cycles * decoding, 2 * int(blanking)))
        texts["max-speed"] = f"{float(counts * _CLOCK_HZ / (cycles * _PPR * decoding))}rev/s"
    frac_bits, width = texts.pop("frac-bits", ""), texts.pop("velocity-width", "")
    if frac_bits:
        spec = of_texts(method, texts)
        fewest, most = spec.velocity.frac_bits_range(spec.unit)
        bits = max(fewest, most - _less(frac_bits)) if "-" in frac_bits else min(int(frac_bits), most)
        texts["frac-bits"] = str(bits)
    if width:
        # The greatest speed must fit.
        less = 0 if "max-speed" in texts else _less(width)
        texts["velocity-width"] = str(max(8, of_texts(method, texts).velocity.width - less))
    return texts


def _less(text: str) -> int:
    """Return how much less than the most: 20 of "most - 20"."""
    return int(text.split()[-1])
