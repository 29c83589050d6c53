"""What lies beside the Verilog to build it into a design: template, constraints, FuseSoC core file, smoke test."""

import textwrap
from collections.abc import Sequence

from tachometry.spec import AxesSpec, TachometerSpec
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.language.port import Port
from tachometry.spec.language.provenance import notice, version
from tachometry.spec.registers.buses import Bus, ports_on

_CORE = """\
CAPI=2:
# FuseSoC core file: fusesoc --cores-root . run --target lint NAME, or --target sim.
@NOTICE_HASH@
name: ::NAME:@VERSION@
description: @METHOD@-method tachometer for incremental encoders

filesets:
  rtl:
    files:
      - NAME.v
    file_type: verilogSource
  vivado:
    files:
      - NAME.xdc
    file_type: xdc
  quartus:
    files:
      - NAME.sdc
    file_type: SDC
  bench:
    files:
      - NAME_inst.v:
          is_include_file: true
      - NAME_tb.sv
    file_type: systemVerilogSource
@REGISTERS@
targets:
  default:
    filesets:
      - rtl
      - tool_vivado ? (vivado)
      - tool_quartus ? (quartus)
@WITH_DRIVER@    toplevel: NAME
    flow: lint
    flow_options:
      tool: verilator

  lint:
    filesets: [rtl]
    toplevel: NAME
    flow: lint
    flow_options:
      tool: verilator
      verilator_options: [-Wall]

  sim:
    filesets: [rtl, bench]
    toplevel: NAME_tb
    flow: sim
    flow_options:
      tool: icarus
      iverilog_options: [-g2012, -Wall]
"""

_REGISTERS = """\
  # A design gets these with the flags driver and registers.
  driver:
    files:
      - NAME_regs.h:
          is_include_file: true
      - NAME_driver.h:
          is_include_file: true
    file_type: cSource
  registers:
    files:
      - NAME.rdl
    file_type: systemRDL
"""
_WITH_DRIVER = """\
      - driver ? (driver)
      - registers ? (registers)
"""

_XDC = """\
# Vivado constraints of NAME: read_xdc NAME.xdc, or add it to the project. They find the core wherever it is.
@NOTICE_HASH@
# The pins are asynchronous: their paths to the first flip-flop have no timing, and both flip-flops stay together.
"""
_XDC_PIN = """
# @PIN@
set_false_path -to [get_pins -hierarchical -filter {NAME =~ *@PATH_SLASH@/stage0_reg@BITS@/D}]
set_property ASYNC_REG TRUE [get_cells -hierarchical -filter {NAME =~ *@PATH_SLASH@/stage*_reg@BITS@}]
"""

_SDC = """\
# SDC constraints of NAME, for Quartus and others that read SDC. They find the core wherever it is.
@NOTICE_HASH@
# The pins are asynchronous: their paths to the first flip-flop have no timing. Quartus calls it a register, others a
# cell.
"""
_SDC_PIN = """
# @PIN@
if {[llength [info commands get_registers]]} {
    set_false_path -to [get_registers {*@PATH_STAR@|stage0@BITS@}]
} else {
    set_false_path -to [get_cells -hierarchical {*@PATH_STAR@*stage0*}]
}
"""

