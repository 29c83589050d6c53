"""A scaler hands out a sum with its tag."""

from amaranth import signed
from amaranth.lib import data, stream


def scaled_stream(width: int, tag: data.StructLayout) -> stream.Signature:
    """Return a signed quotient of so many bits, and what has travelled along with it."""
    return stream.Signature(data.StructLayout({"quotient": signed(width), "tag": tag}), always_ready=True)
