"""Speed measurement of servo drives: generator of encoder-to-speed cores, golden models, simulation.

    import tachometry as t

    spec = t.Tachometer(ppr=500, clock="48MHz", max_speed="400rad/s")
    run = t.simulate(spec, "ramp:0:40rad/s:500ms", jitter=0.05)
    run.plot("ramp.png")
    t.generate(spec, "rtl", bus="axi-lite")

`python -m tachometry` is the command line. The hardware itself, for a design of your own in Amaranth, is
`tachometry.hdl.Tachometer(spec)`.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # else these are imported when they are asked for
    from tachometry.api import Run, Tachometer, compare, generate, plan, read_capture, replay, simulate

__all__ = ["Run", "Tachometer", "__version__", "compare", "generate", "plan", "read_capture", "replay", "simulate"]

__version__: str


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from tachometry.spec.language.provenance import version  # the import takes longer than the rest of the package

        return version()
    if name in __all__:
        from tachometry import api

        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
