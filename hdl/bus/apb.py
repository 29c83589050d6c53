"""APB."""

from amaranth import Module, Signal
from amaranth.lib import wiring

from tachometry.hdl.bus.bridge import bridge_members
from tachometry.spec.registers.map import RegisterMap


class ApbBridge(wiring.Component):
    """APB3 without wait states: the registers are accessed in the setup clock and answer in the access clock.

    Parameters
    ----------
    registers : RegisterMap

    Members
    -------
    The ports of the bus, and

    native : Out(native_port)
    """

    def __init__(self, registers: RegisterMap) -> None:
        super().__init__(bridge_members("apb", registers))

    def elaborate(self, platform: object) -> Module:
        m = Module()
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
        return m
