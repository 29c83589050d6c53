"""The incremental encoder, or another sensor of motion."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Any

from tachometry.spec.core.chips import CHIPS, SpiReads
from tachometry.spec.core.reads import BISS_CRC, Reads
from tachometry.spec.core.sampled import Sampled, parse_bits
from tachometry.spec.core.sensors import KINDS, READ, Sensor
from tachometry.spec.core.tformat import MOST_BITS, RATES, TformatReads
from tachometry.spec.core.tooth_wheel import parts_of
from tachometry.spec.language.option import Option, ParameterError, check_options, option, parse_whole
from tachometry.spec.language.units import parse_frequency, parse_time

_MOST = 1 << 24  # counts
_INVERTIBLE = ("a", "b", "c", "z")
_FASTEST_LINE = 10_000_000  # Hz
_SERIAL = ("ssi", "biss")
_MASTERS = (*_SERIAL, "spi", "tformat")
# Options that only some sensors have.
_OF_SENSORS = {
    "bits": tuple(READ),
    "sample_age": ("sampled",),
    "zero": tuple(READ),
    "chip": ("spi",),
    "encoder_clock": _MASTERS,
    "line_delay": _MASTERS,
    "crc": ("biss", "sampled"),
    "gray": _SERIAL,
    "repeat": ("ssi",),
}
_OF_TURN: dict[str, Any] = {"metavar": "N", "parse": parse_whole}


def _of_counts(what: str, text: str, known: Mapping[str, Any]) -> int:
    sensor = KINDS.get(known["sensor"], KINDS["quadrature"])
    counts, decoding = parse_whole(what, text), int(known["decoding"] or sensor.decodings[0])
    if not decoding <= counts <= _MOST:
        raise ParameterError(what, f"must be from {decoding} to {_MOST}, not {counts}")
    if counts % decoding:
        raise ParameterError(
            what,
            f"must be a multiple of {decoding}, the counts of a line, not {counts}: for {counts} cycles, as some data "
            f"sheets have it, type --lines {counts}",
        )
    return counts // decoding


def _pole_pairs(what: str, text: str, known: Mapping[str, Any]) -> int:
    if known["sensor"] != "hall":
        raise ParameterError(what, "must be given with --sensor hall or together with --lines: type --lines")
    return parse_whole(what, text)


def _factor(what: str, text: str) -> int:
    factors = {form.format(factor): factor for factor in (1, 2, 4, 6) for form in ("{}", "x{}", "{}x")}
    if (word := text.strip().lower()) not in factors:
        raise ParameterError(what, f"must be 1, 2 or 4, or x1, x2 or x4, not {text!r}")
    return factors[word]


def _inverted(what: str, text: str) -> str:
    listed = [name.strip().lower() for name in text.split(",")]
    names = {*listed}
    if wrong := sorted(names - {*_INVERTIBLE}):
        raise ParameterError(what, f"must be of {', '.join(_INVERTIBLE)}, with commas between, not {wrong[0]!r}")
    if len(names) < len(listed):
        raise ParameterError(what, f"must have each line once, not {text!r}")
    return ",".join(name for name in _INVERTIBLE if name in names)


def _ratio(what: str, text: str) -> str | None:
    match = re.fullmatch(r"0*([1-9]\d{0,7})(?:/0*([1-9]\d{0,7})|\.(\d{1,7}))?", text.replace(" ", ""), re.ASCII)
    if match is None:
        raise ParameterError(what, f"must be turns of the encoder for one of the shaft, as 7/4 or 1.75, not {text!r}")
    ratio = Fraction(int(match[1]), int(match[2] or 1)) + Fraction(f"0.{match[3] or 0}")
    return None if ratio == 1 else str(ratio)


def _teeth(what: str, text: str) -> str:
    pattern = re.sub(r"\s", "", text)
    if not parts_of(pattern):
        rules = "at most 4 missing in a row, 4 gaps, and 3 teeth in a row somewhere"
        rest = f"must be a full wheel less its gaps, as 60-2 or 36-2-2-2, or 24+1: {rules}, not {text!r}"
        full = f": for a full wheel leave it out, and type --ppr {pattern}" if pattern.isdigit() else ""
        raise ParameterError(what, rest + full)
    return pattern


# Polynomials of 8, 16, 24 and 32 bits as many write them, without the highest term.
_SHORT = "0x(0[0-9a-f]{1,7}|1d|2f|31|97|9b|d5|1021|3d65|8005|8bb7|90d9|864cfb|1edc6f41)"


def _polynomial(what: str, text: str) -> str:
    word = text.strip().lower()
    if word == "none":
        return word
    if re.fullmatch(_SHORT, word):
        right = f"0x1{word[2:]} of {4 * len(word) - 8} bits"
        raise ParameterError(what, f"must begin with its highest term, as {right}, not {text!r}")
    if not re.fullmatch(r"0x[0-9a-f]{1,9}", word) or not 1 << 3 <= int(word, 16) < 1 << 33 or not int(word, 16) & 1:
        raise ParameterError(what, f"must be none, or a polynomial of degree 3 to 32, as 0x43, not {text!r}")
    return hex(int(word, 16))


# Of options of an encoder that is read.
_READ: dict[str, Any] = {"fits": lambda spec: bool(spec.facts.takes_reads), "tests": (), "tacit": True}

_CPR = "Counts per revolution, after decoding (instead of --ppr). 2500 lines have 10000."
_POLE_PAIRS = """Pole pairs of the motor. With --sensor hall instead of --ppr: the halls have as many periods in a \
turn. Together with --lines, --ppr or --cpr it is --electrical."""
_DECODING = """Counts per pulse. 4 (or x4) counts every edge, 2 both edges of A, 1 the edges of A while B is low. With \
--sensor pulses or step-dir 2 counts every edge of A, 1 the rises: the default is 2 of pulses, 1 of steps. Up/down \
always has 1, a period of halls 6."""
_INVERT = "Lines that are inverted: a, b, c, z, with commas between."
_RATIO = """Turns of the encoder in a turn of the shaft, as 10/9 or 1.75. Speeds, angles and plans are the shaft's; \
--ppr, positions in counts and the index are the encoder's."""
_TEETH = """Teeth of a crank wheel, as 60-2, 36-2-2-2 or 24+1, one extra. It needs --sensor pulses and --ppr N. Gaps \
are evenly spread, or listed with the teeth before them, as 15-2,3-2,18-2; the core takes any. Missing teeth count \
where they would be once the place is known, extra ones do not. With --index the first tooth after the gap, after the \
longest row of teeth, or after the extra tooth is the index, and there is no pin z. Output synced is high while the \
pattern is in its place."""
_BITS = "Bits of a sampled position (instead of --ppr). M+B: M of turns and B of a turn, as 12+17, or B alone."
_SAMPLE_AGE = """Age of each sampled position, in clocks. It is the time since the shaft was there; without it, input \
sample_age has it."""
_ZERO = "Position of an encoder that is read, in LSB, which is 0. On a bus register ZERO begins with it."
_LINE_DELAY = """Delay of the lines to an encoder and back. With ssi and spi each bit is read this much later; biss \
and tformat measure it in every frame, and simulations take it."""
_CRC = """Polynomial of the CRC of biss, with its highest term. It begins with 0 and is sent inverted. With none, \
which sampled may have too, nothing checks a frame: track lets a read that is far off wait for the next one."""


@dataclass(frozen=True)
class Encoder:
    """An incremental encoder, or another sensor of motion, and how its edges are counted.

    A value out of range raises ParameterError.
    """

    _group = "Encoder"
    pulses_per_rev: int = option(
        None,
        "Pulses per revolution: periods of line A in one turn. The data sheet of the encoder has it.",
        name="ppr",
        metavar="N",
        parse=parse_whole,
        also=(
            Option("Lines of the disc: pulses per revolution (instead of --ppr).", name="lines", **_OF_TURN),
            Option(_CPR, name="cpr", parse_at=_of_counts, **_OF_TURN),
            Option(_POLE_PAIRS, name="pole-pairs", parse_at=_pole_pairs, **_OF_TURN),
        ),
    )
    decoding: int = option(None, _DECODING, parse=_factor, shown="4", metavar="[4|2|1]", tests=("", "2", "1"))
    sensor: str = option(
        "quadrature",
        "Kind of the encoder, as quadrature, pulses, hall or biss. quadrature: A and B. pulses: A alone, of "
        "a tooth wheel, fan or flow meter, always forward. step-dir: each rise of A is a step, with --decoding 2 "
        "each edge, forward while B is high. up-down: each rise of A counts up, each rise of B down. hall: A, B "
        "and C of a motor, 120 electrical degrees apart. sampled: an absolute position of --bits, read once a "
        "tick. ssi, biss, spi, tformat: such a position, read by the core itself from an encoder with SSI, "
        "BiSS-C, SPI or T-format.",
        metavar="KIND",
        choices=tuple(KINDS),
        tests=("", "hall", "pulses", "step-dir", "up-down"),
        tacit=True,
    )
    reverse: bool = option(False, "Reverse the direction of counting.", tacit=True)
    invert: str | None = option(None, _INVERT, metavar="LINES", parse=_inverted, tests=("", "a"), tacit=True)
    ratio: str | None = option(None, _RATIO, shown="1", metavar="N/M", parse=_ratio, tests=(), tacit=True)
    teeth: str | None = option(None, _TEETH, metavar="PATTERN", parse=_teeth, tests=(), tacit=True)
    bits: str | None = option(None, _BITS, metavar="M+B", parse=parse_bits, **_READ)
    sample_age: int | None = option(None, _SAMPLE_AGE, metavar="N", parse=parse_whole, **_READ)
    zero: int | None = option(None, _ZERO, metavar="N", parse=parse_whole, **_READ)
    chip: str | None = option(
        None, "Chip of an encoder with spi. as5047p answers a tick late.", choices=tuple(CHIPS), **_READ
    )
    encoder_clock: int | None = option(
        None,
        "Clock of an encoder that is read, at most 10 MHz. It is rounded down to an even number of clocks. amt22 has "
        "at most 2 MHz, tformat 2.5 or 5 MHz, the bits of a second.",
        shown="1MHz of ssi and amt22, 5MHz of biss and as5047p, 2.5MHz of tformat",
        metavar="FREQUENCY",
        parse=parse_frequency,
        **_READ,
    )
    line_delay: Fraction | None = option(  # noqa: RUF009
        None, _LINE_DELAY, shown="0", metavar="TIME", parse=parse_time, **_READ
    )
    crc: str | None = option(
        None, _CRC, shown="0x43, which is x^6 + x + 1", metavar="[POLY|none]", parse=_polynomial, **_READ
    )
    gray: bool = option(False, "The encoder sends Gray code.", **_READ)
    repeat: bool = option(
        False, "Read an encoder with ssi twice, and take equal reads only. It must repeat its position.", **_READ
    )

    def __post_init__(self) -> None:
        check_options(self)
        self._check_sampled()
        if self.decoding is None:
            object.__setattr__(self, "decoding", 1 if self.teeth else self.kind.decodings[0])
        self._check_decoding()
        if not 1 <= self.encoder_counts <= _MOST:
            raise ParameterError(
                "pulses_per_rev",
                f"must be from 1 to {_MOST // self.decoding} with x{self.decoding} decoding, not {self.pulses_per_rev}",
            )
        if self.ratio is not None and not 1 <= self.counts_per_rev <= _MOST:
            rest = f"must make from 1 to {_MOST} counts in a turn of the shaft, not {float(self.counts_per_rev):.6g}"
            raise ParameterError("ratio", rest)
        if wrong := sorted(self.inverted - {*self.kind.lines, "z"}):
            lines = ", ".join((*self.kind.lines, "z"))
            raise ParameterError("invert", f"must be of {lines} for {self.sensor}, not {wrong[0]}")
        if self.teeth:
            self._check_teeth(parts_of(_teeth("teeth", self.teeth)))

    def _check_sampled(self) -> None:
        for name, sensors in _OF_SENSORS.items():
            if self.sensor not in sensors and getattr(self, name) not in (None, False):
                raise ParameterError(name, f"must be given with --sensor {' or '.join(sensors)}, not {self.sensor}")
        if self.sensor not in READ:
            if self.pulses_per_rev is None:
                raise ParameterError("ppr", "must be given, or --lines, or --cpr, or --pole-pairs")
            return
        if self.sensor == "spi" and self.chip is None:
            raise ParameterError("chip", f"must be given with --sensor spi: {' or '.join(CHIPS)}")
        if self.bits is None:
            rest = f"must be given with --sensor {self.sensor}, as 17, or 12+17 with 12 of turns"
            raise ParameterError("bits", rest)
        object.__setattr__(self, "bits", parse_bits("bits", self.bits))
        if self.sensor == "sampled" and self.crc not in (None, "none"):
            raise ParameterError("crc", f"must be none or left out with --sensor sampled, not {self.crc}")
        counts = 1 << Sampled.of(self.bits, self.sample_age).bits
        if self.pulses_per_rev not in (None, counts):
            rest = f"must be left out with --sensor {self.sensor}, not {self.pulses_per_rev}: type --bits"
            raise ParameterError("ppr", rest)
        object.__setattr__(self, "pulses_per_rev", counts)
        self._check_master(Sampled.of(self.bits, None))

    def _check_master(self, sampled: Sampled) -> None:
        fastest, hertz = CHIPS[self.chip].fastest_hz if self.chip else _FASTEST_LINE, self.encoder_clock
        if hertz is not None and not 1 <= hertz <= fastest:
            raise ParameterError("encoder_clock", f"must be from 1 Hz to {fastest // 10**6} MHz, not {hertz} Hz")
        if self.chip and (sampled.turn_bits or sampled.bits not in CHIPS[self.chip].bits):
            allowed = " or ".join(map(str, sorted(CHIPS[self.chip].bits)))
            raise ParameterError("bits", f"must be {allowed} for {self.chip}, not {self.bits}")
        if self.sensor == "tformat":
            if hertz not in (None, *RATES):
                raise ParameterError("encoder_clock", f"must be 2.5MHz or 5MHz for tformat, not {hertz} Hz")
            if sampled.turn_bits > MOST_BITS:
                raise ParameterError("bits", f"must be at most {MOST_BITS} of turns for tformat, not {self.bits}")

    def _check_decoding(self) -> None:
        if self.decoding in self.kind.decodings:
            return
        if self.sensor == "quadrature":
            raise ParameterError("decoding", f"must be 1, 2 or 4, or x1, x2 or x4, not {self.decoding}")
        allowed = " or ".join(map(str, sorted(self.kind.decodings)))
        raise ParameterError("decoding", f"must be {allowed} for {self.sensor}, not {self.decoding}")

    def _check_teeth(self, parts: tuple[tuple[int, int], ...]) -> None:
        if self.sensor != "pulses":
            raise ParameterError("teeth", f"must be given with --sensor pulses, not {self.sensor}")
        if self.decoding != 1:
            raise ParameterError("decoding", f"must be 1 with --teeth, one count for a tooth, not {self.decoding}")
        if (teeth := sum(number for number, _ in parts)) != self.pulses_per_rev:
            raise ParameterError(
                "teeth", f"must be of --ppr, {self.pulses_per_rev} teeth, not of {teeth}: type --ppr {teeth}"
            )

    @property
    def kind(self) -> Sensor:
        """Facts of the sensor."""
        return KINDS[self.sensor]

    @property
    def sampled(self) -> Sampled | None:
        """Facts of a position that is read; None: edges are counted."""
        return None if self.bits is None else Sampled.of(self.bits, self.sample_age)

    @property
    def unchecked(self) -> bool:
        """Whether nothing checks the frames of an encoder that is read."""
        return self.crc == "none" or (self.sensor == "ssi" and not self.repeat)

    def reads(self, clock_hz: int) -> Reads | None:
        """Return the reads that a core makes itself, one in each tick; None: it makes none."""
        if (sampled := self.sampled) is None or self.sensor == "sampled":
            return None
        usual = {"ssi": 1_000_000, "biss": 5_000_000, "spi": CHIPS[self.chip or "amt22"].usual_hz, "tformat": RATES[0]}
        hertz = self.encoder_clock or usual[self.sensor]
        every = (sampled.width, clock_hz, hertz, ceil((self.line_delay or 0) * clock_hz))
        if self.chip:
            return SpiReads(*every, chip=self.chip)
        if self.sensor == "tformat":
            return TformatReads(*every, turn_bits=sampled.turn_bits)
        biss = self.sensor == "biss"
        crc = 0 if self.crc == "none" or not biss else int(self.crc or hex(BISS_CRC), 16)
        return Reads(*every, biss=biss, gray=self.gray, repeat=self.repeat, crc=crc)

    @property
    def inverted(self) -> frozenset[str]:
        """Names of the lines that are inverted."""
        return frozenset(self.invert.split(",")) if self.invert else frozenset()

    @property
    def plain(self) -> bool:
        """Whether it is quadrature whose lines are as they come."""
        return self.sensor == "quadrature" and not self.reverse and not self.invert

    @property
    def encoder_counts(self) -> int:
        """Counts per revolution of the encoder after decoding."""
        return self.pulses_per_rev * self.decoding

    @property
    def turns(self) -> Fraction:
        """Revolutions of the encoder in one of the shaft."""
        return Fraction(self.ratio or 1)

    @property
    def counts_per_rev(self) -> Fraction | int:
        """P, counts per revolution of the shaft after decoding; an int if it is whole."""
        counts = self.encoder_counts * self.turns
        return int(counts) if counts.denominator == 1 else counts
