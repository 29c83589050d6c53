"""These proofs are about the reads of absolute encoders, each by its master alone."""

from functools import partial

from proofs.formal.buses import RECORDS
from proofs.formal.prove import Proof

from tachometry.hdl.core.sampled_tachometer import master_of
from tachometry.spec.core.chips import SpiReads
from tachometry.spec.core.reads import SYNCHRONISER, Reads
from tachometry.spec.core.tformat import N_CHARACTERS, TformatReads

_HZ = 1_000_000, 250_000  # of the core, and of the lines


def _read(name: str, checker: str, reads: Reads, probes: str, **parameters: int) -> Proof:
    held = {"rst": 0, "start": 1} if checker != "encoder_read" else {}  # a read follows the other
    paths = {f"core_{probe}": probe for probe in probes.split()} | {"core_state": "fsm_state"}
    for probe in ("clears", "cleared") if reads.late else ():
        paths[f"late.core_{probe}"] = probe
    parameters |= {"W": reads.width, "LONGEST": reads.longest}
    return Proof(name, RECORDS.spec, checker, parameters, paths, depth=2, box=partial(master_of, reads), held=held)


def _spi(chip: str, width: int) -> Proof:
    reads = SpiReads(width, *_HZ, -1, chip=chip).within(128, 128)  # a delay for few clocks in a bit
    probes = "line odd left at word"
    read = 2 * reads.half - 1 - reads.half * reads.facts.falling - reads.delay - SYNCHRONISER
    facts = {"BYTES": int(reads.facts.bytewise), "LATE": int(reads.late), "AGE_WIDTH": reads.age_width}
    most = max(reads.setup, 2 * reads.half, reads.rest) - 1
    times = {"HALF": reads.half, "SETUP": reads.setup, "READ": read, "AT_WIDTH": most.bit_length()}
    return _read(f"read {chip}", "spi_read", reads, probes, **facts, **times)


def _tformat(name: str, turn_bits: int, characters: int) -> Proof:
    reads = TformatReads(3, 500_000, 250_000, start_wait=3, turn_bits=turn_bits, characters=characters)
    facts = {"T": turn_bits, "N": characters, "BITS": reads.bit, "AGE_WIDTH": reads.age_width}
    probes = "line silent wrong error at place number check time"
    return _read(name, "tformat_read", reads, probes, **facts, LAST_START=reads.last_start)


_BISS = Reads(3, *_HZ, biss=True, crc=0b1011, start_wait=12)
READS = [
    _read("read", "encoder_read", _BISS, "line silent at flags left check", HALF=_BISS.half, WAIT=_BISS.start_wait),
    _spi("as5047p", 14),
    _spi("amt22", 12),
    _tformat("read tformat", 1, N_CHARACTERS),
    _tformat("read 3 characters", 0, 3),  # so few that wrong cores are refuted soon
]
