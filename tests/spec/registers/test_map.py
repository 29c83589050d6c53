"""The map of the registers: bits of their fields, and numbers of the frames, as the pages have them."""

import pytest

from tachometry.hdl.export.registers.values import captured_values, in_unit
from tachometry.spec import of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.language.field import Field
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.demo import DemoMap, demo_map, demo_ports
from tachometry.spec.registers.loop import registers_of
from tachometry.spec.registers.map import RegisterMap

BASE = {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "100clk"}


def map_of(method: str = "s", **texts: str) -> RegisterMap:
    return RegisterMap(of_texts(method, BASE | {name.replace("_", "-"): text for name, text in texts.items()}))


def bits(registers: RegisterMap, name: str) -> list[tuple[str, int, int]]:
    return [(field.name, field.low, field.width) for field in registers[name].fields]


def test_what_has_more_than_a_bit_has_a_register() -> None:
    assert "INTERVAL" not in [one.name for one in map_of("m", average="1")]
    assert ("interval", 2, 1) in bits(map_of("m", average="1", index="yes", index_at="edge"), "STATUS")
    assert bits(map_of("m", average="2"), "INTERVAL") == [("value", 0, 32)]


def test_values_are_told_with_their_units() -> None:
    registers = map_of(position_width="48")
    position = next(value for value in captured_values(registers) if value.name == "position")
    assert (position.bits, position.field.shift, [word.name for word in position.words]) == (
        64,
        0,
        ["POSITION_LOW", "POSITION_HIGH"],
    )
    assert in_unit(Field("x", 1, unit="960 clocks")) == "One LSB is 960 clocks."
    assert in_unit(Field("x", 1, unit="2^-16 rad/s")) == "One LSB is 2^-16 rad/s."
    assert in_unit(Field("x", 1, unit="x2")) == "The unit is x2."
    assert in_unit(Field("x", 1)) == ""


def test_masks() -> None:
    assert [Field("x", 1, low).mask for low in (0, 1, 7)] == [1, 2, 0x80]
    assert [Field("x", width, 4).mask for width in (1, 4, 8)] == [0x10, 0xF0, 0xFF0]
    assert Field("x", 32).mask == 0xFFFF_FFFF


def test_registers_follow_each_other() -> None:
    registers = map_of()
    assert [
        one.name for one in registers
    ] == "IDENTIFICATION CONFIGURATION CONTROL COUNTERS VELOCITY STATUS INTERVAL PULSE_COUNT POSITION".split()
    assert [one.offset for one in registers] == [*range(0, 36, 4)]
    assert registers.address_width == 6  # there is an address behind the last register, 36
    assert [one.name for one in registers if one.captures] == ["VELOCITY"]
    assert [one.name for one in registers if one.constant] == ["IDENTIFICATION", "CONFIGURATION"]
    assert [one.name for one in registers if one.writable] == ["CONTROL"]
    assert [one.captured for one in registers] == [False] * 4 + [True] * 5


def test_bits_of_control_counters_and_status() -> None:
    registers = map_of(external_tick="yes", index="yes", index_at="edge")
    assert bits(registers, "CONTROL") == [("clear", 0, 1), ("hold", 1, 1)]
    assert [(one.access, one.reset) for one in registers["CONTROL"].fields] == [("wo", 0), ("rw", 0)]
    assert bits(registers, "COUNTERS") == [
        ("decode_errors", 0, 8),
        ("overflows", 8, 8),
        ("lost_updates", 16, 8),
        ("tick_errors", 24, 8),
    ]
    assert bits(registers, "STATUS") == [
        (name, low, 1) for low, name in enumerate(("updated", "indexed", "forced", "overflow", "standstill"))
    ]
    ports = [field.port for field in registers["STATUS"].fields]
    assert ports == ["", "", "forced", "overflow", "standstill"]  # what is not of the core comes first
    assert registers["IDENTIFICATION"].reset == 0x54414348  # TACH
    assert [one.reset for one in registers if not one.constant] == [0] * 8


def test_values_of_more_than_a_word_have_two() -> None:
    registers = map_of(position_width="33", velocity_width="64")
    for name in ("POSITION", "VELOCITY"):
        low, high = (registers[f"{name}_{end}"] for end in ("LOW", "HIGH"))
        assert [(one.fields[0].shift, one.fields[0].width, one.fields[0].low) for one in (low, high)] == [
            (0, 32, 0),
            (32, 32, 0),
        ]
        assert high.offset in (low.offset + 4, low.offset + 8)  # STATUS comes behind the first register
        assert (low.help.split()[0], high.help.split()[0]) == ("Lower", "Upper")
        assert [low.captures, high.captures] == [name == "VELOCITY", False]
    assert not registers["INTERVAL"].help.startswith(("Upper", "Lower"))
    assert map_of(position_width="32")["POSITION"].fields[0].width == 32


