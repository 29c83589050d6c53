"""Proofs of `make formal-quick`, and wrong facts that gates and golden models share.

Comparing gates with golden models cannot find these. A row of faults.json has a fault, the quick test that notices it,
and changes: a file, a text in it, and another.
"""

import inspect
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from proofs.formal.cases import PROOFS, QUICK
from proofs.formal.mutants import MUTANTS
from support import docs
from support.nightly import nightly


def test_a_quick_proof_for_every_checker() -> None:
    checkers = {proof.name: proof.checker for proof in PROOFS}
    assert len(checkers) == len(PROOFS)
    assert {checkers[name] for name in QUICK} == {*checkers.values()}


def test_every_proven_property_is_described() -> None:
    described = {name for row in docs.table("properties", "concepts") for name in row["properties"].split(", ")}
    proven = {name for row in docs.table("proofs") for name in row["properties"].split(", ") if name}
    assert proven
    assert proven - described == set()


def test_every_mutant_stands_in_its_box() -> None:
    """`make formal` asks so of each, but it takes long."""
    sources = [(one, inspect.getsource(sys.modules[one.box.__module__])) for one in MUTANTS]
    assert [one for one, source in sources if source.count(one.right) != 1] == []


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
