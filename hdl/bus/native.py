"""The port between a bank of registers and what brings accesses to it."""

from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec.language.field import WORD


def native_port(address_width: int) -> wiring.Signature:
    """Return the signature of the native port: an access takes a clock, its answer is valid in the next one only."""
    return wiring.Signature(
        {
            "address": Out(address_width),  # of the word, not of the byte
            "read": Out(1),
            "write": Out(1),  # not together with `read`
            "write_data": Out(WORD),
            "read_data": In(WORD),  # 0 where nothing was read
            "error": In(1),  # there is no such register, or a read-only one was written
        }
    )
