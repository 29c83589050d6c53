"""The lines of every bus: names, directions and widths as the protocols have them."""

import pytest

from tachometry.spec import of_texts
from tachometry.spec.registers.buses import BUSES, bus_of, ports_on
from tachometry.spec.registers.map import RegisterMap

SPEC = of_texts("m", {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "100clk"})
# A word of data, its bytes, the address; AXI4-Lite has 3 bits of protection and 2 of response (ARM IHI 0022).
LINES = {
    "native": "> reg_address:word reg_read reg_write reg_write_data:32 < reg_read_data:32 reg_error",
    "wishbone": "> wb_adr_i:byte wb_dat_i:32 < wb_dat_o:32 > wb_sel_i:4 wb_we_i wb_cyc_i wb_stb_i < wb_ack_o wb_err_o",
    "apb": "> s_apb_paddr:byte s_apb_psel s_apb_penable s_apb_pwrite s_apb_pwdata:32 "
    "< s_apb_pready s_apb_prdata:32 s_apb_pslverr",
    "axi-lite": "> s_axi_awaddr:byte s_axi_awprot:3 s_axi_awvalid < s_axi_awready "
    "> s_axi_wdata:32 s_axi_wstrb:4 s_axi_wvalid < s_axi_wready s_axi_bresp:2 s_axi_bvalid > s_axi_bready "
    "s_axi_araddr:byte s_axi_arprot:3 s_axi_arvalid < s_axi_arready s_axi_rdata:32 s_axi_rresp:2 s_axi_rvalid "
    "> s_axi_rready",
    "spi": "> spi_sck spi_mosi spi_cs_n < spi_miso",
    "uart": "> uart_rx < uart_tx",
}


@pytest.mark.parametrize("name", LINES)
def test_lines(name: str) -> None:
    n_bytes = 4 * len(RegisterMap(SPEC).registers)
    # There is an address behind the last register.
    bits = next(bits for bits in range(20) if 1 << bits > n_bytes)
    wanted, direction = [("capture", "input", 1)], ""
    for word in LINES[name].split():
        if word in "<>":
            direction = {">": "input", "<": "output"}[word]
            continue
        line, _, width = word.partition(":")
        wanted.append((line, direction, {"byte": bits, "word": bits - 2, "": 1}.get(width) or int(width)))
    found = ports_on(SPEC, bus_of(name))
    assert found[: len(SPEC.ports)] == SPEC.ports
    assert [(port.name, port.direction, port.width) for port in found[len(SPEC.ports) :]] == wanted
    assert all(port.help and not port.signed and not port.held_by for port in found[len(SPEC.ports) :])


def test_every_bus_is_here() -> None:
    assert LINES.keys() == BUSES.keys()
    assert ports_on(SPEC, None) == SPEC.ports
    assert bus_of("none") is None


def test_lines_that_rest_high_and_those_of_no_clock() -> None:
    assert all(bus_of(name) is bus for name, bus in BUSES.items())
    idle = {name: dict(bus.idle) for name, bus in BUSES.items() if bus.idle}
    assert idle == {"spi": {"spi_cs_n": 1}, "uart": {"uart_rx": 1}}
    free = {name: bus.asynchronous for name, bus in BUSES.items() if bus.asynchronous}
    assert free == {"spi": ("spi_sck", "spi_mosi", "spi_cs_n"), "uart": ("uart_rx",)}
    assert {name: bus.baud for name, bus in BUSES.items()} == dict.fromkeys(BUSES, 0) | {"uart": 1_000_000}


def cycles(baud: int, clock: int) -> int:
    bus = bus_of("uart", baud)
    assert bus is not None
    return bus.bit_cycles(clock)


def test_clocks_of_a_bit() -> None:
    """The nearest whole number of at least 8; 2 % off is just near enough."""
    assert [cycles(1, clock) for clock in (8, 9, 100)] == [8, 9, 100]
    assert [cycles(5, clock) for clock in (49, 50, 51)] == [10, 10, 10]
    assert [cycles(100, clock) for clock in (4949, 4950, 4951, 5049, 5050)] == [49, 50, 50, 50, 51]
    for baud, clock, nearest in ((5, 48, 4), (5, 52, 5), (1, 7, 0), (2, 15, 1), (2, 17, 1)):
        with pytest.raises(ValueError, match=f"at least 8 clocks, such as {nearest}, not {baud}$"):
            cycles(baud, clock)