_BENCH = """\
// Smoke test of NAME: turns the encoder 40 quarter periods forward and 16 back, and checks the position.
// For every tick and every update against the golden model: tachometry @COMPARED@.
@NOTICE_SLASHES@
module NAME_tb;
  localparam HOLD = @HOLD@;  // clocks of a quarter period

  reg clk = 1'b0;
  reg rst = 1'b1;
  @PINS@

`include "NAME_inst.v"

  integer updates = 0;
  integer errors = 0;
  reg [1:0] quarter = 2'd0;

  always #5 clk = ~clk;
@TICKS@
  always @(posedge clk) if (!rst) begin
    if (velocity_valid) begin
      updates <= updates + 1;
      if (^@VELOCITY@ === 1'bx) errors <= errors + 1;
    end
    if (decode_error !== 1'b0) errors <= errors + 1;
  end

  task turn(input integer steps, input forward);
    repeat (steps) begin
      quarter = forward ? quarter + 2'd1 : quarter - 2'd1;
      a = @A@;
      b = @B@;
      repeat (HOLD) @(negedge clk);
    end
  endtask

  initial begin
    repeat (4) @(negedge clk);
    rst = 1'b0;
    repeat (HOLD) @(negedge clk);
    turn(40, 1'b1);
    turn(16, 1'b0);
@CHECK@
    $finish;
  end
endmodule
"""
_TICKS = """
  integer clocks = 0;
  always @(negedge clk) begin
    clocks <= clocks == @TICK_CYCLES@ - 1 ? 0 : clocks + 1;
    tick_in <= clocks < (@TICK_CYCLES@ + 1) / 2;
  end
"""
_CHECK = """\
    if (errors != 0 || position !== @EXPECTED@)
      $fatal(1, "FAIL: position %0d instead of @EXPECTED@, %0d errors", position, errors);
    $display("PASS: position %0d, %0d updates, velocity %0d", position, updates, velocity);"""
_CHECK_AXES = """\
    repeat (2 * @TICK_CYCLES@) @(negedge clk);  // until the positions are those of a tick
    for (integer k = 0; k < @AXES@; k = k + 1)
      if (errors != 0 || found[k] !== (k % 2 ? -@EXPECTED@ : @EXPECTED@))
        $fatal(1, "FAIL: position %0d of axis %0d instead of +-@EXPECTED@, %0d errors", found[k], k, errors);
    $display("PASS: position %0d of axis 0, and of every other; %0d updates", found[0], updates);"""
# The latest position of every axis.
_FOUND = """
  reg signed [@WIDTH@:0] found [0:@LAST@];

  always @(posedge clk) if (tick) @FOUND@
"""
_STEPS_PER_TICK, _LONGEST_HOLD = 4, 5000
Boxes = dict[str, tuple[str, ...]]


def kit(spec: AnySpec, name: str, bus: Bus | None = None) -> dict[str, str]:
    """Texts by file name: `NAME.core`, `NAME_inst.v`, `NAME_tb.sv`, `NAME.xdc`, `NAME.sdc`.

    Parameters
    ----------
    spec : TachometerSpec, AxesSpec or LoopSpec
    name : str
        Of the module.
    bus : Bus or None
        On which its registers are.
    """
    ports = ports_on(spec, bus)
    # The commands of a loop are synchronous.
    alone = spec.tachometer if isinstance(spec, LoopSpec) else spec
    idle = bus.idle if bus else {}

    def filled(text: str, **parts: object) -> str:
        marks = {"HASH": "#", "SLASHES": "//"}
        parts |= {f"NOTICE_{kind}": notice(mark).rstrip("\n") for kind, mark in marks.items()}
        parts |= {"VERSION": version(), "METHOD": spec.method}
        for key, part in parts.items():
            text = text.replace(f"@{key}@", str(part))
        return text.replace("NAME", name)

    def constraints(head: str, each: str) -> str:
        paths = [(pin, [*boxes[pin], f"sync_{pin}"]) for pin in boxes]
        bits = "*" * isinstance(spec, AxesSpec)
        parts = [
            filled(each, PIN=pin, PATH_SLASH="/".join(path), PATH_STAR="*".join(path), BITS=bits) for pin, path in paths
        ]
        # In a filter NAME is a property of Vivado.
        return filled(head) + "".join(part.replace(f"{{{name} =~", "{NAME =~") for part in parts)

    of_pins, turning = _of_axes(alone) if isinstance(alone, AxesSpec) else _of_one(alone)
    boxes: dict[str, tuple[str, ...]] = {pin.name: of_pins.get(pin.name, of_pins[""]) for pin in alone.pins}
    boxes |= dict.fromkeys(bus.asynchronous if bus else (), ("bridge",))
    bench = filled(
        _BENCH,
        PINS="\n  ".join(
            f"reg {_kind(port)}{port.name} = {port.width}'d{idle.get(port.name, 0)};"
            for port in ports
            if port.direction == "input" and port.name not in ("clk", "rst")
        ),
        **turning,
    )
    return {
        f"{name}.core": filled(
            _CORE, REGISTERS=filled(_REGISTERS) if bus else "", WITH_DRIVER=_WITH_DRIVER if bus else ""
        ),
        f"{name}_inst.v": _instance(ports, name),
        f"{name}_tb.sv": bench,
        f"{name}.xdc": constraints(_XDC, _XDC_PIN),
        f"{name}.sdc": constraints(_SDC, _SDC_PIN),
    }


