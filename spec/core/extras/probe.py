"""Probes: inputs that latch the position at their edges."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from tachometry.spec.core.extras.extra import Event, Extra
from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.language.field import Draft, Field
from tachometry.spec.language.option import REQUIRED, ParameterError, option
from tachometry.spec.language.port import FINE, TICK, Port, held, pin, strobe
from tachometry.spec.language.units import plural

MOST_PROBES = 8
TIME_WIDTH = 32  # bits of the time since a count, at most
RISING, FALLING = 1, 2  # bits of the edges that latch
_EDGES = {"rising": RISING, "falling": FALLING, "both": RISING | FALLING}


def parse_probes(what: str, text: str) -> str:
    """Return the edges of each probe, with commas between, of these or of a number of probes that latch rises.

    It raises ParameterError if it is neither, or there are none or too many.
    """
    word = text.strip().lower()
    few = word.isascii() and word.isdecimal() and len(word) < 3
    edges = ["rising"] * int(word) if few else [each.strip() for each in word.split(",")]
    if not 1 <= len(edges) <= MOST_PROBES or not set(edges) <= set(_EDGES):
        form = f"must be a number of probes from 1 to {MOST_PROBES}, or the edges of each, such as rising,falling,both"
        raise ParameterError(what, f"{form}, not {text!r}")
    return ",".join(edges)


def packed(edges: Iterable[int]) -> int:
    """Return the edges of all probes as one number, with two bits for each probe, the first lowest."""
    return sum(each << 2 * number for number, each in enumerate(edges))


@dataclass(frozen=True, kw_only=True)
class Probe(Extra):
    """Each probe latches the position and the time since the last count at an edge, and waits until it is armed again.

    An edge at a pin is in `probe_valid_N` `pin_to_probe` clocks later, with all counts up to the clock of the edge.
    """

    name = "probe"
    place = -1

    probes: str = option(
        REQUIRED,
        "Latch the position at edges of N inputs probe, 1 to 8. The time since the last count is latched "
        "as well, with method track also the fine position. The rising edge counts; EDGES such as "
        "rising,falling,both has the edge of each input. A probe waits until it is armed again.",
        name="probe",
        metavar="[N|EDGES]",
        shown="none",
        parse=parse_probes,
        tests=("", "3", "both"),
        tacit=True,
    )

    @property
    def edges(self) -> tuple[int, ...]:
        """Edges at which each probe latches, in bits `RISING` and `FALLING`."""
        return tuple(_EDGES[edge] for edge in parse_probes("probe", self.probes).split(","))

    @property
    def packed_edges(self) -> int:
        """`edges` as one number, see `packed`."""
        return packed(self.edges)

    @property
    def lines(self) -> tuple[str, ...]:
        """Names of the probe inputs, each a bit of `probe`."""
        return tuple(f"probe_{number}" for number in range(len(self.edges)))

    def time_width(self, spec: Numbers) -> int:
        """Return the bits of the time from a count to a probe."""
        return min(spec.times.longest.bit_length(), TIME_WIDTH)

    def fine(self, spec: Numbers) -> Port | None:
        """Return the port of the fine position, with a method that has one."""
        return next((port for port in spec.method_ports if port.name == FINE), None)

    def age_width(self, spec: Numbers) -> int:
        """Return the bits of the time from the end of a period whose update is shown to a probe."""
        return (spec.tick.longest + spec.latency.tick_to_update + 2).bit_length()

    def missing(self) -> Mapping[str, str]:
        return {
            "axes": "must be left out with --axes: what latches is for one axis",
            "sampled": "must be left out with an encoder that is read: it needs edges",
            "demo": "must be left out of a demo, which emulates an encoder and no probe",
        }

    def check(self, spec: Numbers) -> None:
        parse_probes("probe", self.probes)

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        probes = len(self.lines)
        yield Pin(pin("probe", "Probe inputs, asynchronous; their edges latch the position.", probes), self.lines)
        text = "Arms probes, each while its bit is high, for the clocks after; synchronous to clk. After reset all are."
        yield Pin(pin("probe_arm", text, probes), rest=(1 << probes) - 1, act=True)

    def ports(self, spec: Numbers) -> Iterable[Port]:
        text = "Probes that have latched and are not armed again. It changes between the ticks as well."
        yield held(TICK, "probed", len(self.lines), help=text)
        for number in range(len(self.lines)):
            yield strobe(valid := f"probe_valid_{number}", f"One clock for every position that probe {number} latches.")
            text = f"Position at the latched edge of probe {number}, with a count of the same clock."
            yield held(valid, f"probe_position_{number}", spec.position_width, signed=True, unit="counts", help=text)
            text = f"Clocks from the last count to the latched edge of probe {number}; it stays at its end."
            yield held(valid, f"probe_time_{number}", self.time_width(spec), unit="clocks", help=text)
            if (fine := self.fine(spec)) is None:
                continue
            text = f"Fine position that was shown when probe {number} latched: that of the end of a sampling period."
            yield held(valid, f"probe_fine_{number}", fine.width, signed=True, unit=fine.unit, help=text)
            text = f"Clocks from the end of that period to the latched edge of probe {number}; all ones: there was "
            yield held(valid, f"probe_age_{number}", self.age_width(spec), unit="clocks", help=text + "none.")

    def registers(self, spec: Numbers) -> Iterable[Draft]:
        probes = len(self.lines)
        arms = Field("arm", probes, help="A bit for each probe.", writable=True, single=True, port="probe_arm")
        yield "PROBE_ARM", "Writing 1 arms a probe: it latches at its next edge.", (arms,), {}
        text = "Two bits for each probe, the first lowest: 1 rises, 2 falls, 3 both, 0 none."
        edges = Field("edges", 2 * probes, help=text, writable=True, reset=self.packed_edges, port="probe_edges")
        yield "PROBE_EDGES", "Edges at which probes latch.", (edges,), {}

    def events(self, spec: Numbers) -> Mapping[str, Event]:
        valid = tuple(f"probe_valid_{number}" for number in range(len(self.lines)))
        return {"probe": Event("A probe has latched a position.", valid)}

    def latency(self, spec: Numbers) -> Mapping[str, int]:
        return {"pin_to_probe": spec.latency.pin_to_count + spec.latency.tick}

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        found = [
            (int(clock), int(position), number)
            for number in range(len(self.lines))
            for table in [run.tables[f"probe_valid_{number}"]]
            for clock, position in zip(table.clock, table[f"probe_position_{number}"], strict=True)
        ]
        last = "" if not found else ", the last that of probe {2} at position {1}".format(*max(found))
        return "probes", f"latched {plural(len(found), 'time')}{last or ': --pulse probe_0:20ms lets one see an edge'}"
