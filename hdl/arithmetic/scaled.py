"""What a scaler hands out."""

from amaranth import signed
from amaranth.lib import data, stream


def scaled_stream(width: int, tag: data.StructLayout) -> stream.Signature:
    """A signed quotient of so many bits, and what has travelled along with it."""
    return stream.Signature(data.StructLayout({"quotient": signed(width), "tag": tag}), always_ready=True)
