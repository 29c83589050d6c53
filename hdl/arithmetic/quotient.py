"""base + N/m."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from amaranth import Module, Signal, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.carried_reciprocal import CarriedReciprocal
from tachometry.hdl.arithmetic.reciprocal import Reciprocal
from tachometry.hdl.arithmetic.remainder_scaler import PipelinedRemainderScaler, SerialRemainderScaler
from tachometry.hdl.arithmetic.scaler import PipelinedScaler, SerialScaler
from tachometry.spec.formats import carried_reciprocal, reciprocal


class _Scaler(Protocol):
    """What all scalers have."""

    load: Signal
    start: Signal
    base: Signal
    numerator: Signal
    tag: data.View
    q: Signal
    results: stream.Interface


@runtime_checkable
class _TakesRemainder(Protocol):
    """What a scaler for a carried reciprocal has in addition."""

    r: Signal


def _scaler(serial: bool, carried: bool) -> Callable[..., _Scaler]:
    if carried:
        return SerialRemainderScaler if serial else PipelinedRemainderScaler
    return SerialScaler if serial else PipelinedScaler


class Quotient(wiring.Component):
    """base + N/m, and bounds of it, correctly rounded and without a divider.

    1/m is looked up, carried on from m to m + 1, or constant; it is multiplied step by step or all at once. All
    quotients share the reciprocal. A bound is the quotient of N − margin rounded down, or of N + margin rounded up.

    Latency: that of the scaler, from `start` on.

    Parameters
    ----------
    shape : spec.reciprocal.Reciprocal or spec.carried_reciprocal.CarriedReciprocal
        Widths and contents of the reciprocal.
    quotients : dict
        By the name of each quotient its bits, and which way it is rounded: to the nearest (0), down (−1) or up (1).
    numerator_width : int
        Bits of N and of N ± margin, signed.
    tag : data.StructLayout
        What travels along.
    serial : bool
        Step by step: `load` may come again as soon as the result has. Otherwise it may come in every clock.
    margin : int
    constant : int or None
        m, if it is always the same.

    Members
    -------
    m : In(range(max_m + 1))
        `m` and `enable` exist only if m is not constant. A carried reciprocal restricts what may follow an m.
    enable : In(1)
        `m` is new.
    load : In(1)
        `base`, `numerator`, `m` and `tag` are valid.
    start : In(1)
        The loaded values are to be used; only together with `load`.
    base, numerator : In(signed)
    tag : In(tag)
    results : Out(stream)
        The quotients by their names, `m` if it is not constant, and the fields of the tag; held until the next.
    """

    def __init__(
        self,
        shape: reciprocal.Reciprocal | carried_reciprocal.CarriedReciprocal,
        *,
        quotients: Mapping[str, tuple[int, int]],
        numerator_width: int,
        tag: data.StructLayout,
        serial: bool,
        margin: int = 0,
        constant: int | None = None,
    ) -> None:
        self._margins = {name: towards * margin for name, (_, towards) in quotients.items()}
        self.reciprocal: Reciprocal | CarriedReciprocal | None = None
        self._constant = 0
        inputs, travels = {}, tag
        if constant is None:
            inputs = {"m": In(range(shape.max_m + 1)), "enable": In(1)}
            travels = data.StructLayout({"m": range(shape.max_m + 1), **tag.members})
        if isinstance(shape, carried_reciprocal.CarriedReciprocal):
            self.reciprocal = CarriedReciprocal(shape)
        elif constant is None:
            self.reciprocal = Reciprocal(shape)
        else:
            self._constant = shape.value(constant)
        scaler = _scaler(serial, carried=isinstance(self.reciprocal, CarriedReciprocal))
        self.scalers = {
            name: scaler(
                shape,
                base_width=width - shape.frac_bits,
                numerator_width=numerator_width,
                tag=travels,
                towards=towards,
            )
            for name, (width, towards) in quotients.items()
        }
        results = {name: signed(width) for name, (width, _) in quotients.items()} | travels.members
        super().__init__(
            {
                **inputs,
                "load": In(1),
                "start": In(1),
                "base": In(signed(min(len(box.base) for box in self.scalers.values()))),
                "numerator": In(signed(numerator_width)),
                "tag": In(tag),
                "results": Out(stream.Signature(data.StructLayout(results), always_ready=True)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        new, q = self.results.p, self._constant
        if self.reciprocal is not None:
            m.submodules.reciprocal = self.reciprocal
            m.d.comb += [self.reciprocal.m.eq(self.m), self.reciprocal.enable.eq(self.enable)]
            q = self.reciprocal.q
        for name, box in self.scalers.items():
            m.submodules[f"scaler_{name}"] = box
            m.d.comb += [
                box.load.eq(self.load),
                box.start.eq(self.start),
                box.base.eq(self.base),
                box.numerator.eq(self.numerator + self._margins[name]),
                *(box.tag[field].eq(self.tag[field]) for field in self.tag.shape().members),
                box.q.eq(q),
                new[name].eq(box.results.p.quotient),
            ]
            if self.reciprocal is not None:
                m.d.comb += box.tag.m.eq(self.m)
            if isinstance(self.reciprocal, CarriedReciprocal) and isinstance(box, _TakesRemainder):
                m.d.comb += box.r.eq(self.reciprocal.r)
        first = next(iter(self.scalers.values())).results
        m.d.comb += self.results.valid.eq(first.valid)
        m.d.comb += [new[field].eq(first.p.tag[field]) for field in first.p.tag.shape().members]
        return m
