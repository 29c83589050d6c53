"""The map of a disc in the core: each count is placed where its edge lies."""

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from tachometry.spec.core.disc import Disc
from tachometry.spec.core.extras.extra import Event, Extra
from tachometry.spec.core.front_end import FrontEnd, Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.formats.displacement import ENTRY_BITS, FINEST, Displacement
from tachometry.spec.formats.sectors import SLOPE_BITS, Sectors, sectors_of
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.port import TICK, Port, held, pin, strobe
from tachometry.spec.language.units import format_time

MOST_EDGES = 1 << 14  # eight block RAMs of ECP5
MOST_IN_SECTORS = 1 << 18
_LEAST_SECTORS, _SECTORS, _MOST_SECTORS = 4, 32, 256
SLIPS_BITS = 8  # of the number of slips, which stays at its end
UNKNOWN, SEEN, DOUBTFUL, SURE = range(4)  # trust in the place; bit 0: the map is used
_METHODS = ("t", "mt", "s", "track")
_DISC = """Map of the disc that tachometry calibrate has written. Each count is then placed where its edge lies. The \
map is used from the first index on. Without --index, or with --index-at edge, DISC_TURN must say where it lies."""
_TABLE = """Table of the map. edges has 8 bits for each edge, which a program may write; it is empty without --disc. \
sectors:N has a slope of 16 bits for each of up to N parts of a turn (32); without --disc a program writes it."""


@dataclass(frozen=True)
class DiscFile:
    """The map of a disc, and the file that it is read from."""

    path: str
    disc: Disc

    def __str__(self) -> str:
        return self.path


def parse_disc(what: str, text: str) -> DiscFile:
    """Read the map from the file of this name; ParameterError if it has none."""
    try:
        return DiscFile(text, Disc.read(Path(text)))
    except OSError as error:
        raise ParameterError(what, f"must be a file that can be read, not {text!r}: {error.strerror}") from error
    except ValueError as error:
        raise ParameterError(what, str(error)) from error


def _parse_table(what: str, text: str) -> str:
    form, _, number = text.partition(":")
    many = number.isascii() and number.isdigit() and len(number) < 4 and _LEAST_SECTORS <= int(number) <= _MOST_SECTORS
    if text in ("auto", "edges", "sectors") or (form == "sectors" and many):
        return text
    form = f"edges or sectors:N, N from {_LEAST_SECTORS} to {_MOST_SECTORS}"
    raise ParameterError(what, f"must be {form}, not {text}")


def _format(spec: Numbers, sectors: bool = False) -> Displacement:
    # `track` averages over many counts. Before the divider of T and M/T finer distances would need an adder more.
    finest = FINEST / (16 if sectors and spec.facts.update_by == "tick" else 1)
    per_count = spec.timing.tick_cycles if spec.facts.update_by == "count" else int(1 / finest)
    return Displacement(per_count, finest=finest)


def _steepest(entries: Sequence[int]) -> int:
    return max(abs(one - before) for before, one in pairwise([*entries[-1:], *entries]))


def _fits(spec: Any) -> bool:
    return spec.method in _METHODS


