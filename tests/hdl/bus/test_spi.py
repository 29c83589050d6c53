"""The SPI bridge alone: every access, at its clock, and every bit that it sends."""

import numpy as np
import pytest
from support.bridge import check
from support.serial import SpiHost

from tachometry.hdl.bus import spi
from tachometry.spec.registers.frames import SPI_SCK_CYCLES

WORDS, N_WORDS, CONTROL, VELOCITY = 4, 13, 2, 4
FRAMES = 12


def at_the_limit(host: SpiHost, half: float = SPI_SCK_CYCLES / 2) -> None:
    """Frames in which sck is low and high for so many clocks, in every phase to the clock."""
    for phase in (0, 0.25, 0.5, 0.75):
        host.time = np.ceil(host.time) + phase
        host.frame(bytes([VELOCITY, *host.rng.bytes(10)]), 88, half, half)
        host.frame(bytes([0x80 | CONTROL, *host.rng.bytes(5)]), 48, half, half)


@pytest.mark.parametrize("seed", range(2))
def test_accesses_and_answers(seed: int) -> None:
    """Random frames, of which the first ones are at the greatest speed."""
    rng = np.random.default_rng(seed)
    host = SpiHost(rng, 20, WORDS)
    at_the_limit(host)
    for _ in range(FRAMES):
        host.random_frame(CONTROL, VELOCITY, N_WORDS, 3)
    check(lambda registers: spi.SpiBridge(registers), host, "spi_miso")


def test_the_limit_is_no_lower() -> None:
    """At a higher speed miso would come too late."""
    host = SpiHost(np.random.default_rng(0), 20, WORDS)
    at_the_limit(host, SPI_SCK_CYCLES / 2 - 1)
    with pytest.raises(AssertionError, match=r"^clock \d+, "):
        check(lambda registers: spi.SpiBridge(registers), host, "spi_miso")


def test_unselected() -> None:
    """A clock on sck while another chip is selected, and a frame that was under way at reset."""
    host = SpiHost(np.random.default_rng(0), 1, WORDS)
    host.put("spi_cs_n", 0, 0)
    for clock in range(2, 802, 8):
        host.put("spi_sck", clock, 1)
        host.put("spi_sck", clock + 4, 0)
        host.put("spi_mosi", clock - 1, clock >> 4 & 1)
        host.samples.append((clock, 0))
    host.put("spi_cs_n", 500, 1)
    host.time = 820.0
    host.frame(bytes([VELOCITY, 0, 0, 0, 0, 0]), 48, 4, 4)
    check(lambda registers: spi.SpiBridge(registers), host, "spi_miso")
