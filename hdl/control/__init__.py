"""The control loop: observer, controller, and the core that has them beside a tachometer."""

from tachometry.hdl.control.loop_core import LoopCore

__all__ = ["LoopCore"]
