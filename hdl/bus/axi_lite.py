"""AXI4-Lite."""

from amaranth import Cat, Const, Module, Mux, Signal

from tachometry.hdl.bus.bridge import Bridge


class AxiLiteBridge(Bridge):
    """AXI4-Lite, 32 bits, a read and a write at a time.

    The write address and the write data are taken in any order. The answer to a write is there three clocks after the
    one in which the latter of them was taken, that to a read three or four clocks after its address. If both are to be
    done at once, the write goes first; the next write comes some clocks later, so reads never wait for more than one.
    No output depends on an input of the same clock. A write without byte 0 changes nothing, and is no error.
    """

    bus = "axi-lite"

    def elaborate(self, platform: object) -> Module:
        m = Module()
        native = self.native
        to_write, to_read = (Signal.like(native.address, name=name) for name in ("to_write", "to_read"))
        take_address, take_data, take_read = (Signal(name=f"take_{name}", init=1) for name in ("aw", "w", "ar"))
        by_byte_0 = Signal()
        m.d.comb += [
            self.s_axi_awready.eq(take_address),
            self.s_axi_wready.eq(take_data),
            self.s_axi_arready.eq(take_read),
        ]
        with m.If(take_address):
            m.d.sync += [to_write.eq(self.s_axi_awaddr >> 2), take_address.eq(~self.s_axi_awvalid)]
        with m.If(take_data):
            m.d.sync += [
                native.write_data.eq(self.s_axi_wdata),
                by_byte_0.eq(self.s_axi_wstrb[0]),
                take_data.eq(~self.s_axi_wvalid),
            ]
        with m.If(take_read):
            m.d.sync += [to_read.eq(self.s_axi_araddr >> 2), take_read.eq(~self.s_axi_arvalid)]

        # An access is made once: then its answer is there for a clock, and is kept until the master has taken it.
        writes, written, write_done = (Signal(name=name) for name in ("writes", "written", "write_done"))
        reads, has_read, read_done = (Signal(name=name) for name in ("reads", "has_read", "read_done"))
        m.d.comb += [
            writes.eq(~take_address & ~take_data & ~write_done),
            reads.eq(~take_read & ~read_done & ~writes),
            native.address.eq(Mux(writes, to_write, to_read)),
            native.write.eq(writes & by_byte_0),
            native.read.eq(reads),
        ]
        m.d.sync += [written.eq(writes), has_read.eq(reads)]
        slave_error = Cat(Const(0, 1), native.error)
        with m.If(writes):
            m.d.sync += write_done.eq(1)
        with m.If(written):
            m.d.sync += [self.s_axi_bvalid.eq(1), self.s_axi_bresp.eq(slave_error)]
        with m.If(self.s_axi_bvalid & self.s_axi_bready):
            m.d.sync += [self.s_axi_bvalid.eq(0), write_done.eq(0), take_address.eq(1), take_data.eq(1)]
        with m.If(reads):
            m.d.sync += read_done.eq(1)
        with m.If(has_read):
            m.d.sync += [
                self.s_axi_rvalid.eq(1),
                self.s_axi_rresp.eq(slave_error),
                self.s_axi_rdata.eq(native.read_data),
            ]
        with m.If(self.s_axi_rvalid & self.s_axi_rready):
            m.d.sync += [self.s_axi_rvalid.eq(0), read_done.eq(0), take_read.eq(1)]
        return m
