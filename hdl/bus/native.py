"""The port between a bank of registers and what brings accesses to it."""

from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec.registers.field import WORD


def native_port(address_width: int) -> wiring.Signature:
    """Return an access is a clock with `read` or `write`; its answer is there in the clock after it, for that clock
    only.

    Members
    -------
    address : Out(address_width)
        Of the word, not of the byte.
    read, write : Out(1)
        Not both at once.
    write_data : Out(32)
    read_data : In(32)
        0 where nothing was read.
    error : In(1)
        There is no such register, or a read-only one was written.
    """
    return wiring.Signature(
        {
            "address": Out(address_width),
            "read": Out(1),
            "write": Out(1),
            "write_data": Out(WORD),
            "read_data": In(WORD),
            "error": In(1),
        }
    )
