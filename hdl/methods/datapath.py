"""All datapaths share these ports."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from amaranth import Signal, Value, signed
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Member, Out

from tachometry.hdl.output.update import VELOCITIES, rest_layout, update_layout, update_stream
from tachometry.hdl.wires.ports import only_if
from tachometry.spec import MTachometer, STachometer, TachometerSpec


class Datapath(Protocol):
    """Turns pulse numbers into updates.

    Among its members are `updates`, and those inputs that it needs: `tick` and `pulse_count`, `coming` and `next_count`
    (the same a clock earlier), `step` (as late as `tick`), `step_before` (a clock earlier), `step_now` (as early as
    the decoder has it), or `DISPLACED` (as late as `step`, and a clock earlier).
    """

    signature: wiring.Signature
    updates: stream.Interface

    @property
    def probes(self) -> Mapping[str, Value]:
        """Signals of the inside that a waveform should show."""


class TickSource(Protocol):
    """Says which clocks are the last ones of their windows."""

    last: Signal


@runtime_checkable
class OwnTicks(Datapath, TickSource, Protocol):
    """A datapath that makes the ticks itself; `beyond` says that a window had more counts than it can hold."""

    beyond: Signal


@runtime_checkable
class RestLater(Datapath, Protocol):
    """A datapath that hands on some of an update after its velocity."""

    rest: stream.Interface


@runtime_checkable
class LongTicks(Datapath, Protocol):
    """A datapath some of whose ticks are as long as 2^`tick_shift` nominal ones; valid with `tick`."""

    tick_shift: Signal


@runtime_checkable
class OwnStandstill(Datapath, Protocol):
    """A datapath that knows itself what `Standstill` reports of others."""

    standstill: Signal


def datapath_members(spec: TachometerSpec) -> dict[str, Member]:
    """Return members of every datapath: `tick`, `pulse_count` with it, the number of ticks so far, and the updates."""
    return {
        **{name: In(width) for name, width in stamped(spec).items()},
        "tick": In(1),
        "pulse_count": In(signed(spec.widths.count)),
        "updates": Out(update_stream(update_layout(spec))),
        **only_if(rest_layout(spec).members, rest=Out(update_stream(rest_layout(spec)))),
    }


def stamped(spec: TachometerSpec) -> dict[str, int]:
    """Return what travels with an update for its age, as fields of a structure."""
    return {"stamp": spec.widths.stamp} if spec.widths.stamp else {}


def quotients(spec: STachometer | MTachometer) -> dict[str, tuple[int, int, int]]:
    """Return the velocities of an update as quotients: bits, way of rounding, and what is added to the numerator."""
    members, margin = update_layout(spec).members, spec.form.margin
    each = ((name, towards) for name, towards in VELOCITIES.items() if name in members)
    return {name: (members[name].width, towards, towards * margin) for name, towards in each}
