"""The module for LiteX: the SoC of the page is built by LiteX and simulated, and its registers are read on its bus."""

import csv
import re
import shlex
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from support import docs
from support.command import run
from support.nightly import only
from support.options import had_by

from tachometry.hdl.export import export
from tachometry.sim import build
from tachometry.spec import METHODS, ParameterError, TachometerSpec, of_texts
from tachometry.spec.registers.map import IDENTIFICATION, RegisterMap

TESTS = Path(__file__).parents[3]
PAGE = docs.page("guides/litex.md")
(COMMAND,) = re.findall(r"```sh\n(tachometry .*?)```", PAGE, re.DOTALL)
_, *WORDS, _ = shlex.split(COMMAND.replace("\\\n", ""))  # without the program and its folder
BASE = {"ppr": "8", "clock": "1MHz", "tick": "20us", "max-time": "400us"}
FILE = "spindle_litex.py"
FORWARD, BACK = 40, 57  # quarter periods
_BENCH = """
module bench;
  reg clk = 0, rst = 1, a = 0, b = 0, cyc = 0, we = 0;
  reg [29:0] adr = 0;
  reg [31:0] dat_w = 0;
  reg [1:0] quarter = 0;
  wire [31:0] dat_r;
  wire ack, err;
  soc dut (.clk(clk), .rst(rst), .encoder_a(a), .encoder_b(b), .encoder_z(1'b0), .bus_adr(adr), .bus_dat_w(dat_w),
    .bus_dat_r(dat_r), .bus_sel(4'd15), .bus_cyc(cyc), .bus_stb(cyc), .bus_we(we), .bus_ack(ack), .bus_err(err));
  always #5 clk = ~clk;
  task access(input [31:0] address, input write, input [31:0] data);
    begin
      adr = address >> 2; we = write; dat_w = data; cyc = 1;
      @(posedge clk);
      while (!ack && !err) @(posedge clk);
      $display("%0d %0d %0d", address, dat_r, err);
      @(negedge clk) cyc = 0;
      @(negedge clk);
    end
  endtask
  task turn(input integer steps, input integer by);
    repeat (steps) begin
      quarter = quarter + by;
      a = quarter[1] ^ quarter[0];
      b = quarter[1];
      repeat (8) @(negedge clk);
    end
  endtask
  integer register;
  initial begin
    repeat (4) @(negedge clk);
    rst = 0;
    repeat (20) @(negedge clk);
    turn(@FORWARD@, 1);
    turn(@BACK@, -1);
    repeat (60) @(negedge clk);
    for (register = 0; register < @REGISTERS@; register = register + 1) access(@BASE@ + 4 * register, 0, 0);
    access(@BASE@ + @CONTROL@, 1, 2);
    access(@BASE@ + @CONTROL@, 0, 0);
    access(@BASE@, 1, 0);
    $finish;
  end
endmodule
"""


@cache
def spec() -> TachometerSpec:
    """Return the core of the page."""
    values = {"lines", "clock", "tick", "max-time", "filter", "position-width"}
    given = {word[2:]: after for word, after in pairwise([*WORDS, ""]) if word.startswith("--")}
    return of_texts(
        "s",
        {
            name: after if name in values else "yes"
            for name, after in given.items()
            if name not in ("for", "name", "method")
        },
    )


@cache
def made() -> dict[str, str]:
    return export(spec(), "spindle", target="litex")


def in_folder(folder: Path, *command: str | Path) -> str:
    done = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stdout + done.stderr)
    return done.stdout


