"""Links of what is released lead somewhere from PyPI, and workflows call what there is."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.script import load

ROOT = Path(__file__).parents[2]
ADDRESS = "https://github.com/someone/tachometry"


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def test_links_are_absolute_and_lead_to_files_of_the_tag(copied: Path) -> None:
    done = CliRunner().invoke(load("release").main, [str(copied), f"{ADDRESS}/", "we@here.org"])
    assert done.exit_code == 0, done.output
    project = tomllib.loads((copied / "pyproject.toml").read_text())["project"]
    assert project["urls"]["Repository"] == ADDRESS
    assert project["authors"][0]["email"] == "we@here.org"
    text = (copied / "README.md").read_text()
    links = re.findall(r"(!?)\[[^\]]*\]\(([^)#]*)[^)]*\)", text)
    ours = [(image, link) for image, link in links if link.startswith(ADDRESS)]
    assert len(ours) > 30
    for image, link in ours:
        kind = "raw" if image else "blob"
        file = link.removeprefix(f"{ADDRESS}/{kind}/v{project['version']}/")
        assert (ROOT / file).exists(), link
    assert all(link.startswith("https://") for _, link in links if link)


@pytest.mark.parametrize("given", [[], [ADDRESS], ["http://here.org", "we@here.org"]])
def test_without_an_address_nothing_is_released(given: list[str], copied: Path) -> None:
    before = (copied / "README.md").read_text()
    done = CliRunner().invoke(load("release").main, [str(copied), *given])
    assert done.exit_code == 2
    assert "address of the repository and mail of the authors must be in" in done.output
    assert (copied / "README.md").read_text() == before


def test_workflows_call_what_there_is() -> None:
    """Every make target of a workflow is one of the Makefile, and each permission is the least."""
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for file in (ROOT / ".github" / "workflows").glob("*.yml"):
        text = file.read_text()
        assert set(re.findall(r"run: make ([a-z-]+)", text)) <= targets
        assert "permissions:\n  contents: read\n" in text
        assert "secrets." not in text
    classifiers = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["classifiers"]
    known = re.findall(r":: (3\.\d+)", "\n".join(classifiers))
    assert f'python: ["{known[0]}", "{known[-1]}"]' in (ROOT / ".github/workflows/test.yml").read_text()


@pytest.mark.parametrize(("target", "fails"), [("dist", "pyroma"), ("page", "python"), ("dist", ""), ("page", "")])
def test_what_was_made_before_stays_until_the_new_is_checked(target: str, fails: str, tmp_path: Path) -> None:
    shutil.copy(ROOT / "Makefile", tmp_path)
    for folder in ("bin", "venv", f"build/{target}"):
        (tmp_path / folder).mkdir(parents=True)
    for file in ("venv/.made", f"build/{target}/before"):
        (tmp_path / file).touch()
    for tool in ("python", "pip", "twine", "check-wheel-contents", "pyroma"):
        (link := tmp_path / "bin" / tool).write_text(
            f"#!/bin/sh\nmkdir -p build/{target}.new; test {tool} != '{fails}'\n"
        )
        link.chmod(0o755)
    for command in ("git init -q", "git add Makefile", f"make -s {target} VENV=venv BIN=bin LINKED="):
        done = subprocess.run(command.split(), cwd=tmp_path, capture_output=True)
    assert (done.returncode != 0) == (tmp_path / "build" / target / "before").exists() == bool(fails)
