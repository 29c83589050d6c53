"""A quotient is base + N/m."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from amaranth import Module, Signal, signed
from amaranth.lib import data, stream
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.carried_reciprocal import CarriedReciprocal
from tachometry.hdl.arithmetic.reciprocal import DividedReciprocal, LookedUpReciprocal
from tachometry.hdl.arithmetic.remainder_scaler import RemainderScaler
from tachometry.hdl.arithmetic.scaler import PipelinedScaler, SerialScaler, WideSerialScaler
from tachometry.hdl.wires.ports import Box, only_if
from tachometry.spec.formats import carried_reciprocal, reciprocal


class _Scaler(Protocol):
    """Describes the ports that all scalers have."""

    load: Signal
    start: Signal
    base: Signal
    numerator: Signal
    tag: data.View
    q: Signal
    results: stream.Interface


@runtime_checkable
class _TakesRemainder(Protocol):
    """Describes the ports that a scaler for a carried reciprocal has in addition."""

    r: Signal


_Shape = reciprocal.Reciprocal | carried_reciprocal.CarriedReciprocal


def _reciprocal(shape: _Shape) -> LookedUpReciprocal | DividedReciprocal | CarriedReciprocal:
    if isinstance(shape, carried_reciprocal.CarriedReciprocal):
        return CarriedReciprocal(shape)
    if isinstance(shape, reciprocal.DividedReciprocal):
        return DividedReciprocal(shape)
    return LookedUpReciprocal(shape)


def _scaler(shape: _Shape, width: int, serial: bool) -> Callable[..., _Scaler]:
    if isinstance(shape, carried_reciprocal.CarriedReciprocal):
        return RemainderScaler
    if not serial:
        return PipelinedScaler
    return WideSerialScaler if shape.is_wide(width) else SerialScaler


class Quotient(Box):
    """Computes base + N/m, and bounds of it, correctly rounded and without a divider.

    1/m is looked up, divided, carried on from m to m + 1, or constant; it is multiplied step by step or all at once.
    All quotients share the reciprocal. A bound is the quotient of N − margin rounded down, or of N + margin rounded up.

    Latency: that of the scaler, from `start` on.

    - `shape`: Widths and contents of the reciprocal. A carried one is multiplied all at once.
    - `quotients`: By the name of each quotient its bits, the way it is rounded: to the nearest (0), down (−1) or up
      (1), and what is added to N for it.
    - `numerator_width`: Bits of N and of all that is added to it, signed.
    - `serial`: Step by step: `start` may come again as soon as the result has, and m, which moves then, and `tag` must
      stay as they are until then. Otherwise it may come in every clock.
    - `constant`: m, if it is always the same.
    """

    def __init__(
        self,
        shape: _Shape,
        *,
        quotients: Mapping[str, tuple[int, int, int]],
        numerator_width: int,
        tag: data.StructLayout,
        serial: bool,
        constant: int | None = None,
    ) -> None:
        self._margins = {name: margin for name, (_, _, margin) in quotients.items()}
        self._constant = 0 if constant is None else shape.value(constant)
        self.reciprocal = None if constant is not None else _reciprocal(shape)
        # `moves`: the last clock with this m. A carried reciprocal restricts the next m.
        m = In(range(shape.max_m + 1))
        travels = data.StructLayout({**only_if(constant is None, m=m.shape), **tag.members})
        self.scalers = {
            name: _scaler(shape, width, serial)(
                shape, base_width=width - shape.frac_bits, numerator_width=numerator_width, tag=travels, towards=towards
            )
            for name, (width, towards, _) in quotients.items()
        }
        results = {name: signed(width) for name, (width, _, _) in quotients.items()} | travels.members
        super().__init__(
            **only_if(constant is None, m=m, moves=In(1)),
            load=In(1),  # `base` and `numerator` are valid
            # The clock after `load`, with `m` and `tag`; m has been valid as long as its reciprocal takes.
            start=In(1),
            base=In(signed(min(len(box.base) for box in self.scalers.values()))),
            numerator=In(signed(numerator_width)),
            tag=In(tag),
            # Quotients by their names, `m` if it is not constant, and the fields of the tag; held until the next.
            results=Out(stream.Signature(data.StructLayout(results), always_ready=True)),
        )

    def build(self, m: Module) -> None:
        new, q = self.results.p, self._constant
        if self.reciprocal is not None:
            m.submodules.reciprocal = self.reciprocal
            m.d.comb += [self.reciprocal.m.eq(self.m), self.reciprocal.moves.eq(self.moves)]
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
