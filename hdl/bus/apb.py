"""A bridge answers APB from the bank of registers."""

from amaranth import Module, Signal

from tachometry.hdl.bus.bridge import Bridge


class ApbBridge(Bridge):
    """APB3 without wait states: the registers are accessed in the setup clock and answer in the access clock."""

    bus = "apb"

    def build(self, m: Module) -> None:
        native = self.native
        setup = Signal()
        m.d.comb += [
            setup.eq(self.s_apb_psel & ~self.s_apb_penable),
            native.address.eq(self.s_apb_paddr >> 2),
            native.read.eq(setup & ~self.s_apb_pwrite),
            native.write.eq(setup & self.s_apb_pwrite),
            native.write_data.eq(self.s_apb_pwdata),
            self.s_apb_pready.eq(1),
            self.s_apb_prdata.eq(native.read_data),
            self.s_apb_pslverr.eq(native.error),
        ]
