"""The situations of `motions.toml`, in which methods are compared."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pages import data

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.spec.language.option import read_options
from tachometry.spec.language.units import parse_time

_DATA = data("motions")


@dataclass(frozen=True)
class Situation:
    """A row of the table of all situations."""

    name: str
    motion: str
    start: str  # errors before this time are left out
    faults: Mapping[str, str]  # of the encoder, by the options of the command line
    lines: int = 500  # of the encoder; every edge counts

    @property
    def start_s(self) -> float:
        """Errors before this time, in seconds, are left out."""
        return float(parse_time("start", self.start))

    @property
    def random(self) -> bool:
        """Whether seeds make a difference."""
        return bool({"jitter", "nonuniformity"} & self.faults.keys())

    @property
    def options(self) -> str:
        """The options of `tachometry compare`, without a seed and the core."""
        faults = "".join(f" --{name} {text}" for name, text in self.faults.items())
        lines = "" if self.lines == 500 else f"--ppr {self.lines} "
        return f'{lines}--motion "{self.motion}" --from {self.start}{faults}'

    def record(self, seed: int) -> Encoding:
        """Return what the encoder records, with a seed for all that is random."""
        encoder = VirtualEncoder(self.lines, **values_of(self.faults, seed))
        return encoder.record(parse_motion(self.motion))


def faults_of(words: str) -> dict[str, str]:
    """Return faults by their options; a word without a value names a set of them."""
    found: dict[str, str] = {}
    for word in words.split():
        name, _, text = word.partition("=")
        found |= {name: text} if text else faults_of(_DATA["faults"][name])
    return found


def values_of(faults: Mapping[str, str], seed: int) -> dict[str, Any]:
    """Return faults as parameters of `VirtualEncoder`."""
    return read_options(EncoderOptions, {**faults, "seed": str(seed)})


def _situations(kind: str) -> tuple[Situation, ...]:
    return tuple(Situation(**{**each, "faults": faults_of(each.get("faults", ""))}) for each in _DATA[kind])


REAL = faults_of("real")
SITUATIONS, OTHERS = _situations("situation"), _situations("other")
