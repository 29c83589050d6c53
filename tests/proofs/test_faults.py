"""Wrong facts that gates and golden models share: comparing these with each other cannot find them.

A row of faults.json has a fault, the quick test that notices it, and changes: a file, a text in it, and another.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.nightly import nightly

ROOT = Path(__file__).parents[2]
FAULTS = json.loads(Path(__file__).with_name("faults.json").read_text(encoding="utf-8"))


@nightly  # it asks what the tests notice
@pytest.mark.parametrize(("test", "changes"), [row[1:] for row in FAULTS], ids=[row[0] for row in FAULTS])
def test_a_shared_fault_is_noticed(test: str, changes: list[list[str]], tmp_path: Path) -> None:
    for layer in ("package", "spec", "hdl", "sim", "boards", "cli"):
        folder = tmp_path / "tachometry" / layer.removeprefix("package")
        shutil.copytree(ROOT / layer, folder, dirs_exist_ok=True)
    for file, right, wrong in changes:
        place = tmp_path / "tachometry" / file
        text = place.read_text(encoding="utf-8")
        assert text.count(right) == 1, f"{right!r} stands {text.count(right)} times in {file}"
        place.write_text(text.replace(right, wrong), encoding="utf-8")
    options = ["-P", "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not nightly"]
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, *options, f"tests/{test}"], cwd=ROOT, env=env, capture_output=True, text=True
    )
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stdout
