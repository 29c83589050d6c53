"""The Arty A7-35 has an Artix-7, and is built with Vivado."""

from tachometry.boards.fpga.board import Board, Header, pins, platform

ARTY_A7_35 = Board(
    name="arty-a7-35",
    title="Arty A7-35, Artix-7 XC7A35T",
    clock_hz=100_000_000,
    platform=platform("arty_a7:ArtyA7_35Platform"),
    headers=(
        # Of JA and JD the lines have resistors of 200 Ω. The emulator is below the encoder: three jumpers join them.
        Header("JA", pins("a:1 b:2 z:3 tick_in:4 emulated_a:7 emulated_b:8 emulated_z:9 capture:10"), ("pmod", 0)),
        Header("JD", pins("spi_cs_n:1 spi_mosi:2 spi_miso:3 spi_sck:4 current_pdm:7 enable:8"), ("pmod", 3)),
    ),
    attributes={"IOSTANDARD": "LVCMOS33"},
    pull_up={"PULLUP": "TRUE"},
    leds=4,
    flow=None,
    loader=("-b", "arty_a7_35t"),
    bitstream=".bit",
)
