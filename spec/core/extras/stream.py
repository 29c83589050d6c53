"""Stream: records of what the ports show, as AXI4-Stream."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from tachometry.spec.core.extras.extra import Extra
from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.language.option import REQUIRED, ParameterError, option
from tachometry.spec.language.port import STREAM, TICK, UPDATE, WHOLE, Port, held, pin

READY = f"{STREAM}_tready"
OVERRUNS_WIDTH = 16  # bits of the number of records that were dropped, which stays at its end
LOST = "lost"  # the first flag: records were dropped before this one
_WORD = 4  # bytes
_MOST_RECORDS = 1 << 16  # of a packet
_FINE = ("position_fine", "acceleration")  # of the ports that only a method has, these are in a record


@dataclass(frozen=True)
class Records:
    """When there are records."""

    when: str = "update"  # a record comes with every `update` of the velocity, `tick`, or `edge` that counts
    packet: int = 256  # records from one `tlast` to the next

    @classmethod
    def parse(cls, what: str, text: str) -> Self:
        """Read axi, axi:WHEN or axi:WHEN:N, such as axi:edge:1000; ParameterError if it is none of them."""
        found = re.fullmatch(r"axi(?::(update|tick|edge)(?::(\d{1,5}))?)?", text.strip().lower(), re.ASCII)
        if found is None or not 1 <= int(found[2] or 1) <= _MOST_RECORDS:
            form = f"must be axi, or axi: and update, tick or edge, and maybe :N, 1 to {_MOST_RECORDS} records a packet"
            raise ParameterError(what, f"{form}, such as axi:edge:1000, not {text!r}")
        return cls(found[1] or cls.when, int(found[2] or cls.packet))

    def __str__(self) -> str:
        return f"axi:{self.when}:{self.packet}"


@dataclass(frozen=True)
class Part:
    """A number of a record, little-endian."""

    name: str  # that of its port, but of `time` and `flags`
    width: int  # bits that it has; it is extended to whole words by its sign or by zeros
    offset: int  # bytes; a multiple of `size`
    signed: bool = True

    @property
    def size(self) -> int:
        """Bytes: one word or two."""
        return _WORD if self.width <= 8 * _WORD else 2 * _WORD


def size_of(parts: Sequence[Part]) -> int:
    """Return the bytes of a record, a power of two."""
    last = parts[-1]
    return 1 << (last.offset + last.size - 1).bit_length()


@dataclass(frozen=True, kw_only=True)
class Stream(Extra):
    """A record comes with each event; what comes while a record waits is dropped, and counted in `overruns`."""

    name = "stream"
    place = 1

    records: Records = option(  # noqa: RUF009
        REQUIRED,
        "AXI4-Stream m_axis of records for a DMA. A record has time, flags, position and velocity, and "
        "with track also the other outputs. It is sent with every update, or with every tick or edge as "
        "WHEN. tlast ends packets of N records, of 256 without N: axi:edge:1000.",
        name="stream",
        metavar="axi[:WHEN[:N]]",
        parse=Records.parse,
        tests=("", "axi:update:3", "axi:edge:2", "axi:tick:1"),
        tacit=True,
    )

    def missing(self) -> Mapping[str, str]:
        return {
            "axes": "must be left out with --axes: what sends records is for one axis",
            "demo": "must be left out of a demo, whose pins lead to no DMA",
            "rio": "must not be given for RIO, which has no DMA for it",
        }

    def parts(self, spec: Numbers) -> tuple[Part, ...]:
        """Return the fields of a record, without gaps: behind time and flags the numbers of two words come first."""
        found = [Part("time", 32, 0, signed=False), Part("flags", 32, _WORD, signed=False)]
        more = [(port.name, port.width) for port in spec.method_ports if port.name in _FINE]
        more = [("position", spec.position_width), ("velocity", spec.velocity.width), *more]
        for name, width in sorted(more, key=lambda number: number[1] <= 8 * _WORD):
            found.append(Part(name, width, found[-1].offset + found[-1].size))
        return tuple(found)

    def flags(self, spec: Numbers) -> tuple[str, ...]:
        """Return the bits of `flags`, the lowest first: `LOST`, and ports."""
        held = (port for port in spec.ports.outputs if port.held_by in (TICK, UPDATE, WHOLE) and not port.is_strobe)
        return (LOST, *(port.name for port in held if port.width == 1))

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        yield Pin(pin(READY, "The record is taken in this clock; synchronous to clk."), rest=1)

    def ports(self, spec: Numbers) -> Iterable[Port]:
        size = size_of(self.parts(spec))
        help = f"A record of {size} bytes, see stream.dtype of the manifest."
        yield Port(f"{STREAM}_tdata", "output", 8 * size, help=help)
        yield Port(f"{STREAM}_tvalid", "output", help="There is a record; it stays until it is taken.")
        yield Port(f"{STREAM}_tlast", "output", help="The record is the last one of its packet.")
        text = "Records that were dropped since one still waited; it stays at 65535. "
        text += "It also changes between ticks; a capture shows the present value."
        yield held(TICK, "overruns", OVERRUNS_WIDTH, unit="records", help=text)

    def entry(self, spec: Numbers) -> dict[str, Any]:
        parts = self.parts(spec)
        dtype = {
            "names": [part.name for part in parts],
            "formats": [f"<{'i' if part.signed else 'u'}{part.size}" for part in parts],
            "offsets": [part.offset for part in parts],
            "itemsize": size_of(parts),
        }
        flags = [*self.flags(spec)]
        return {"when": self.records.when, "packet": self.records.packet, "flags": flags, "dtype": dtype}

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        shown = "numpy.fromfile reads those of a DMA, with stream.dtype of the manifest"
        return "stream", f"records are not shown here: {shown}"
