"""The client of a core with a control loop, with registers that keep what is written."""

import math
from typing import Any

import pytest

from tachometry.boards.host import loop
from tachometry.boards.host.registers import HostRegisters
from tachometry.spec import of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.form import Term
from tachometry.spec.registers.buses import bus_of, manifest_on
from tachometry.spec.registers.loop import LoopMap, registers_of

CORE = of_texts("s", {"ppr": "500", "max-speed": "1000rad/s"})


class Registers:
    """Words by their offsets, and all writes."""

    def __init__(self, **options: Any) -> None:
        self.spec = LoopSpec(tachometer=CORE, gains="inputs", **options)
        self.map = registers_of(self.spec)
        assert isinstance(self.map, LoopMap)
        bus = bus_of("native")
        assert bus is not None
        self.manifest = manifest_on(self.map, bus)
        self.words = {one.offset: one.reset for one in self.map}
        self.written: list[tuple[str, int]] = []
        self.client = loop.LoopClient(self.words.__getitem__, self.write, self.manifest)

    def write(self, offset: int, value: int) -> None:
        self.words[offset] = value
        self.written.append((next(one.name for one in self.map if one.offset == offset), value))


def test_settings() -> None:
    """Settings are written while frozen, and refused before anything is written."""
    there = Registers()
    client, form = there.client, there.spec.form
    client.enable(True)
    client.set(gain_position=100.0, current_limit=20.0, command_position=-0.5)
    assert there.written == [
        ("LOOP", 1),
        ("LOOP", 3),
        ("GAIN_POSITION", form.reset_gains[Term.POSITION]),
        ("CURRENT_LIMIT", form.current_limit),
        ("COMMAND_POSITION_LOW", (1 << 32) - 128),
        ("COMMAND_POSITION_HIGH", (1 << 32) - 1),
        ("LOOP", 1),
    ]
    there.written.clear()
    with pytest.raises(ValueError, match=r"^current_limit must be from 0 to 20, not 20\.5$"):
        client.set(gain_velocity=1.0, current_limit=20.5)
    with pytest.raises(ValueError, match=r"^command_position must be from -2\.14748365e\+09 to "):
        client.set(command_position=3e9)
    with pytest.raises(ValueError, match=r"^gain_velocity must be a finite number, not inf$"):
        client.set(gain_velocity=math.inf)
    with pytest.raises(KeyError, match=r"there is no setting 'bogus'; there are gain_position, "):
        client.set(bogus=1)
    with pytest.raises(KeyError, match=r"there is no setting 'mode': the core has no command generator"):
        client.set(mode=2)
    assert not there.written
    (upper,) = (one for one in there.manifest["registers"]["map"] if one["name"] == "COMMAND_POSITION_HIGH")
    upper["fields"][0] |= {"least": -4, "most": 3}  # those of two words are the upper one's
    assert HostRegisters(there.manifest).limits("COMMAND_POSITION")[1:] == (-4 << 32, (4 << 32) - 1)


def test_a_generator() -> None:
    there = Registers(command="generator")
    assert "command_position" not in there.client.settings
    with pytest.raises(ValueError, match=r"^mode must be from 0 to 3, not 4$"):
        there.client.set(mode=4)
    there.client.set(mode=1, generator_velocity=-0.25, generator_acceleration=2.0**-20)
    fraction, shift = there.spec.generator.fraction, there.spec.generator.velocity_shift
    assert there.written[1:] == [
        ("GENERATOR_VELOCITY", (1 << 32) - (1 << fraction - shift - 2)),
        ("GENERATOR_ACCELERATION", 1 << fraction - 20),
        ("LOOP", 1 << 4),
    ]


def test_a_core_without_a_loop_is_refused() -> None:
    there = Registers()
    with pytest.raises(ValueError, match=r"^manifest must be that of a core with a control loop, which --loop makes$"):
        loop.LoopClient(there.words.__getitem__, there.write, {"registers": {}})
