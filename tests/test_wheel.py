"""The wheel: it holds every file of the layers, and runs in an environment with nothing else, outside the checkout."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest
from support.nightly import nightly

ROOT = Path(__file__).parent.parent
LAYERS = ("spec", "hdl", "sim", "boards", "cli")
# Nothing of this environment or this user; where pip finds packages, and what it has, stays.
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
CORE = "--method s --ppr 500 --clock 1MHz --tick 1ms --max-time 10ms".split()


def run(*command: str | Path, cwd: Path) -> str:
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def files(*folders: str) -> set[str]:
    """Return what git has in folders."""
    listed = subprocess.run(["git", "ls-files", "-z", "--", *folders], cwd=ROOT, capture_output=True, text=True)
    found = {name for name in listed.stdout.split("\0") if (ROOT / name).is_file()}
    assert listed.returncode == 0, listed.stderr
    return found


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return built from what git has alone, so nothing that lies in the checkout gets in."""
    source, made = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in files(*LAYERS, "package", "pyproject.toml", "README.md", "LICENSE"):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", made, source, cwd=made)
    (found,) = made.iterdir()
    return found


def test_it_holds_every_file_of_the_layers(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert packed == {f"tachometry/{name.removeprefix('package/')}" for name in files(*LAYERS, "package")}


def test_it_runs_from_a_zip(wheel: Path, tmp_path: Path) -> None:
    """A wheel is one; what it needs is in this environment."""
    program = "import sys, tachometry; from tachometry.cli.main import main; print(tachometry.__file__); main()"
    command = [sys.executable, "-c", program, "generate", *CORE, "--testbench", "cocotb", "--bus", "apb", "-o", "core"]
    done = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT | {"PYTHONPATH": str(wheel)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(wheel))
    assert {"tachometer_driver.h", "test_tachometer.py"} <= set(os.listdir(tmp_path / "core"))


@nightly  # it gets all packages anew; what is in the wheel, the test above says
def test_it_runs_in_an_empty_environment(wheel: Path, tmp_path: Path) -> None:
    run(sys.executable, "-m", "venv", "--without-pip", "v", cwd=tmp_path)
    scripts = tmp_path / "v" / ("Scripts" if sys.platform == "win32" else "bin")
    pip = (sys.executable, "-m", "pip", "--python", scripts / "python")
    run(*pip, "install", "-q", "--no-compile", wheel, cwd=tmp_path)
    run(*pip, "check", cwd=tmp_path)
    run(scripts / "tachometry", "generate", *CORE, "--testbench", "cocotb", "-o", "core", cwd=tmp_path)
    assert {"tachometer.v", "tachometer.json", "test_tachometer.py"} <= set(os.listdir(tmp_path / "core"))
    told = run(
        scripts / "python", "-m", "tachometry", "simulate", *CORE, "--motion", "constant:20rad/s:100ms", cwd=tmp_path
    )
    assert "PASS" in told