def _of_one(spec: TachometerSpec) -> tuple[Boxes, dict[str, object]]:
    """Where the synchronisers of pins are in the core, the others' by an empty name; and how the bench turns it."""
    cycles = spec.timing.tick_cycles
    parts: dict[str, object] = {
        "HOLD": max(min(-(-cycles // _STEPS_PER_TICK), _LONGEST_HOLD), 2 * (spec.filter_clocks + 8)),
        "TICKS": _TICKS if spec.max_tick_cycles else "",
        "A": "quarter[1] ^ quarter[0]",
        "B": "quarter[1]",
        "CHECK": _CHECK,
        "COMPARED": "generate --testbench cocotb",
        "VELOCITY": "velocity",
        "TICK_CYCLES": cycles,
        "EXPECTED": (40 - 16) * spec.encoder.decoding // 4,
    }
    return {"": ("conditioner",), "tick_in": ("sampling_clock",)}, parts


def _of_axes(spec: AxesSpec) -> tuple[Boxes, dict[str, object]]:
    """The same of many axes, of which every other turns the other way."""
    lines = ["quarter[1] ^ quarter[0]", "quarter[1]"]
    of_a, of_b = ([lines[(axis + line) % 2] for axis in reversed(range(spec.axes))] for line in range(2))
    taken = "found[axis] <= position;"
    if spec.parallel:
        each = " ".join(f"found[{axis}] <= position_{axis};" for axis in range(spec.axes))
        taken = f"begin {each} end"
    parts: dict[str, object] = {
        # Before the first edge there are rounds in which no axis is counted.
        "HOLD": max(min(-(-spec.timing.tick_cycles // _STEPS_PER_TICK), _LONGEST_HOLD), 4 * spec.slots),
        "TICKS": _FOUND,
        "A": f"{{{', '.join(of_a)}}}",
        "B": f"{{{', '.join(of_b)}}}",
        "CHECK": _CHECK_AXES,
        "VELOCITY": "velocity_0" if spec.parallel else "velocity",
        "WIDTH": spec.axis.position_width - 1,
        "LAST": spec.axes - 1,
        "FOUND": taken,
        "AXES": spec.axes,
        "COMPARED": f"simulate --axes {spec.axes}",
        "TICK_CYCLES": spec.timing.tick_cycles,
        "EXPECTED": (40 - 16) * spec.axis.encoder.decoding // 4,
    }
    return {"": ()}, parts


def _instance(ports: Sequence[Port], name: str) -> str:
    inputs = [port for port in ports if port.direction == "input"]
    outputs = [port for port in ports if port.direction == "output"]
    lines = [f'// Instantiation template of {name}: copy it, or `include "{name}_inst.v" into a module that has']
    lines += [f"// {', '.join(port.name for port in inputs)}.", *notice("//").splitlines()]
    for port in outputs:
        lines += ["", *_comment(port), f"wire {_kind(port)}{port.name};"]
    lines += ["", f"{name} {name}_inst ("]
    for port in inputs:
        lines += [*(f"  {line}" for line in _comment(port)), f"  .{port.name}({port.name}),"]
    lines += [f"  .{port.name}({port.name})," for port in outputs]
    return "\n".join(lines)[:-1] + "\n);\n"


def _comment(port: Port) -> list[str]:
    told = port.help if not port.unit else f"{port.help.rstrip('.')}; in {port.unit}."
    return [f"// {line}" for line in textwrap.wrap(told, 110)]


def _kind(port: Port) -> str:
    return "signed " * port.signed + f"[{port.width - 1}:0] " * (port.width > 1)
