"""Observer and controller against the golden ones, with made-up updates, positions and commands."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from support.control import CONVENTIONAL, SERIAL, SMALL, UNFILTERED, WITH_INPUTS, check
from support.mutant import caught, mutant
from support.nightly import only

from tachometry.hdl.control.controller import Controller
from tachometry.hdl.control.product import ParallelProduct, SerialProduct
from tachometry.hdl.control.update_window import UpdateWindow
from tachometry.spec.control import LoopSpec

SPECS = {"synchronised": SMALL, "conventional": CONVENTIONAL, "unfiltered": UNFILTERED, "inputs": WITH_INPUTS}


# Of the four, these two have all that the others have, and both ways of gains.
FEW = ("synchronised", "inputs")


@pytest.mark.parametrize("name", only(FEW[1:], SPECS))
def test_with_the_greatest_numbers(name: str) -> None:
    spec = SPECS[name]
    wanted = check(spec, 100)
    assert np.mean(wanted.current_saturated) > 0.8
    assert np.abs(wanted.filtered_velocity).max() > spec.form.most_y / 8


@pytest.mark.parametrize("name", only(FEW, SPECS))
def test_with_numbers_that_saturate_now_and_then(name: str) -> None:
    wanted = check(SPECS[name], 120, less=8)
    assert 0.2 < np.mean(wanted.current_saturated) < 0.8
    assert len(np.unique(wanted.current)) > 50


def test_with_a_serial_multiplier() -> None:
    check(SERIAL, 40, less=8)


# Coefficients of more bits than gains, and a limit that is not all ones.
FEW_BITS = replace(WITH_INPUTS, observer=Fraction(2), filter=None)
ODD_LIMIT = replace(WITH_INPUTS, current_limit=Fraction(17))
MUTANTS: dict[str, tuple[Any, str, str, LoopSpec, int]] = {
    "the last update counts": (UpdateWindow, "self.update & (~waits | self.tick)", "self.update", SMALL, 8),
    "waits for ever": (UpdateWindow, "waits | (self.n == self._longest)", "waits", SMALL, 8),
    "an update before the first tick": (
        UpdateWindow,
        "self.update & (ticked | self.tick)",
        "self.update",
        UNFILTERED,
        0,
    ),
    "an update with the tick is lost": (UpdateWindow, "(ticked | self.tick)", "(ticked & ~self.tick)", SMALL, 8),
    "updates last": (UpdateWindow, "ticked.eq(1), waits.eq(0)", "ticked.eq(1)", SMALL, 8),
    "the first velocity is held": (
        UpdateWindow,
        "with m.If(self.update):\n                m.d.sync += self.held",
        "with m.If(self.update & (self.held == 0)):\n                m.d.sync += self.held",
        CONVENTIONAL,
        8,
    ),
    "the latest current alone": (UpdateWindow, "self.current_sum + self.current", "self.current", SMALL, 8),
    "ticks are not counted": (UpdateWindow, "self.n + 1", "1", SMALL, 8),
    "the window is not cleared": (UpdateWindow, "[self.n.eq(0), self.current_sum.eq(0)]", "[self.n.eq(0)]", SMALL, 8),
    "the current is not rounded": (Controller, "1 << (GUARD_BITS - 1), total)", "0, total)", SMALL, 8),
    "the sum begins with the one before": (
        Controller,
        "Mux(first, 1 << (GUARD_BITS - 1), total)",
        "total",
        SMALL,
        8,
    ),
    "always enabled": (Controller, "Mux(enabled, limited, 0)", "limited", SMALL, 8),
    "saturated where not enabled": (Controller, "(beyond | changed) & enabled", "beyond | changed", SMALL, 0),
    "commands are not held": (Controller, "velocity << (fine", "self.command_velocity << (fine", SMALL, 8),
    "position error is not held": (
        Controller,
        "held, _ = saturate(m, total, form.most_error)",
        "held = total",
        SMALL,
        0,
    ),
    "position error without the position": (Controller, "self.position << form.position_bits", "0", SMALL, 8),
    "an update every time": (Controller, "due.eq(self.due)", "due.eq(1)", SMALL, 8),
    "w without the change of y": (
        Controller,
        "to_w.eq(term <= Term.CURRENT)",
        "to_w.eq((term <= Term.CURRENT) & (term != 0))",
        SMALL,
        8,
    ),
    "no step without a filter": (Controller, "Mux(skipped, word, product.product)", "product.product", UNFILTERED, 8),
    "the table of another term": (Controller, "{one: places[values] for one", "{one: 0 for one", SMALL, 8),
    "a gain is its lower bits": (Controller, "GAIN_PORTS[one]) << form.gain_shift", "GAIN_PORTS[one])", FEW_BITS, 8),
    "a limit beyond that of the option": (
        Controller,
        "Mux(self.current_limit > form.current_limit, form.current_limit, self.current_limit)",
        "self.current_limit",
        ODD_LIMIT,
        0,
    ),
    "a limit of one side": (Controller, "Mux(below, -limit, value)", "value", WITH_INPUTS, 8),
    "not saturated below": (Controller, "changed.eq(above | below)", "changed.eq(above)", WITH_INPUTS, 8),
    "a product is not rounded": (ParallelProduct, "whole + (1 << (bits - 1))", "whole", SMALL, 8),
    "a serial product is not rounded": (SerialProduct, "Cat(last, Mux", "Cat(0, Mux", SERIAL, 8),
    "a bit is left out": (SerialProduct, "left.eq(bits - 1)", "left.eq(bits - 2)", SERIAL, 8),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    box, right, wrong, spec, less = MUTANTS[name]
    with mutant(box, right, wrong), caught():
        check(spec, 25 if spec is SERIAL else 80, less=less)
