"""The Tang Nano 9K has a Gowin GW1NR-9C."""

from tachometry.boards.fpga.board import Board, Header, pins, platform
from tachometry.boards.fpga.flow import gowin

_PART = "GW1NR-LV9QN88PC6/I5"


TANG_NANO_9K = Board(
    name="tang-nano-9k",
    title="Tang Nano 9K, GW1NR-9C",
    clock_hz=27_000_000,
    platform=platform("tang_nano_9k:TangNano9kPlatform", toolchain="Apicula"),
    headers=(
        # Pins with 3.3 V: those from 79 on have 1.8 V.
        Header(
            "pin",
            pins(
                "a:25 b:26 z:27 tick_in:28 capture:29 emulated_a:30 emulated_b:33 emulated_z:34 spi_cs_n:40 "
                "spi_mosi:35 spi_miso:41 spi_sck:42 current_pdm:51 enable:53"
            ),
        ),
    ),
    attributes={"IO_TYPE": "LVCMOS33"},
    pull_up={"PULL_MODE": "UP"},
    leds=4,
    flow=gowin(_PART, "GW1N-9C"),
    loader=("-b", "tangnano9k"),
)
