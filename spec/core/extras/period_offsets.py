"""The offsets that `--period` has learned: a program reads them, keeps them, and writes them back."""

from collections.abc import Iterable
from dataclasses import dataclass

from tachometry.spec.core.extras.extra import Extra
from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.formats.tracking import PLACE_BITS
from tachometry.spec.formats.tracking_sampled import OFFSET_BITS
from tachometry.spec.language.option import ParameterError, option, parse_flag
from tachometry.spec.language.port import TICK, Port, held, pin


@dataclass(frozen=True, kw_only=True)
class PeriodOffsets(Extra):
    """A program reads an offset after each tick, and writes one before the next tick."""

    name = "period_offsets"
    exchanges = True

    on: bool = option(
        True,
        "Let a program read and write what --period learns. So it can keep the eight offsets while the power is off, "
        "by registers PERIOD_DATA, PERIOD_ADDRESS and PERIOD_OFFSET, or by ports of these names.",
        name="period-offsets",
        flag=True,
        parse=parse_flag,
        fits=lambda spec: bool(spec.method == "track"),
        tests=(),
        tacit=True,
    )

    def check(self, spec: Numbers) -> None:
        if getattr(spec, "period", None) is None:
            raise ParameterError("period_offsets", "must be given with --period N, which learns them")

    def inputs(self, spec: Numbers) -> Iterable[tuple[str, str, Pin]]:
        text = "Offset that period_write writes, signed, in the unit of period_offset."
        yield "PERIOD_DATA", "value", Pin(pin("period_data", text, OFFSET_BITS))
        text = "Number of the offset that period_write writes, and period_offset shows. Synchronous to clk."
        yield "PERIOD_ADDRESS", "number", Pin(pin("period_address", text, 3))
        text = "Writes period_data with the next tick but the first; until then data and address must stay."
        yield "PERIOD_ADDRESS", "write", Pin(pin("period_write", text), act=True)

    def ports(self, spec: Numbers) -> Iterable[Port]:
        assert spec.encoder.sampled is not None
        unit = f"2^{spec.encoder.sampled.shift - PLACE_BITS} LSB"
        text = "Offset at period_address, as it was at the tick before: one of eight that are learned."
        yield held(TICK, "period_offset", OFFSET_BITS, signed=True, unit=unit, help=text)
