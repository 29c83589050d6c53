"""The component for Platform Designer: every port of the module once, in an interface whose parts are declared."""

import shlex

import pytest

from tachometry.hdl.export import export
from tachometry.spec import of_options
from tachometry.spec.registers.buses import BUSES, ports_on

BASE = {"method": "s", "ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us", "max-speed": "400rad/s"}
LITE = "awaddr awprot awvalid awready wdata wstrb wvalid wready bresp bvalid bready araddr arprot arvalid arready rdata"
ROLES = {
    "axi-lite": {*LITE.split(), "rresp", "rvalid", "rready"},
    "apb": {*"paddr psel penable pwrite pwdata pready prdata pslverr".split()},
    "none": set(),
}


@pytest.mark.parametrize("bus", ROLES)
def test_every_port_is_in_an_interface(bus: str) -> None:
    spec = of_options(BASE | {"index": "yes", "stream": "axi"})
    files = export(spec, "spindle", bus, target="quartus", irq=bus == "apb")
    rows = [shlex.split(line) for line in files["spindle_hw.tcl"].splitlines() if not line.startswith("#")]
    kinds = {row[1]: tuple(row[2:]) for row in rows if row[:1] == ["add_interface"]}
    ports = {row[2]: (row[1], *row[3:]) for row in rows if row[:1] == ["add_interface_port"]}
    wanted = {port.name: (port.direction.capitalize(), str(port.width)) for port in ports_on(spec, BUSES.get(bus))}
    wanted |= {"irq": ("Output", "1")} if bus == "apb" else {}
    assert {name: row[2:] for name, row in ports.items()} == wanted
    assert {row[0] for row in ports.values()} == {*kinds}
    name = {"axi-lite": "s_axi", "apb": "s_apb"}.get(bus)
    assert {row[1] for row in ports.values() if row[0] == name} - {"awprot", "arprot"} == ROLES[bus] - {
        "awprot",
        "arprot",
    }
    assert kinds.get(name or "") == {"s_axi": ("axi4lite", "end"), "s_apb": ("apb", "end")}.get(name or "")
    assert kinds["m_axis"] == ("axi4stream", "start")
    assert (ports["clk"][1], ports["rst"][1], ports["a"][0]) == ("clk", "reset", "pins")
    assert ("irq" in kinds) == (bus == "apb")
    named = {row[-1] for row in rows if row[:1] == ["add_fileset_file"]}
    assert named <= {*files}
