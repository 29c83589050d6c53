"""`tachometry generate --loop`."""

import json
import re
import subprocess
from pathlib import Path

import pytest
from support.command import run
from support.compiled import lint

from tachometry.spec.control import LoopSpec
from tachometry.spec.option import options_of

CORE = "--ppr 25 --clock 1MHz --tick 250us --max-time 2ms --max-speed 500rad/s --loop".split()
PAGE = (Path(__file__).parents[3] / "docs" / "integration.md").read_text(encoding="utf-8")


def test_files_of_a_loop(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are read without a warning, the bench beside them passes, and the manifest has the options."""
    words = "--kp 400 --kv 40 --observer 80rad/s --velocity-filter none --no-synchronised --current-limit 5A".split()
    assert run("generate", *CORE, *words, "--name", "servo", "-o", tmp_path) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "gains kp 400 1/s², kv 40 1/s observer 80 rad/s, velocity filter none, at every control tick" in told
    lint(["servo.v"], "servo", tmp_path)
    subprocess.run(["iverilog", "-g2012", "-Wall", "-o", "bench", "servo.v", "servo_tb.sv"], cwd=tmp_path, check=True)
    done = subprocess.run(["./bench"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("PASS: position 24")
    # Commands are synchronous, lines are not.
    constrained = set(re.findall(r"^# (\w+)$", (tmp_path / "servo.xdc").read_text(), re.MULTILINE))
    assert constrained == {"a", "b"}
    described = json.loads((tmp_path / "servo.json").read_text())
    assert described["parameters"]["loop"].keys() == {about.parameter for about in options_of(LoopSpec)}
    assert described["parameters"]["loop"]["velocity_filter"] is None
    assert described["loop"]["current"] == {"width": 16, "amperes_per_lsb": 2.0**-12, "limit": 5 << 12}
    found = {f"loop.{key}" for key, value in described["loop"].items() if not isinstance(value, dict)}
    found |= {
        f"loop.{key}.{inner}" for key, value in described["loop"].items() if isinstance(value, dict) for inner in value
    }
    assert found <= set(re.findall(r"^\| `([\w.]+)` \|", PAGE, re.MULTILINE))
