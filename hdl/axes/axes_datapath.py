"""The S method for many axes."""

from amaranth import Module, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.quotient import Quotient
from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.axes.axis_window import AxisWindow
from tachometry.hdl.axes.turns import Turns
from tachometry.hdl.output.update import update_layout
from tachometry.hdl.output.velocity_output import PipelinedVelocityOutput
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name, only_if
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.methods.s_axis import DECIDE, READ, SAxis

_UPDATE = ("velocity", "interval", "forced")


class _Turn:
    """Holds what the axis that has its turn had before, and what it has after it."""

    def __init__(self, datapath: "AxesDatapath") -> None:
        position, window = datapath.position.shape(), datapath.window.state.shape()
        resets = "handed_position" in datapath.signature.members
        kept = data.StructLayout({"window": window} if resets else {"position": position, "window": window})
        self.resets = resets
        self.decides = datapath.turns.step[DECIDE]
        self.after = Signal(kept)
        handed = ("count", "handed_position") if resets else ("count",)
        shapes = {name: port.shape() for name, port in by_name(datapath, handed).items()}
        self.handed = Signal(data.StructLayout(shapes))
        self.before = Signal(kept)


class AxesDatapath(Box):
    """S-method datapath that the axes have in turn: from the counts of a tick to position and velocity.

    The counts of all axes are handed over in one round; then each axis has its turn. In a turn the state of the axis is
    read, m_e and position are made, the window is followed, and the velocity is computed, as `SMethod` does it.

    Latency: the outputs of an axis are new `spec.turn_cycles` and `READ` clocks after its turn has begun, in the turn
    of the next.
    """

    def __init__(self, spec: AxesSpec) -> None:
        self._spec = spec
        axis = spec.axis
        assert isinstance(axis, SAxis)
        self.turns = Turns(spec.axes, spec.turn_cycles)
        self.window = AxisWindow(
            max_ticks=axis.timing.max_ticks,
            kept_ticks=axis.form.kept_ticks,
            count_width=axis.widths.count,
            numerator_width=axis.form.numerator_width,
            cancel=axis.cancel,
        )
        self.quotient = Quotient(
            axis.form.looked_up,
            quotients={"velocity": (axis.velocity.native, 0, 0)},
            numerator_width=axis.form.numerator_width,
            tag=data.StructLayout({"forced": 1}),
            serial=True,
        )
        output = axis.velocity.output
        self.velocity_output = None if output is None else PipelinedVelocityOutput(output, update_layout(axis))
        super().__init__(
            complete=In(1),  # `count` is handed over; the turns begin with the clock after that of axis 0
            slot=In(range(spec.slots)),  # that the count belongs to
            count=In(signed(axis.tick.longest.bit_length() + 1)),
            **only_if(axis.front_end.index_resets, handed_position=In(signed(axis.position_width))),  # else a sum
            tick=Out(1),  # one clock for every axis in every tick
            axis=Out(len(self.turns.axis)),  # valid with `tick`, as are the next four
            pulse_count=Out(signed(axis.widths.count)),
            position=Out(signed(axis.position_width)),
            overflow=Out(1),
            standstill=Out(1),
            velocity_valid=Out(1),  # only together with `tick`: all below are new
            velocity=Out(signed(axis.velocity.width)),
            interval=Out(axis.widths.interval),
            forced=Out(1),
            **only_if(output is not None, velocity_overflow=Out(1)),
        )

    @property
    def probes(self) -> dict[str, Value]:
        return {"turn": self.turns.axis, "m_s": self.window.state.m_s, "numerator": self.window.numerator}

    def build(self, m: Module) -> None:
        m.submodules.turns = self.turns
        m.submodules.window = self.window
        m.submodules.quotient = self.quotient
        turn = _Turn(self)
        self._read(m, turn)
        self._add(m, turn)
        self._decide(m, turn)
        self._show(m)

    def _read(self, m: Module, turn: _Turn) -> None:
        """Read the count that was handed over, and the state; both are registered, as block RAM is slow."""
        turns = self.turns
        shape = turn.handed.shape()
        m.submodules.handed_over = handed = Memory(shape=shape, depth=self._spec.slots, init=[])
        read_count = handed.read_port()
        write_count = handed.write_port()
        m.d.comb += [
            turns.begin.eq(self.complete & (self.slot == 0)),
            write_count.addr.eq(self.slot),
            *(write_count.data[name].eq(port) for name, port in by_name(self, shape.members).items()),
            write_count.en.eq(self.complete),
            read_count.addr.eq(turns.axis),
        ]
        stored = self._stored(m, turn)
        with m.If(turns.step[READ - 1]):
            m.d.sync += [turn.handed.eq(read_count.data), turn.before.eq(stored)]

    def _add(self, m: Module, turn: _Turn) -> None:
        """Make m_e and the position."""
        turns, axis = self.turns, self._spec.axis
        overflow = Signal()
        count = turn.handed.count
        m_e = count
        if axis.tick.max_count < axis.tick.longest:
            m_e, overflow = saturate(m, count, axis.tick.max_count)
        position = turn.handed.handed_position if turn.resets else turn.before.position + count
        with m.If(turns.step[READ]):
            m.d.sync += [
                self.axis.eq(turns.axis),
                self.pulse_count.eq(m_e),
                self.overflow.eq(overflow),
                self.position.eq(position),
            ]
            with m.If(turns.clears):
                m.d.sync += [self.pulse_count.eq(0), self.overflow.eq(0), self.position.eq(0)]

    def _decide(self, m: Module, turn: _Turn) -> None:
        """Follow the window, and divide where it has an update."""
        window, quotient = self.window, self.quotient
        updates = Signal()
        forced = Signal()
        m.d.sync += updates.eq(turn.decides & window.update)
        with m.If(turn.decides):
            m.d.sync += [self.standstill.eq(window.next.rests), forced.eq(window.forced)]
        m.d.comb += [
            window.clears.eq(self.turns.clears),
            window.state.eq(turn.before.window),
            window.m_e.eq(self.pulse_count),
            *([] if turn.resets else [turn.after.position.eq(self.position)]),
            turn.after.window.eq(window.next),
            quotient.m.eq(window.state.m_s),
            quotient.load.eq(turn.decides),
            quotient.start.eq(updates),
            quotient.base.eq(window.state.previous),
            quotient.numerator.eq(window.numerator),
            quotient.tag.forced.eq(forced),
        ]

    def _show(self, m: Module) -> None:
        """Show a tick as late as its velocity: what the next turn has by then does not show yet."""
        updates = self.quotient.results
        if self.velocity_output is not None:
            m.submodules.velocity_output = output = self.velocity_output
            m.d.comb += output.updates.valid.eq(updates.valid)
            m.d.comb += [output.updates.p[name].eq(updates.p["m" if name == "interval" else name]) for name in _UPDATE]
            updates = output.shown
        ended = self.turns.step[-1] & ~self.turns.clears
        (tick,) = delay(m, ended, clocks=READ + 1)
        m.d.comb += [
            self.tick.eq(tick),
            self.velocity_valid.eq(updates.valid),
            self.velocity.eq(updates.p.velocity),
            self.interval.eq(updates.p.m if self.velocity_output is None else updates.p.interval),
            self.forced.eq(updates.p.forced),
        ]
        if self.velocity_output is not None:
            m.d.comb += self.velocity_overflow.eq(updates.p.velocity_overflow)

    def _stored(self, m: Module, turn: _Turn) -> Value | data.View:
        """Return the state of the axis that has its turn, as it was; it becomes `after` where the axis decides."""
        after = turn.after
        if self._spec.axes == 1:
            only = Signal.like(after, reset_less=True)  # Verilog has no addresses of no bits
            with m.If(turn.decides):
                m.d.sync += only.eq(after)
            return only
        m.submodules.state = state = Memory(shape=after.shape(), depth=self._spec.axes, init=[])
        read = state.read_port()
        write = state.write_port()
        m.d.comb += [
            read.addr.eq(self.turns.axis),
            write.addr.eq(self.turns.axis),
            write.data.eq(after),
            write.en.eq(turn.decides),
        ]
        return read.data