def loop_of(command: str) -> LoopSpec:
    core = of_texts("s", BASE | {"tick": "80us", "max-time": "800us", "max-speed": "500rad/s", "position-width": "40"})
    return LoopSpec(tachometer=core, gains="inputs", command=command, multiplier="parallel")


@pytest.mark.parametrize("command", ["ports", "generator"])
def test_what_is_written_is_held_within_the_bits_of_its_port(command: str) -> None:
    """But a position, which is taken modulo its period, and words that are used whole."""
    loop = loop_of(command)
    registers, ports = registers_of(loop), {port.name: port for port in loop.held_inputs}
    held: set[str] = set()
    for one, entry in zip(registers, registers.described()["map"], strict=True):
        for field, told in zip(one.fields, entry["fields"], strict=True):
            assert ("least" in told, "most" in told) == (field.most is not None, field.most is not None)
            if field.most is None or field.port == "current_limit":
                continue
            port = ports[field.port]
            bits = port.width - field.shift
            least, most = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if port.signed else (0, 2**bits - 1)
            assert (told["least"], told["most"]) == (field.least, field.most) == (least, most)
            held.add(port.name)
    gains = {"gain_position", "gain_velocity", "gain_acceleration", "gain_disturbance"}
    commands = {"ports": {"command_velocity", "command_acceleration"}, "generator": {"generator_amplitude"}}
    assert held == gains | commands[command]


def test_bits_of_a_loop() -> None:
    ports, made = (registers_of(loop_of(command)) for command in ("ports", "generator"))
    assert bits(ports, "LOOP") == [("enable", 0, 1), ("freeze", 1, 1)]
    assert bits(made, "LOOP") == [("enable", 0, 1), ("freeze", 1, 1), ("mode", 4, 2)]
    assert all(field.writable for field in made["LOOP"].fields)
    words = [ports[f"COMMAND_POSITION_{end}"].fields[0] for end in ("LOW", "HIGH")]
    # 40 bits before the point, and eight behind it.
    assert [(word.shift, word.kept, word.signed) for word in words] == [(0, 32, False), (32, 16, True)]
    limit = ports["CURRENT_LIMIT"].fields[0]
    assert (limit.least, limit.most, limit.reset) == (0, limit.reset, limit.most)
    told = {text.removeprefix("One LSB of generator_") for *_, text in made.quantities}
    units = {"velocity": "counts/tick", "acceleration": "counts/tick²", "amplitude": "counts", "rate": "1"}
    assert told >= {f"{name} in {unit}; a tick is a control tick." for name, unit in units.items()}


def test_bits_of_a_demo() -> None:
    """As docs/guides/boards.md has them."""
    demo = DemoMap(of_texts("s", BASE | {"max-speed": "500rad/s"}))
    assert bits(demo, "DEMO") == [("emulated", 0, 1), ("restart", 1, 1), ("jump", 2, 1)]
    assert [field.single for field in demo["DEMO"].fields] == [False, True, True]
    assert bits(demo, "ERRORS") == [("phase_error", 0, 8), ("duty_a", 8, 8), ("duty_b", 16, 8)]
    assert bits(demo, "NOISE") == [("jitter", 0, 6), ("bounce", 8, 8), ("drop", 16, 8), ("glitches", 24, 8)]
    assert bits(demo, "WIRES") == [("broken", 0, 3), ("stuck", 8, 3)]
    assert bits(demo, "TELEMETRY") == [("telemetry_period", 0, 16)]


def test_a_demo_shows_of_its_core_the_drive_of_the_loop_alone() -> None:
    """All that is captured is read through the bus, and is no pin of a board."""
    core, loop = demo_map(of_texts("s", BASE)), demo_map(loop_of("ports"))
    bus = bus_of("uart")
    assert bus is not None
    ports = [[port for port in demo_ports(demo, bus) if port.direction == "output"] for demo in (core, loop)]
    alone, driven = ([port.name for port in each] for each in ports)
    assert alone == [port for port in driven if port != "current_pdm"]
    assert driven == ["uart_tx", "emulated_a", "emulated_b", "current_pdm", "leds"]