def soc(folder: Path, module: str, clock: str = "CLOCK_HZ") -> int:
    """Build the SoC of the page with this module and clock; where its registers are."""
    (example,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    texts = {file: made()[file] for file in ("spindle.v", FILE)} | {FILE: module}
    texts["example.py"] = example.replace("(platform, CLOCK_HZ)", f"(platform, {clock})")
    texts["example.py"] += "\nfrom spindle_litex import PINS\n"
    for file, text in texts.items():
        (folder / file).write_text(text, encoding="utf-8")
    said = in_folder(folder, sys.executable, TESTS / "support" / "litex_soc.py", "MySoC")
    assert "\nsources spindle.v\n" in f"\n{said}"
    return int(re.findall(r"^base (\d+)$", said, re.MULTILINE)[0])


def check(folder: Path, module: str) -> None:
    registers = RegisterMap(spec())
    base = soc(folder, module)
    rows = list(csv.reader(line for line in (folder / "csr.csv").read_text().splitlines() if line[0] != "#"))
    assert ["memory_region", "tachometer", f"0x{base:08x}", str(1 << registers.address_width), "io"] in rows
    assert ["constant", "config_clock_frequency", "1000000", "", ""] in rows
    number = len(registers.registers)
    parts = {"BASE": base, "REGISTERS": number, "CONTROL": registers["CONTROL"].offset}
    parts |= {"FORWARD": FORWARD, "BACK": BACK}
    bench = re.sub("@([A-Z_]+)@", lambda mark: str(parts[mark[1]]), _BENCH)
    (folder / "bench.v").write_text(bench, encoding="utf-8")
    in_folder(folder, "iverilog", "-g2005", "-s", "bench", "-o", "x.vvp", "soc.v", "spindle.v", "bench.v")
    said = re.findall(r"^(\d+) (\d+) (\d)$", in_folder(folder, "vvp", "-n", "x.vvp"), re.MULTILINE)
    answers = [(int(address) - base, int(data), int(error)) for address, data, error in said]
    assert len(answers) == number + 3, answers
    found = {register.name: answer for register, answer in zip(registers, answers, strict=False)}
    assert [answer[0] for answer in found.values()] == [register.offset for register in registers]
    assert not any(error for _, _, error in found.values())
    read = {name: data for name, (_, data, _) in found.items()}
    position = FORWARD - BACK
    expected = {
        "IDENTIFICATION": IDENTIFICATION,
        "CONFIGURATION": registers.configuration,
        "POSITION_LOW": position & 0xFFFF_FFFF,
        "POSITION_HIGH": position >> 32 & 0xFFFF_FFFF,
    }
    assert {name: read[name] for name in expected} == expected
    assert read["VELOCITY"] >> 31 == 1
    control = registers["CONTROL"].offset
    assert answers[number + 1 :] == [(control, 2, 0), (0, 0, 1)]


def test_the_command_of_the_page_makes_this_module(tmp_path: Path) -> None:
    assert run(*WORDS, tmp_path) == 0
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == made()


def test_litex_builds_a_soc_that_reads_the_registers(tmp_path: Path) -> None:
    check(tmp_path, made()[FILE])


def test_the_c_code_of_the_page_is_strict(tmp_path: Path) -> None:
    (code,) = re.findall(r"```c\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "generated").mkdir()
    region = "#define TACHOMETER_BASE 0x40000000L\n"  # as LiteX writes it
    texts = {**made(), "main.c": f"double rad_per_s(void);\n{code}", "generated/mem.h": region}
    for file, text in texts.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    strict = ("-x", "c", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I.")
    build.run([*build.compiler(), *strict, "-c", "main.c", "-o", "main.o"], "compiler", tmp_path)


def test_another_clock_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="ValueError: sys_clk_freq must be 1000000 Hz for spindle, not 1000001 Hz"):
        soc(tmp_path, made()[FILE], "CLOCK_HZ + 1")


@pytest.mark.parametrize("method", only(["s", "rairan"], METHODS))  # the fewest registers and the most
def test_offsets_and_ports_are_those_of_the_core(method: str) -> None:
    core = of_texts(method, had_by(method, BASE))
    text = export(core, "spindle", target="litex")[FILE]
    compile(text, FILE, "exec")
    tables = re.sub(r"^(from|import) .*\n", "", text, flags=re.MULTILINE).split("\n\nclass")[0]
    names: dict[str, object] = {}
    exec(tables, names)
    assert names["REGISTERS"] == {register.name.lower(): register.offset for register in RegisterMap(core)}
    assert names["PINS"] == {pin.name: pin.width for pin in core.ports.pins}
    assert names["OUTPUTS"] == {port.name: (port.width, port.signed) for port in core.ports.outputs}
    assert names["CLOCK_HZ"] == core.timing.clock_hz
    # An address is one of bytes, two bits of which are left out.
    (high,) = re.findall(r"self\.bus\.adr\[:(\d+)\]", text)
    assert names["SIZE"] == 4 << int(high)


def test_another_bus_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"^bus must be wishbone for litex, not spi$"):
        export(of_texts("s", BASE), "spindle", "spi", target="litex")
