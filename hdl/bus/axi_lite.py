"""A bridge answers AXI4-Lite from the bank of registers."""

from amaranth import Cat, Const, Module, Mux, Signal, Value

from tachometry.hdl.bus.bridge import Bridge


class _Write:
    """Holds how far a write is: address and data taken, made, answered."""

    def __init__(self, bridge: "AxiLiteBridge") -> None:
        self.to_write = Signal.like(bridge.native.address)
        self.by_byte_0 = Signal()
        self.take_aw = Signal(init=1)  # no address has been taken
        self.take_w = Signal(init=1)  # no data have been taken
        self.writes = Signal()  # in this clock
        self.written = Signal()  # in the clock before: the native port answers
        self.write_done = Signal()  # the master has not taken the answer yet


class _Read:
    """Holds how far a read is: address taken, made, answered."""

    def __init__(self, bridge: "AxiLiteBridge") -> None:
        self.to_read = Signal.like(bridge.native.address)
        self.take_ar = Signal(init=1)  # no address has been taken
        self.reads = Signal()  # in this clock
        self.has_read = Signal()  # in the clock before: the native port answers
        self.read_done = Signal()  # the master has not taken the answer yet


class AxiLiteBridge(Bridge):
    """Answers AXI4-Lite, 32 bits, a read and a write at a time.

    The write address and the write data are taken in any order. The answer to a write is there three clocks after the
    one in which the latter of them was taken, that to a read three or four clocks after its address. If both are to be
    done at once, the write goes first; the next write comes some clocks later, so reads never wait for more than one.
    No output depends on an input of the same clock. A write without byte 0 changes nothing, and is no error.
    """

    bus = "axi-lite"

    def build(self, m: Module) -> None:
        write, read = _Write(self), _Read(self)
        self._take(m, write, read)
        self._reach_registers(m, write, read)
        self._answer_write(m, write)
        self._answer_read(m, read)

    def _take(self, m: Module, write: _Write, read: _Read) -> None:
        """Take addresses and data as they come, one of each."""
        m.d.comb += [
            self.s_axi_awready.eq(write.take_aw),
            self.s_axi_wready.eq(write.take_w),
            self.s_axi_arready.eq(read.take_ar),
        ]
        with m.If(write.take_aw):
            m.d.sync += [write.to_write.eq(self.s_axi_awaddr >> 2), write.take_aw.eq(~self.s_axi_awvalid)]
        with m.If(write.take_w):
            m.d.sync += [
                self.native.write_data.eq(self.s_axi_wdata),
                write.by_byte_0.eq(self.s_axi_wstrb[0]),
                write.take_w.eq(~self.s_axi_wvalid),
            ]
        with m.If(read.take_ar):
            m.d.sync += [read.to_read.eq(self.s_axi_araddr >> 2), read.take_ar.eq(~self.s_axi_arvalid)]

    def _reach_registers(self, m: Module, write: _Write, read: _Read) -> None:
        """Make an access once; a write goes before a read."""
        native = self.native
        m.d.comb += [
            write.writes.eq(~write.take_aw & ~write.take_w & ~write.write_done),
            read.reads.eq(~read.take_ar & ~read.read_done & ~write.writes),
            native.address.eq(Mux(write.writes, write.to_write, read.to_read)),
            native.write.eq(write.writes & write.by_byte_0),
            native.read.eq(read.reads),
        ]
        m.d.sync += [write.written.eq(write.writes), read.has_read.eq(read.reads)]

    def _answer_write(self, m: Module, write: _Write) -> None:
        """Answer a write, until the master has taken the answer."""
        with m.If(write.writes):
            m.d.sync += write.write_done.eq(1)
        with m.If(write.written):
            m.d.sync += [self.s_axi_bvalid.eq(1), self.s_axi_bresp.eq(self._response)]
        with m.If(self.s_axi_bvalid & self.s_axi_bready):
            m.d.sync += [self.s_axi_bvalid.eq(0), write.write_done.eq(0), write.take_aw.eq(1), write.take_w.eq(1)]

    def _answer_read(self, m: Module, read: _Read) -> None:
        """Answer a read, until the master has taken the answer."""
        with m.If(read.reads):
            m.d.sync += read.read_done.eq(1)
        with m.If(read.has_read):
            m.d.sync += [
                self.s_axi_rvalid.eq(1),
                self.s_axi_rresp.eq(self._response),
                self.s_axi_rdata.eq(self.native.read_data),
            ]
        with m.If(self.s_axi_rvalid & self.s_axi_rready):
            m.d.sync += [self.s_axi_rvalid.eq(0), read.read_done.eq(0), read.take_ar.eq(1)]

    @property
    def _response(self) -> Value:
        """OKAY, or SLVERR where the native port answers with an error."""
        return Cat(Const(0, 1), self.native.error)
