"""The DE10-Nano has a Cyclone V, and is built with Quartus."""

from tachometry.boards.fpga.board import Board, Header, pins, platform

DE10_NANO = Board(
    name="de10-nano",
    title="DE10-Nano, Cyclone V 5CSEBA6",
    clock_hz=50_000_000,
    platform=platform("de10_nano:DE10NanoPlatform"),
    headers=(
        # The emulator is beside the encoder: three jumpers join them.
        Header(
            "JP1",
            pins(
                "a:1 b:3 z:5 tick_in:7 emulated_a:2 emulated_b:4 emulated_z:6 capture:8 spi_cs_n:13 spi_mosi:14 "
                "spi_miso:15 spi_sck:16 current_pdm:17 enable:18"
            ),
            ("gpio", 0),
        ),
    ),
    attributes={"io_standard": "3.3-V LVTTL"},
    pull_up={"weak_pull_up_resistor": "on"},
    leds=4,
    flow=None,
    loader=("-b", "de10nano"),
    bitstream=".rbf",
)
