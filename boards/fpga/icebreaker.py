"""The iCEBreaker has an iCE40UP5K and three PMODs."""

from tachometry.boards.fpga.board import Board, Header, pins, platform
from tachometry.boards.fpga.flow import ice40_up

ICEBREAKER = Board(
    name="icebreaker",
    title="iCEBreaker, iCE40UP5K",
    clock_hz=12_000_000,
    platform=platform("icebreaker:ICEBreakerPlatform"),
    headers=(
        # The emulator is below the encoder: three jumpers join them.
        Header("PMOD1A", pins("a:1 b:2 z:3 tick_in:4 emulated_a:7 emulated_b:8 emulated_z:9 capture:10"), ("pmod", 0)),
        Header("PMOD1B", pins("spi_cs_n:1 spi_mosi:2 spi_miso:3 spi_sck:4 current_pdm:7 enable:8"), ("pmod", 1)),
    ),
    attributes={"IO_STANDARD": "SB_LVCMOS"},
    pull_up={"PULLUP": 1},
    leds=2,
    edges=4096,
    flow=ice40_up("--up5k", "--package", "sg48"),
    # Its jumpers are such that the FPGA reads the flash memory; its own memory cannot be written.
    loader=("-b", "ice40_generic", "-f"),
)
