"""The manifest of cores whose numbers lie at the edge of a rule."""

import json
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest
from independent.cases import DESCRIBED, Case
from independent.manifest import check_manifest
from reference.settings import arguments


@pytest.mark.parametrize("case", DESCRIBED, ids=[case.name for case in DESCRIBED])
def test_manifest(case: Case, generated: Callable[..., Path]) -> None:
    folder = generated(case.name, "--method", case.settings.method, *arguments(case.settings.words))
    manifest = json.loads((folder / f"{case.name}.json").read_text())
    check_manifest(case.settings, manifest, case.name)
    others = [path for path in folder.iterdir() if path.suffix != ".json"]
    assert manifest["files"] == {path.name: sha256(path.read_bytes()).hexdigest() for path in others}
