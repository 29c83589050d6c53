"""Registers of the demo: those of the core, and the settings of its encoder emulator."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tachometry.spec.control import LoopSpec
from tachometry.spec.core.extras.extra import refuse
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.field import WORD, Draft, Field
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import TICK, Port, held
from tachometry.spec.registers.buses import Bus, distinct, manifest_on
from tachometry.spec.registers.emulator import (
    BOUNCE_WIDTH,
    DROP_WIDTH,
    ERROR_WIDTH,
    JITTER_WIDTH,
    NOISE_WIDTH,
    RATE_SHIFT,
    WIRES_WIDTH,
)
from tachometry.spec.registers.loop import LoopMap
from tachometry.spec.registers.manifest import described_port
from tachometry.spec.registers.map import RegisterMap

ENCODER_LINES = ("a", "b", "z")
LEDS = 4
PERIOD_WIDTH = 16  # bits of the telemetry's period


def emulated(spec: TachometerSpec) -> tuple[int | None, int, tuple[str, ...]]:
    """Return what the emulator of a core's encoder has: pulses per revolution if there is an index, the quarter in
    which that is high, and the lines that come with their complements.
    """
    return spec.encoder.pulses_per_rev if spec.index else None, spec.front_end.index_place, spec.front_end.complemented


@dataclass(frozen=True)
class DemoMap(RegisterMap):
    """Holds all registers of a demo.

    A write takes effect in the next clock, and CHANGED keeps the instant of the write. So whoever knows all writes
    since a restart knows every edge that the emulator has made.
    """

    def __post_init__(self) -> None:
        encoder = self.spec.encoder
        if not encoder.plain and (encoder.reverse or not encoder.sampled):
            rest = "must be quadrature or an absolute encoder on boards, not reversed or inverted"
            raise ParameterError("sensor", rest)
        refuse(self.spec.extras, "demo")

    @cached_property
    def ports(self) -> tuple[Port, ...]:
        """Outputs of the core that are captured, and the time."""
        time = held(TICK, "time", WORD, unit="clocks", help="Time of the capture, since the last restart; it wraps.")
        return (*super().ports, time)

    @property
    def inputs(self) -> list[Port]:
        """Inputs, but for complements and reads, which a demo makes of the lines, as boards have no pins for them."""
        made = {f"{line}_n" for line in self.spec.front_end.complemented} | {*self.reads}
        return [port for port in self.core_ports if port.direction == "input" and port.name not in made]

    @property
    def reads(self) -> tuple[str, ...]:
        """Inputs with positions that something else than the core reads."""
        sampled = self.spec.reads is None and self.spec.encoder.sampled
        return tuple(port.name for port in sampled.ports(self.spec.tick.longest)) if sampled else ()

    @property
    def emulated(self) -> tuple[Field, ...]:
        """Settings of the emulator."""
        others = ("telemetry_period", "emulated", "restart")
        own = (field for _, _, fields, _ in DemoMap._added(self) for field in fields if field.writable)
        return tuple(field for field in own if field.port not in others)

    def _added(self) -> Iterable[Draft]:
        telemetry = "Nominal ticks from a frame of telemetry to the next; 0: there are none."
        yield "TELEMETRY", "What is sent unasked.", (_setting("telemetry_period", PERIOD_WIDTH, 0, telemetry),), {}
        changed = Field("value", WORD, unit="clocks", port="changed")
        yield "CHANGED", "Time of the last write to any register, since the last restart.", (changed,), {}
        fields: tuple[Field, ...] = (
            _setting("emulated", 1, 0, "The tachometer measures the emulator, not the pins."),
            _strobe("restart", 1, "Writing 1 resets the tachometer and the emulator, but not the settings."),
            _strobe("jump", 2, "Writing 1 turns the emulated encoder by half a period: both lines change at once."),
        )
        yield "DEMO", "What is measured, and what happens once.", fields, {}
        unit = "2^-32 periods of a line in a clock"
        speed = Field("value", WORD, writable=True, signed=True, unit=unit, port="speed")
        yield "SPEED", "Speed that the emulator goes to.", (speed,), {}
        unit = f"2^-{WORD + RATE_SHIFT + 1} periods of a line in a clock squared"
        rate = Field("value", WORD, writable=True, unit=unit, port="rate")
        yield "RATE", "How fast the emulator's speed goes there; 0: at once.", (rate,), {}
        unit = "in 2^-10 periods of a line, in two's complement."
        errors = ("phase_error", "How late B rises,"), ("duty_a", "How late A falls,"), ("duty_b", "How late B falls,")
        fields = tuple(
            _setting(name, ERROR_WIDTH, 8 * k, f"{help} {unit}", signed=True) for k, (name, help) in enumerate(errors)
        )
        yield "ERRORS", "Where the emulated edges are wrong, in every period alike.", fields, {}
        bits = "each set bit takes part."
        fields = (
            _setting("jitter", JITTER_WIDTH, 0, f"Edges move by up to this to either side, in 2^-10 periods; {bits}"),
            _setting("bounce", BOUNCE_WIDTH, 8, "Clocks for which a line bounces after each of its edges."),
            _setting("drop", DROP_WIDTH, 16, "So many of 256 edges of each line are left out."),
            _setting("glitches", NOISE_WIDTH, 24, "In so many of 65536 clocks both A and B have the wrong level."),
        )
        yield "NOISE", "Where the emulated edges are wrong, at random.", fields, {}
        fields = (
            _setting("broken", WIRES_WIDTH, 0, "Lines A, B, Z (bits 0 to 2) that are high, as open inputs are."),
            _setting("stuck", WIRES_WIDTH, 8, "Lines A, B, Z (bits 0 to 2) that stay as they are."),
        )
        yield "WIRES", "Lines of the emulated encoder that are at fault.", fields, {}


@dataclass(frozen=True)
class DemoLoopMap(LoopMap, DemoMap):
    """Holds all registers of a demo of a core with a control loop: first those of the loop, then those of the demo.

    It raises ParameterError if the gains of the loop are fixed.
    """

    def _added(self) -> Iterable[Draft]:
        yield from LoopMap._added(self)
        yield from DemoMap._added(self)


_DEMOS: dict[str, type[DemoMap]] = {"one": DemoMap, "loop": DemoLoopMap}


def demo_map(spec: TachometerSpec | LoopSpec) -> DemoMap:
    """Return all registers of the demo of a core; ParameterError if the gains of a loop are fixed."""
    return _DEMOS[spec.kind].of(spec)


def demo_ports(registers: DemoMap, bus: Bus) -> tuple[Port, ...]:
    """Return all ports of a demo on a bus; ParameterError if two have one name."""
    inputs, reads = registers.inputs, registers.spec.reads
    line, *others = [port.name for port in reads.ports] if reads else ["z"]
    driven = [port for port in registers.core_ports if port.name in ("current_pdm", *others)]  # a stream of bits
    emulated = [
        Port(f"emulated_{pin.name}", "output", help=f"Line {pin.name.upper()} of the emulated encoder.")
        for pin in inputs
        if pin.name in (*ENCODER_LINES, line)
    ]
    lights = "The shaft turns; it turned backward at the last update; something went wrong; the clock runs."
    leds = Port("leds", "output", LEDS, help=lights)
    return distinct((*inputs, *bus.ports(registers), *emulated, *driven, leds), bus)


def demo_manifest(registers: DemoMap, bus: Bus, name: str = "tachometer") -> dict[str, Any]:
    """Return the manifest of a demo on a bus.

    It raises ParameterError if `name` cannot be the name of a module; if the clock cannot make the bits of the bus.
    """
    ports = demo_ports(registers, bus)
    if name in {port.name for port in ports}:
        raise ParameterError("name", f"must not be the name of a port: {name!r}")
    return {**manifest_on(registers, bus, name), "ports": [described_port(port) for port in ports]}


def _setting(name: str, width: int, low: int, help: str, *, signed: bool = False) -> Field:
    return Field(name, width, low, help, writable=True, signed=signed, port=name)


def _strobe(name: str, low: int, help: str) -> Field:
    return Field(name, 1, low, help, writable=True, single=True, port=name)
