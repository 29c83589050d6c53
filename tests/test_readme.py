"""Every command and every example of the README is run."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text()

RUN_BY = "make test"  # this is part of it


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def commands() -> list[str]:
    lines = "".join(blocks("sh")).splitlines()
    return [line.split("#")[0].strip() for line in lines if line.split("#")[0].strip()]


def test_every_shell_command(tmp_path: Path) -> None:
    """In order, as a newcomer would, with the results kept out of the checkout."""
    assert RUN_BY in commands()
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    for command in commands():
        if command == RUN_BY:
            continue
        if command == "make demo":
            command = "sh docs/demo.sh"
        command = command.replace(".venv/bin", shlex.quote(str(Path(sys.executable).parent)))
        environment = os.environ | {"BIN": str(Path(sys.executable).parent), "OUT": "build/demo"}
        done = subprocess.run(command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    for name in re.findall(r"^\| `([\w.]+)`(?:, `([\w.]+)`)? \|", TEXT, re.MULTILINE):
        for file in filter(None, name):
            if "." in file:
                assert (tmp_path / "build" / "demo" / file).stat().st_size > 0, file


def test_make_demo_is_what_the_test_runs() -> None:
    assert "BIN=$(BIN) sh docs/demo.sh" in (ROOT / "Makefile").read_text()


def test_demo_without_a_compiler(tmp_path: Path) -> None:
    """Neither that of the system nor ziglang's; a tenth of the ramp, as Amaranth's simulator is slow."""
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    tools = tmp_path / "tools"
    tools.mkdir()
    for tool in ("sh", "cmp"):
        (tools / tool).symlink_to(str(shutil.which(tool)))
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['ziglang'] = None\n")
    environment = {name: value for name, value in os.environ.items() if name != "CXX"}
    environment |= {"BIN": str(Path(sys.executable).parent), "PATH": str(tools), "PYTHONPATH": str(tmp_path)}
    environment |= {"TIME": "500ms"}
    done = subprocess.run(["sh", "docs/demo.sh"], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "pysim" in done.stdout + done.stderr
    assert (tmp_path / "build" / "demo" / "ramp.csv").stat().st_size > 0


def test_python_examples(capsys: pytest.CaptureFixture[str]) -> None:
    """The examples build on each other; the last one runs the simulation."""
    namespace: dict[str, object] = {"__name__": "readme"}
    for number, block in enumerate(blocks("python")):
        exec(compile(block, f"<README example {number}>", "exec"), namespace)
    speed = re.search(r"the alarm came at ([\d.]+) rad/s", capsys.readouterr().out)
    assert speed is not None
    assert 100 <= float(speed[1]) < 105


def test_pictures_are_there() -> None:
    for name in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", TEXT):
        assert (ROOT / name).stat().st_size > 1000, name
