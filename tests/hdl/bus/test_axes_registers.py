"""Registers of many axes against their golden model, and a driver in C that reads those of every axis at once."""

import pytest
from amaranth.hdl import Fragment
from hdl.bus.test_bank import differing, random_accesses
from support.axes import motions, small

from tachometry.hdl.bus import bank
from tachometry.hdl.bus.bank import RegisterBank
from tachometry.hdl.core import axes_registers
from tachometry.sim.golden.axes_registers import GoldenAxesBank
from tachometry.spec import AxesSpec, ParameterError
from tachometry.spec.core.index import Index
from tachometry.spec.registers.axes import AxesMap


@pytest.mark.parametrize(
    ("seed", "spec"),
    [
        (5, small(3, parallel=True, index=Index())),
        (4, small(2, parallel=True, most=None, velocity_width=9, external_tick=True, position_width=40)),
    ],
)
def test_registers_are_those_of_the_golden_model(seed: int, spec: AxesSpec, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bank, "_DEEPEST", 7)  # less than there are, as with more axes
    registers = AxesMap(spec.tachometer, spec)
    assert [one.name for one in registers.status] == [f"STATUS_{axis}" for axis in range(spec.axes)]
    trace = motions(spec, 1500)
    played, golden = random_accesses(registers, seed, trace.n_clocks), GoldenAxesBank(registers, trace)
    assert len({data for data, _ in golden.answers(*played)}) > 25
    assert differing(axes_registers.AxesRegisterCore(registers), trace, played, golden) == []


def test_64_axes_have_registers() -> None:
    """Amaranth follows expressions by recursion, and Python's has an end."""
    spec = small(64, parallel=True, tick=448)
    Fragment.get(RegisterBank(AxesMap(spec.tachometer, spec)), None).prepare()


def test_registers_are_of_what_is_held_for_each_axis() -> None:
    spec = small(3)
    with pytest.raises(ParameterError, match="parallel must be given together with --axes and --bus:"):
        AxesMap(spec.tachometer, spec)


def test_every_axis_has_a_window_of_the_same_size() -> None:
    spec = small(3, parallel=True, index=Index())
    registers = AxesMap(spec.tachometer, spec)
    windows = [[one for one in registers if one.name.endswith(f"_{axis}")] for axis in range(3)]
    assert [one.offset - windows[0][0].offset for one in windows[2]] == [
        2 * (windows[1][0].offset - windows[0][0].offset) + one.offset - windows[0][0].offset for one in windows[0]
    ]
    names = [[one.name[:-2] for one in window] for window in windows]
    assert names[0] == names[1] == names[2]
    assert [one.name for one in registers if one.captures] == ["VELOCITY_0"]
