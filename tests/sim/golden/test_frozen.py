"""Descriptions of cores and results of golden models cannot be changed by whom they are given to."""

import dataclasses
import sys
from functools import cache

import numpy as np
import pytest
from support.options import had_by

from tachometry.hdl.export.registers.files import register_files
from tachometry.hdl.export.registers.values import captured_values
from tachometry.sim import golden
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.lockstep import Lockstep
from tachometry.spec import METHODS, Encoder, of_texts
from tachometry.spec.registers import frames, manifest
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.map import RegisterMap

ROOMS = ("tachometry.spec.", "tachometry.sim.golden.", "tachometry.sim.signals.run", "tachometry.sim.studies.lockstep")
SMALL = {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "100clk", "bounds": "yes", "lowpass": "1kHz"}


@cache
def used() -> None:
    """Something of every module, so that it can be told from others which this test runs."""
    line = (np.arange(3000) // 30 % 2).astype(np.uint8)
    trace = PinTrace(np.arange(3000), line, np.zeros_like(line), 3000)
    for method in METHODS:
        spec = of_texts(method, had_by(method, SMALL))
        run = golden.run(spec, trace)
        Lockstep(trace, run, run, 0, [])
        registers = RegisterMap(spec)
        GoldenBank(registers, trace).answers([Access(250, 4)])
        assert manifest.manifest(spec)
        assert captured_values(registers)[0].bits == 32
        assert register_files(registers, "core")
    of_texts("s", {"ppr": "8", "max-time": "1s", "unit": "rpm"})
    of_texts("rairan", {"ppr": "8", "adaptive": "10%", "max-speed": "100rpm"})
    assert bus_of("spi") is not None
    assert frames.decode_request(frames.read_request(3)).address == 3


def test_every_dataclass_is_frozen() -> None:
    used()
    found = {
        value
        for name, module in sys.modules.items()
        if name.startswith(ROOMS)
        for value in vars(module).values()
        if isinstance(value, type) and dataclasses.is_dataclass(value) and value.__module__.startswith(ROOMS)
    }
    assert len(found) > 30
    for made in found:
        assert made.__dataclass_params__.frozen, made  # type: ignore[attr-defined]


@pytest.mark.parametrize("method", METHODS)
def test_parameters_of_a_core_are_given_by_name(method: str) -> None:
    used()
    for base in METHODS[method].__mro__[:-1]:
        assert not getattr(base, "__match_args__", ()), base
    with pytest.raises(TypeError, match="positional"):
        METHODS[method](Encoder(8))  # type: ignore[call-arg]
