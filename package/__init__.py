"""Speed measurement of servo drives: generator of encoder-to-speed cores, golden models, simulation.

    from tachometry.spec import of_texts
    from tachometry.hdl import Tachometer
    from tachometry.hdl.export import export

`python -m tachometry` is the command line.
"""

__version__: str


def __getattr__(name: str) -> str:
    if name == "__version__":
        from tachometry.spec.language.provenance import version  # the import takes longer than the rest of the package

        return version()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
