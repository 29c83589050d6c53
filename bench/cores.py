"""The cores of `cores.toml`, which `make size` measures."""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from amaranth.lib import wiring
from pages import data

from tachometry.boards.fpga import ecp5_memory
from tachometry.hdl.core.demo import Demo
from tachometry.hdl.export import export
from tachometry.hdl.export.files import top_of
from tachometry.hdl.export.verilog import verilog_of
from tachometry.sim.studies.size import CORE, TARGETS
from tachometry.spec import Port, TachometerSpec, of_options
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import bus_of, ports_on
from tachometry.spec.registers.demo import DemoMap, demo_manifest, demo_ports

_DATA = data("cores")


@dataclass(frozen=True)
class Configuration:
    """A core to be measured; cores.toml explains the fields."""

    name: str
    what: str
    spec: AnySpec
    bars: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_option: bool = False
    targets: tuple[str, ...] = tuple(TARGETS)
    bus: str = "none"
    demo: bool = False  # with emulator and telemetry
    missed: str = ""
    after: str = ""  # source of a script that changes the netlist, see `Target`

    @property
    def has_speed_bar(self) -> bool:
        """Whether its Fmax has to reach something on any target."""
        return any("Fmax" in bars for bars in self.bars.values())

    @property
    def component(self) -> wiring.Component:
        """The core, with its registers on its bus if it has one."""
        bus = bus_of(self.bus)
        if self.demo and bus is not None and isinstance(self.spec, TachometerSpec):
            return Demo(DemoMap(self.spec), bus)
        return top_of(self.spec, bus)

    @property
    def hardware(self) -> tuple[str, tuple[Port, ...]]:
        """Verilog and ports."""
        bus = bus_of(self.bus)
        if self.demo and bus is not None and isinstance(self.spec, TachometerSpec):
            registers = DemoMap(self.spec)
            described = {"generator": "", "license": "", **demo_manifest(registers, bus, CORE)}
            return verilog_of(self.component, described), demo_ports(registers, bus)
        return export(self.spec, CORE, self.bus)[f"{CORE}.v"], ports_on(self.spec, bus)


def _texts(options: str) -> dict[str, str]:
    first, *others = options.split()
    base = _texts(_DATA["core"][0]["options"]) if first == "reference" else {"method": first} | _pairs(_DATA["usual"])
    return {name: text for name, text in (base | _pairs(" ".join(others))).items() if text}


def _pairs(words: str) -> dict[str, str]:
    return dict(word.split("=", 1) for word in words.split())


def _configuration(
    options: str, targets: tuple[str, ...] = tuple(TARGETS), output_register: bool = False, **more: Any
) -> Configuration:
    after = inspect.getsource(ecp5_memory) if output_register else ""
    return Configuration(spec=of_options(_texts(options)), targets=tuple(targets), after=after, **more)


CONFIGURATIONS = tuple(_configuration(**each) for each in _DATA["core"])
