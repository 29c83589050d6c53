"""The ports and the report that masters of absolute encoders have in common."""

from typing import Any

from amaranth import Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, by_name, members
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.core.reads import NO_ANSWER, Reads


class Frame:
    """Signals of the frame that is read."""

    def __init__(self) -> None:
        self.line = Signal()  # the input, synchronised
        self.silent = Signal()  # there is no answer
        self.idle = Signal()
        self.done = Signal()


class EncoderMaster(Box):
    """Reads a position once for each `start`; see `Reads`.

    A read that is due while another one runs, or while the lines rest, is left out and reported as not answered.
    """

    def __init__(self, reads: Reads) -> None:
        super().__init__(
            **members(reads.ports),
            start=In(1),
            sample=Out(reads.width),  # valid with the strobe, as are the others
            sample_valid=Out(1),
            sample_age=Out(reads.age_width),  # clocks since the encoder took its position
            sample_ok=Out(1),
            sample_warning=Out(1),
            reason=Out(2),  # why not `sample_ok`: NO_ANSWER, WRONG_CHECK, ERROR_BIT
        )

    def _synchronise(self, m: Module, reads: Reads, frame: Frame) -> None:
        m.submodules[f"sync_{reads.line}"] = Synchronizer(by_name(self, [reads.line])[reads.line], frame.line)

    def _recover(self, m: Module, machine: Any) -> None:
        """Let the master rest after an upset to no state of its machine, an FSM."""
        self.state = machine.state
        with m.If(self.state >= len(machine.encoding)):
            m.d.sync += self.state.eq(0)

    def _report(self, m: Module, frame: Frame, reason: Value, warning: Value, age: Value) -> None:
        """Drive the record of a read that is done or left out."""
        left_out = Signal()
        m.d.sync += left_out.eq((self.start & ~frame.idle) | (left_out & frame.done))
        m.d.comb += [
            self.sample_valid.eq(frame.done | left_out),
            self.sample_age.eq(age),
            self.sample_ok.eq(self.reason == 0),
            self.sample_warning.eq(self.sample_ok & warning),
            self.reason.eq(Mux(frame.silent | ~frame.done, NO_ANSWER, reason)),
        ]
