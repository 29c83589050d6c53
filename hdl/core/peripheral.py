"""A core with its registers as a peripheral of an Amaranth SoC."""

from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from amaranth import Module
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.core.bus_tachometer import BusTachometer
from tachometry.hdl.wires.ports import Box, by_name, hand_through
from tachometry.spec.control import AnySpec
from tachometry.spec.language.field import WORD
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import STREAM
from tachometry.spec.registers.buses import BUSES, registers_on
from tachometry.spec.registers.map import RegisterMap

# Lines of the core by the members of amaranth-soc's signatures. It has none for AXI4-Lite: ours has AXI's names.
_LINES = {
    "wishbone": {name: f"wb_{name}_i" for name in ("adr", "sel", "cyc", "stb", "we")}
    | {"dat_w": "wb_dat_i", "dat_r": "wb_dat_o", "ack": "wb_ack_o", "err": "wb_err_o"},
    "csr": {"addr": "reg_address", "r_data": "reg_read_data", "r_stb": "reg_read"}
    | {"w_data": "reg_write_data", "w_stb": "reg_write"},
    "axi-lite": {line.name.removeprefix("s_axi_"): line.name for line in BUSES["axi-lite"].lines},
}
# How amaranth-soc makes the signatures that it has, beside the width of the address.
_SHAPES: dict[str, dict[str, Any]] = {
    "wishbone": {"data_width": WORD, "granularity": 8, "features": {"err"}},
    "csr": {"data_width": WORD},
}
_BEAT = {field: f"{STREAM}_t{field}" for field in ("data", "last")}
_HANDSHAKE = {line: f"{STREAM}_t{line}" for line in ("valid", "ready")}


class Peripheral(Box):
    """Puts a core on a bus of an Amaranth SoC.

    The member `bus` has the signature of amaranth-soc where that is installed, and a memory map of the registers; else
    a signature of the same shape. Records are the stream `m_axis`, with the fields `data` and `last`. The bus `csr` has
    no line for errors: a register that does not exist reads 0.
    """

    def __init__(self, spec: AnySpec, bus: str, irq: bool) -> None:
        named = replace(BUSES["native" if bus == "csr" else bus], irq=irq)
        registers = registers_on(spec, named)
        self.core = BusTachometer(registers, named)
        self._lines, inner = _LINES[bus], self.core.signature.members
        taken = {*self._lines.values(), *_BEAT.values(), *_HANDSHAKE.values(), "reg_error"}
        self._alike = {name: member for name, member in inner.items() if name not in taken}
        self._records = _HANDSHAKE["valid"] in inner
        beat = data.StructLayout({field: inner[line].shape for field, line in _BEAT.items() if self._records})
        records = {STREAM: Out(stream.Signature(beat))} if self._records else {}
        super().__init__({"bus": In(self._signature(bus, registers.address_width)), **self._alike, **records})
        if _has_soc(bus):
            self.bus.memory_map = _memory_map(registers, in_words=bus == "csr")

    def build(self, m: Module) -> None:
        m.submodules.core = self.core
        self._join(m, self.bus, self._lines)
        hand_through(m, self, self.core, self._alike)
        if self._records:
            records = self.m_axis
            self._join(m, records, _HANDSHAKE)
            self._join(m, records.payload, _BEAT)

    def _signature(self, bus: str, width: int) -> wiring.Signature:
        """Return the signature of a bus, `width` bits of an address of bytes; amaranth-soc has two of three."""
        if _has_soc(bus):
            made: wiring.Signature = import_module(f"amaranth_soc.{bus}").Signature(
                addr_width=width - 2, **_SHAPES[bus]
            )
            return made
        lines = {name: self.core.signature.members[line].flip() for name, line in self._lines.items()}
        return wiring.Signature(lines | ({"adr": Out(width - 2)} if "adr" in lines else {}))

    def _join(self, m: Module, outer: Any, lines: Mapping[str, str]) -> None:
        """Join members to lines of the core; an address of words is shifted to one of bytes."""
        signals, inners = by_name(outer, lines), by_name(self.core, lines.values())
        for member, line in lines.items():
            inner, signal = inners[line], signals[member]
            is_input = self.core.signature.members[line].flow == In
            m.d.comb += inner.eq(signal << len(inner) - len(signal)) if is_input else signal.eq(inner)


class _Register(Box):
    """Stands for a register in a memory map, which takes components alone."""

    _MustUse__silence = True  # Amaranth does not warn that it is in no design

    def __init__(self) -> None:
        super().__init__({})


def _has_soc(bus: str) -> bool:
    return bus in _SHAPES and find_spec("amaranth_soc") is not None


def _memory_map(registers: RegisterMap, *, in_words: bool) -> Any:
    """Return the registers by their names, in lower case, in units of a word or a byte."""
    unit, word = (WORD, 1) if in_words else (8, WORD // 8)
    width = (registers.address_width - 2) + (word.bit_length() - 1)
    found = import_module("amaranth_soc.memory").MemoryMap(addr_width=width, data_width=unit)
    for at, register in enumerate(registers.registers):
        found.add_resource(_Register(), name=(register.name.lower(),), addr=at * word, size=word)
    return found


def peripheral(spec: AnySpec, bus: str = "wishbone", *, irq: bool = False) -> Peripheral:
    """Return a core with its registers on a bus of an Amaranth SoC; ParameterError for another bus.

    - `bus`: `wishbone` (classic, 32 bits, granularity 8, with `err`), `csr` (32 bits), or `axi-lite`.
    """
    if bus not in _LINES:
        raise ParameterError("bus", f"must be {', '.join(_LINES)}, not {bus}: try wishbone")
    return Peripheral(spec, bus, irq)
