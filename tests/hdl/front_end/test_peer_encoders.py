"""Masters of SSI and BiSS-C at encoders that others wrote: `ssi_slave` and `biss_slave` of PandABlocks-FPGA.

These are fetched from the address or folder in PANDABLOCKS, by default from GitHub. They need GHDL, which `make ghdl`
installs, and their times are those of 125 MHz.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.nightly import nightly

from tachometry.hdl.core.sampled_tachometer import master_of
from tachometry.hdl.export.modules import write
from tachometry.spec.core.reads import BISS_CRC, ERROR_BIT, WRONG_CHECK, Reads

ADDRESS = os.environ.get("PANDABLOCKS", "https://github.com/PandABlocks/PandABlocks-FPGA")
COMMIT = "916fb9a6b5371b5280ef67c958004ca0885f47af"  # Apache-2.0
FILES = ["defines/support", "serial_link_detect", "encoders/biss_crc", "encoders/biss_slave", "encoders/ssi_slave"]
N, CLOCK = 60, 125_000_000
OWN_DELAY = 2  # clocks of ssi_slave from a rise to its bit

# A read begins as soon as the lines have rested. A row is what is read, and why not.
_BENCH = """
module bench;
  reg clk = 0, rst = 1, start = 0, fault = 0;
  reg [31:0] place = 0;
  reg [CABLE:0] cable = -1;
  wire ck, data, done;
  wire [WIDTH-1:0] sample;
  wire [1:0] reason;
  integer file;
  always #4 clk = ~clk;
  wire [CABLE:0] line = {cable, data};
  always @(posedge clk) cable <= line;
  master master(.clk(clk), .rst(rst), .start(start), .encoder_clock(ck), .encoder_data(line[CABLE]),
    .sample(sample), .sample_valid(done), .reason(reason));
  SLAVE_slave slave(.clk_i(clk), .reset_i(rst), .ENCODING(2'dGRAY), .BITS(8'dWIDTH), .posn_i(place), .SLAVE_sck_i(ck),
    .SLAVE_dat_o(data)MORE);
  initial begin
    file = $fopen("places.txt", "r");
    #80 rst = 0;
    #20000 while ($fscanf(file, "%d %d", place, fault) == 2) begin
      repeat (3) @(posedge clk);
      #1 start = 1;
      @(posedge clk) #1 start = 0;
      @(posedge done) #1 $display("%0d %0d", sample, reason);
      repeat (REST) @(posedge clk);
    end
    $finish;
  end
endmodule
"""


@pytest.fixture(scope="module")
def encoders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the encoders in Verilog."""
    folder = tmp_path_factory.mktemp("encoders")
    subprocess.run(["git", "init", "-q", "--bare"], cwd=folder, check=True)
    subprocess.run(["git", "fetch", "-q", "--depth", "1", ADDRESS, COMMIT], cwd=folder, check=True)
    names = [f"{Path(file).name}.vhd" for file in FILES]
    for file, name in zip(FILES, names, strict=True):
        shown = subprocess.run(
            ["git", "show", f"{COMMIT}:common/hdl/{file}.vhd"], cwd=folder, check=True, stdout=subprocess.PIPE
        )
        (folder / name).write_bytes(shown.stdout)
    for kind in ("ssi", "biss"):
        command = ["ghdl", "--synth", "--std=08", "--out=verilog", *names, "-e", f"{kind}_slave"]
        with (folder / f"{kind}.v").open("w") as made:
            subprocess.run(command, cwd=folder, check=True, stdout=made)
    return folder


def _biss(bits: int, hz: int, *, gray: bool = False, crc: int = BISS_CRC) -> Reads:
    return Reads(bits, CLOCK, hz, biss=True, gray=gray, crc=crc, start_wait=1000)


@nightly
@pytest.mark.parametrize(
    ("reads", "cable", "wrong"),
    [
        (_biss(18, 2_500_000), 0, 0),
        (_biss(26, 10_000_000, gray=True), 30, 0),
        (_biss(32, 5_000_000), 7, 0),
        (_biss(18, 2_500_000, crc=0b1011011), 0, WRONG_CHECK),
        (Reads(25, CLOCK, 1_000_000, delay=OWN_DELAY, gray=True), 0, 0),
        (Reads(25, CLOCK, 2_000_000, delay=OWN_DELAY + 100), 100, 0),
        (Reads(13, CLOCK, 500_000), 0, 0),
    ],
)
def test_a_master_reads_what_another_encoder_sends(
    reads: Reads, cable: int, wrong: int, encoders: Path, tmp_path: Path
) -> None:
    rng, kind = np.random.default_rng(reads.width), "biss" if reads.biss else "ssi"
    place, fault = rng.integers(0, 1 << reads.width, N), (rng.random(N) < 0.2) & reads.biss
    np.savetxt(tmp_path / "places.txt", np.stack([place, fault], axis=1), fmt="%d")
    bench = _BENCH.replace("MORE", ", .enable_i(1'b1), .GENERATOR_ERROR(fault), .health_o()" * reads.biss)
    facts = {"WIDTH": reads.width, "CABLE": cable, "GRAY": int(reads.gray), "REST": reads.rest, "SLAVE": kind}
    for name, fact in facts.items():
        bench = bench.replace(name, str(fact))
    (tmp_path / "bench.v").write_text(bench)
    (tmp_path / "master.v").write_text(write(master_of(reads), "master").text)
    command = ["iverilog", "-g2012", "-s", "bench", "-o", "bench", "bench.v", "master.v", str(encoders / f"{kind}.v")]
    subprocess.run(command, cwd=tmp_path, check=True)
    shown = subprocess.run(["vvp", "-n", "bench"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    sample, reason = np.array([row.split() for row in shown.splitlines()], dtype=np.int64).T
    assert reason.tolist() == np.where(wrong, wrong, ERROR_BIT * fault).tolist()
    assert np.array_equal(sample, place)