@dataclass(frozen=True, kw_only=True)
class DiscMap(Extra):
    """A table has the displacement of each edge, a counter follows the place in the turn, and an index checks it."""

    name = "disc"

    file: DiscFile | None = option(  # noqa: RUF009
        None, _DISC, name=name, metavar="FILE", shown="none", parse=parse_disc, fits=_fits, tests=(), tacit=True
    )
    table: str = option(
        "auto", _TABLE, name="disc-table", metavar="FORM", shown="edges", parse=_parse_table, fits=_fits,
        tests=("", "edges"), tacit=True, adds=True,
    )  # fmt: skip

    @property
    def writable(self) -> bool:
        """Whether a program may write the table."""
        return self.table == "edges" or (self.table != "auto" and self.file is None)

    def displacement(self, spec: Numbers) -> Displacement:
        if table := self.sectors(spec):
            form = _format(spec, sectors=True)
            if self.writable:
                most = max(2, spec.encoder.encoder_counts / 1024) / form.unit  # off centre by some 0.3 degrees
                return replace(form, entry_bits=1 + math.ceil(math.log2(most)))
            return replace(form, entry_bits=table.width, steepest=_steepest(table.displacements))
        known = self.file.disc.displacement if self.file else ()
        worst = max(0.99 * self.writable, *map(abs, known), 0)  # counts; what a program writes may be about 1
        form = _format(spec)
        form = replace(form, shift=max(0, math.ceil(math.log2(max(worst, 1e-9) / 127 / form.unit))))
        return form if self.writable else replace(form, steepest=_steepest(self._entries(spec, form)))

    def sectors(self, spec: Numbers) -> Sectors | None:
        """Return the table of sectors; None: it is one of edges. ParameterError if there can be none."""
        form, _, number = self.table.partition(":")
        if form != "sectors":
            return None
        try:
            if self.index_place(spec) is None:
                raise ValueError("must be edges without an index in a state of the lines: type --index")
            known, unit = self._known(spec), _format(spec, sectors=True).unit
            quarters = spec.facts.update_by != "tick" and len(known) % 4 == 0  # `track` learns them
            return sectors_of(known, int(number or _SECTORS), float(unit), quarters)
        except ValueError as error:
            raise ParameterError("disc_table", str(error)) from error

    def entries(self, spec: Numbers) -> tuple[int, ...]:
        """Return the table after configuration, as a program writes it."""
        lines = self.sectors(spec)
        return lines.entries if lines else self._entries(spec, self.displacement(spec))

    def _entries(self, spec: Numbers, form: Displacement) -> tuple[int, ...]:
        unit = float(form.unit)
        return tuple(round(each / unit) for each in self._known(spec))

    def _known(self, spec: Numbers) -> tuple[float, ...]:
        return self.file.disc.displacement if self.file else (0.0,) * spec.encoder.encoder_counts

    def entry_bits(self, spec: Numbers) -> int:
        """Return bits of an entry of the table, signed."""
        return SLOPE_BITS if self.sectors(spec) else ENTRY_BITS

    def index_place(self, spec: Numbers) -> int | None:
        """Return the place in the turn at which the index comes; None without one in a state of the lines."""
        encoder, front = spec.encoder, FrontEnd(spec, 0)  # without inputs of extras
        place = front.index_place
        if encoder.sensor != "quadrature" or encoder.decoding != 4:
            place = 0
        return None if front.index_state is None else (-place if encoder.reverse else place) % 4

    def edges_off(self, spec: Numbers) -> float | None:
        """Return counts RMS by which counts come off their places in spite of the map; None: no map is known."""
        if self.file is None:
            return None
        disc, lines, unit = self.file.disc, self.sectors(spec), float(self.displacement(spec).unit)
        table = lines.displacements if lines else self.entries(spec)
        left = math.dist([unit * each for each in table], disc.displacement) / math.sqrt(len(table))
        return math.hypot(left, disc.error, disc.jitter)

    def missing(self) -> Mapping[str, str]:
        return {"axes": "does not work with --axes", "loop": "does not work with --loop"}

    def check(self, spec: Numbers) -> None:
        encoder, place, disc = spec.encoder, self.index_place(spec), self.file and self.file.disc
        own = encoder.encoder_counts, encoder.decoding
        most = MOST_IN_SECTORS if self.table.startswith("sectors") else MOST_EDGES
        refusals = {
            f"must be of 2 to {most} counts per turn, not {own[0]}": not 2 <= own[0] <= most,
            "must be edges without --disc": disc is None and self.table == "auto",
            "does not work with --teeth": encoder.teeth is not None,
            "does not work with --bounds": spec.bounds and spec.facts.update_by != "count",
        }
        if disc:
            refusals |= {
                f"must be the map of this encoder, {own[0]} counts a turn with x{own[1]} decoding, not of "
                f"{disc.counts_per_rev} with x{disc.decoding}": (disc.counts_per_rev, disc.decoding) != own,
                f"must be measured {'with' if encoder.reverse else 'without'} --reverse, as the core counts": (
                    disc.reverse != encoder.reverse
                ),
                "must have an index: type tachometry calibrate with --index": place is not None
                and disc.index_place is None,
                f"must have the index at {place}, as --index-at, not {disc.index_place}: see tachometry calibrate": (
                    place not in (None, disc.index_place)
                ),
            }
        for why, refused in refusals.items():
            if refused:
                raise ParameterError(self.name if disc else "disc_table", why)

    def inputs(self, spec: Numbers) -> Iterable[tuple[str, str, Pin]]:
        def row(register: str, field: str, name: str, text: str, bits: int = 1) -> tuple[str, str, Pin]:
            port = pin(f"disc_{name}", f"{text} Synchronous to clk.", bits)
            return f"DISC_{register}", field, Pin(port, act=field in ("forget", "now", "write"))

        bits = (spec.encoder.encoder_counts - 1).bit_length()
        yield row("CONTROL", "bypass", "bypass", "The map is not used while this is high.")
        yield row("CONTROL", "forget", "forget", "Forgets the place in the turn, and with it the use of the map.")
        if self.index_place(spec) is None:
            yield row("TURN", "by", "turn_by", "Counts by which disc_turn moves the place, less than a turn.", bits)
            yield row("TURN", "now", "turn", "Moves the place by disc_turn_by of the next clock; the map is then used.")
        if self.writable:
            bits = (len(self.entries(spec)) - 1).bit_length()
            what = "Entry" if self.sectors(spec) else "Edge"
            yield row("ADDRESS", "edge", "address", f"{what} that disc_write writes, and disc_entry shows.", bits)
            yield row("DATA", "value", "data", "Entry that is written, signed.", self.entry_bits(spec))
            yield row("DATA", "write", "write", "Writes disc_data of the next clock, and forgets the place.")

    def ports(self, spec: Numbers) -> Iterable[Port]:
        yield held(TICK, "disc_used", help="The map of the disc is used. It also changes between ticks.")
        yield held(TICK, "disc_sure", help="The latest index was where the map expects it.")
        if self.index_place(spec) is not None:
            text = "Indices that were not where the map expects them, since they were cleared; 255 is the most."
            yield held(TICK, "disc_slips", SLIPS_BITS, help=text)
            yield strobe("disc_slip", "An index is not where the map expects it: counts were lost, or added.")
        if self.writable:
            text = "Entry of the table at disc_address. It also changes between ticks."
            yield held(TICK, "disc_entry", self.entry_bits(spec), signed=True, help=text)

    def events(self, spec: Numbers) -> Mapping[str, Event]:
        event = Event("An index was not where the map of the disc expects it.", ("disc_slip",))
        return {} if self.index_place(spec) is None else {"disc_slip": event}

    def entry(self, spec: Numbers) -> dict[str, Any]:
        unit, sectors = float(self.displacement(spec).unit), self.sectors(spec)
        table, size = self.entries(spec), self.entry_bits(spec) // 8
        content = b"".join((each % (1 << 8 * size)).to_bytes(size, "little") for each in table)
        return {
            "form": "sectors" if sectors else "edges", "entries": len(table), "counts_per_lsb": unit,
            "edges": spec.encoder.encoder_counts, "sectors": sectors and len(sectors.slopes) - 1,
            "quarters": bool(sectors and sectors.quarters), "bits": self.displacement(spec).entry_bits,
            "index_place": self.index_place(spec), "writable": self.writable,
            "sha256": hashlib.sha256(content).hexdigest() if self.file else None,
            "error_counts": self.file.disc.error if self.file else None,
        }  # fmt: skip

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        used = run.ticks.clock[run.ticks.disc_used]
        if not len(used):
            return "disc", "map not used"
        return "disc", f"map used from {format_time(spec.tick.seconds(int(used[0])))} on"
