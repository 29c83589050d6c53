"""Registers over SPI and UART, of the exported core in Icarus and Verilator, while the encoder turns."""

from pathlib import Path

import numpy as np
import pytest
from support.exported_bus import SPEC, START, Simulate, check, in_icarus, in_verilator
from support.nightly import nightly
from support.serial import Host, SpiHost, UartHost

from tachometry.spec.registers.map import RegisterMap

REGISTERS = RegisterMap(SPEC)
WORDS = REGISTERS.address_width - 2
N_WORDS = len(REGISTERS.registers)
CONTROL, VELOCITY = (REGISTERS[name].offset // 4 for name in ("CONTROL", "VELOCITY"))
ALL = (CONTROL, VELOCITY, N_WORDS, N_WORDS - VELOCITY)
BIT_CYCLES = 8
BAUD = SPEC.timing.clock_hz // BIT_CYCLES
SIMULATORS = [pytest.param(in_verilator, 10_000, marks=nightly), (in_icarus, 250)]


def all_registers_are_read(host: Host) -> None:
    """A register that the random accesses leave out fails the test."""
    assert {access.address for access in host.accesses if access.data is None} >= set(range(N_WORDS))


def over_spi(simulate: Simulate, n_accesses: int, folder: Path) -> None:
    host = SpiHost(np.random.default_rng(n_accesses), START, WORDS)
    while len(host.accesses) < n_accesses:
        host.random_frame(*ALL)
    all_registers_are_read(host)
    check(simulate, host, "spi", "spi_miso", folder)


def over_uart(simulate: Simulate, n_accesses: int, folder: Path) -> None:
    host = UartHost(np.random.default_rng(n_accesses), START, WORDS, BIT_CYCLES)
    while len(host.accesses) < n_accesses:
        host.random_exchange(*ALL)
        if host.rng.random() < 0.3:
            host.random_damage(*ALL)
    all_registers_are_read(host)
    check(simulate, host, "uart", "uart_tx", folder, BAUD)


@pytest.mark.parametrize(("simulate", "n_accesses"), SIMULATORS)
def test_over_spi(simulate: Simulate, n_accesses: int, tmp_path: Path) -> None:
    over_spi(simulate, n_accesses, tmp_path)


# The exported core is the same as over SPI, and tests/hdl/bus/test_uart.py has the line.
@nightly
@pytest.mark.parametrize(("simulate", "n_accesses"), SIMULATORS)
def test_over_uart(simulate: Simulate, n_accesses: int, tmp_path: Path) -> None:
    over_uart(simulate, n_accesses, tmp_path)
