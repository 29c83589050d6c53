"""A bridge answers Wishbone from the bank of registers."""

from amaranth import Module, Signal

from tachometry.hdl.bus.bridge import Bridge


class WishboneBridge(Bridge):
    """Wishbone B4 classic, 32 bits, byte addresses: an access is answered in the clock after it, by ack or by err.

    A write without byte 0 changes nothing.
    """

    bus = "wishbone"

    def build(self, m: Module) -> None:
        native = self.native
        access = Signal()
        answered = Signal()
        m.d.comb += [
            access.eq(self.wb_cyc_i & self.wb_stb_i & ~answered),
            native.address.eq(self.wb_adr_i >> 2),
            native.read.eq(access & ~self.wb_we_i),
            native.write.eq(access & self.wb_we_i & self.wb_sel_i[0]),
            native.write_data.eq(self.wb_dat_i),
            self.wb_dat_o.eq(native.read_data),
            # A master that gives up in between is not answered.
            self.wb_ack_o.eq(answered & self.wb_cyc_i & self.wb_stb_i & ~native.error),
            self.wb_err_o.eq(answered & self.wb_cyc_i & self.wb_stb_i & native.error),
        ]
        m.d.sync += answered.eq(access)
