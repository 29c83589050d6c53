"""The control loop beside a tachometer: its options, formats and ports."""

from tachometry.spec.control.core import AnySpec, LoopSpec

__all__ = ["AnySpec", "LoopSpec"]
