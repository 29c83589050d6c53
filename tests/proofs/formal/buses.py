"""These proofs are about registers on buses, and the stream of records."""

from functools import partial

from proofs.formal.prove import Proof

from tachometry.hdl.extras import stream as box
from tachometry.spec import Encoder, MTachometer, Timing
from tachometry.spec.core.extras.stream import Part
from tachometry.spec.registers.map import IDENTIFICATION, RegisterMap

_SPEC = MTachometer(encoder=Encoder(1, 4), timing=Timing(8, 2, 4), frac_bits=4, position_width=8, average=2)

_BANK_PROBES = {
    "core_read": "bus__read",
    "core_write": "bus__write",
    "core_address": "bus__address",
    "core_write_data": "bus__write_data",
    "core_read_data": "bus__read_data",
    "core_error": "bus__error",
    "core_clear": "clear",
    "core_hold": "hold",
    "core_waits": "updated_waits",
    "core_at_tick": "position",
    "core_velocity": "captured_velocity",
    "core_interval": "captured_interval",
    "core_pulse_count": "captured_pulse_count",
    "core_position": "captured_position",
    "core_updated": "captured_updated",
    "core_forced": "captured_forced",
    "core_overflow": "captured_overflow",
    "core_standstill": "captured_standstill",
    "core_errors": "decode_errors.count",
    "core_overflows": "overflows.count",
    "core_lost": "lost_updates.count",
}
_WISHBONE_PROBES = {"core_answered": "answered"}
_AXI_LITE_PROBES = {
    "core_writes": "writes",
    "core_written": "written",
    "core_has_read": "has_read",
    "core_write_done": "write_done",
    "core_read_done": "read_done",
    "core_to_write": "to_write",
    "core_to_read": "to_read",
    "core_by_byte_0": "by_byte_0",
}


def _on(bus: str, checker: str, bridge_probes: dict[str, str], depth: int) -> Proof:
    """Return PB and the properties of the bus: what a master sees of the registers of a small core of the M method."""
    parameters = {
        "IDENTIFICATION": IDENTIFICATION,
        "CONFIGURATION": RegisterMap(_SPEC).configuration,
        "COUNT_WIDTH": _SPEC.widths.count,
        "FRAC_BITS": _SPEC.velocity.frac_bits,
    }
    probes = {wire: f"core.bank.{path}" for wire, path in _BANK_PROBES.items()}
    probes["core_left"] = "core.tachometer.sampling_clock.left"
    probes |= {wire: f"bridge.{path}" for wire, path in bridge_probes.items()}
    return Proof(bus, _SPEC, checker, parameters, probes, depth, bus=bus)


ON_BUSES = [
    _on("wishbone", "wishbone", _WISHBONE_PROBES, depth=5),
    _on("axi-lite", "axi_lite", _AXI_LITE_PROBES, depth=5),
]

_PARTS = (Part("time", 32, 0, signed=False), Part("flags", 32, 4, signed=False), Part("position", 3, 8))
_RECORD_PROBES = {"core_clocks": "clocks", "core_lost": "lost", "core_left": "left"}
# By the name in its module, where a mutant takes its place.
RECORDS = Proof(
    "stream",
    _SPEC,
    "record_stream",
    {"PACKET": 3},
    _RECORD_PROBES,
    depth=2,
    box=partial(lambda *given: box.Gates(*given), _PARTS, ("overflow",), 3, "tick"),
)
