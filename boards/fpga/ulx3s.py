"""The ULX3S comes with ECP5 of four sizes."""

from tachometry.boards.fpga.board import Board, Header, pins, platform
from tachometry.boards.fpga.flow import ecp5


def _board(size: int, die: int) -> Board:
    return Board(
        name=f"ulx3s-{size}f",
        title=f"ULX3S, ECP5 LFE5U-{size}F",
        clock_hz=25_000_000,
        platform=platform(f"ulx3s:ULX3S_{size}F_Platform"),
        headers=(
            # The emulator is beside the encoder: three jumpers join them.
            Header(
                "J1",
                pins(
                    "a:0+ b:1+ z:2+ tick_in:3+ emulated_a:0- emulated_b:1- emulated_z:2- capture:3- spi_cs_n:4+ "
                    "spi_mosi:4- spi_miso:5+ spi_sck:5- current_pdm:6+ enable:6-"
                ),
                ("gpio", 0),
            ),
        ),
        attributes={"IO_TYPE": "LVCMOS33"},
        pull_up={"PULLMODE": "UP"},
        leds=4,
        flow=ecp5(f"--{die}k", "--package", "CABGA381", "--speed", "6"),
        loader=("-b", "ulx3s"),
    )


# A 12F has the die of a 25F.
ULX3S = tuple(_board(size, die) for size, die in ((12, 12), (25, 25), (45, 45), (85, 85)))
