"""Every command and every example of the README is run."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from matplotlib.image import imread
from support.command import run
from support.nightly import nightly, only
from support.script import load

from tachometry.sim.studies.estimate import Estimate
from tachometry.spec import METHODS
from tachometry.spec.registers.buses import bus_of

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text()
readme = load("readme")

RUN_BY = "make test"  # this is part of it
# Most of the time; they run for less in the test without a compiler, and in those of their commands.
SLOW = ("make demo", "iverilog", *(f"tachometry {name} " for name in ("verify", "plan", "sweep", "compare")))


def blocks(language: str, text: str = TEXT) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def commands() -> list[str]:
    lines = "".join(blocks("sh")).splitlines()
    return [line.split("#")[0].strip() for line in lines if line.split("#")[0].strip()]


@pytest.mark.parametrize("whole", only([False], [False, True]))
def test_every_shell_command(whole: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In order, as a newcomer would, with the results kept out of the checkout."""
    assert RUN_BY in commands()
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    monkeypatch.chdir(tmp_path)
    for command in commands():
        if command == RUN_BY or (command.startswith(SLOW) and not whole):
            continue
        if command.startswith("tachometry "):  # in this process, which has loaded what it needs
            assert run(*shlex.split(command)[1:]) == 0, command
            continue
        if command == "make demo":
            command = "sh docs/demo.sh"
        bin_ = str(Path(sys.executable).parent)
        command = command.replace(".venv/bin", shlex.quote(bin_))
        path = f"{bin_}{os.pathsep}{os.environ['PATH']}"  # as the line that activates the environment sets it
        environment = os.environ | {"BIN": bin_, "OUT": "build/demo", "PATH": path}
        done = subprocess.run(command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    for name in re.findall(r"^\| `([\w.]+)`(?:, `([\w.]+)`)? \|", TEXT, re.MULTILINE):
        for file in filter(None, name):
            if "." in file and whole:
                assert (tmp_path / "build" / "demo" / file).stat().st_size > 0, file
    if whole:
        check_picture(ROOT / "docs/demo.png", tmp_path / "build/demo/methods.png")


def check_picture(shown: Path, made: Path) -> None:
    """Hold the picture of the README against what the demo draws: equal with the Matplotlib of constraints.txt, and
    nearly so with another.
    """
    if f"\nmatplotlib=={version('matplotlib')} " in (ROOT / "constraints.txt").read_text():
        assert shown.read_bytes() == made.read_bytes(), "run `make readme`"
    first, second = (imread(picture) for picture in (shown, made))
    assert first.shape == second.shape
    assert abs(first - second).mean() < 0.01, "run `make readme`"


def test_make_demo_is_what_the_test_runs() -> None:
    assert "BIN=$(BIN) sh docs/demo.sh" in (ROOT / "Makefile").read_text()


@nightly  # tests/sim/engines/test_engines.py and tests/sim/golden/methods/test_track.py have no compiler either
def test_demo_without_a_compiler(tmp_path: Path) -> None:
    """Neither that of the system nor ziglang's; a moment of the motion, as Amaranth's simulator is slow."""
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    tools = tmp_path / "tools"
    tools.mkdir()
    for tool in ("sh", "cmp", "cat"):
        (tools / tool).symlink_to(str(shutil.which(tool)))
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['ziglang'] = None\n")
    environment = {name: value for name, value in os.environ.items() if name != "CXX"}
    environment |= {"BIN": str(Path(sys.executable).parent), "PATH": str(tools), "PYTHONPATH": str(tmp_path)}
    environment |= {"MOTION": "ramp:200rad/s:300rad/s:400us", "METHODS": "s"}
    done = subprocess.run(["sh", "docs/demo.sh"], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "pysim" in done.stdout + done.stderr
    assert (tmp_path / "build" / "demo" / "drive.csv").stat().st_size > 0


def test_python_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The examples build on each other; the one of docs/guides/testbench.md runs the simulation."""
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {"__name__": "readme"}
    page = (ROOT / "docs" / "guides" / "testbench.md").read_text(encoding="utf-8")
    for number, block in enumerate([*blocks("python"), *blocks("python", page)]):
        exec(compile(block, f"<README example {number}>", "exec"), namespace)
    speed = re.search(r"the alarm came at ([\d.]+) rad/s", capsys.readouterr().out)
    assert speed is not None
    assert 100 <= float(speed[1]) < 105


def test_errors_and_picture_are_those_of_the_comparison(tmp_path: Path) -> None:
    """tests/bench/test_made_of.py has the cells."""
    table = readme.rows(readme.command(str(tmp_path / "drawn.png")))
    assert {row["name"] for row in table} >= {*METHODS, *readme.HEADLINE}
    assert readme.filled(TEXT, table) == TEXT, "run `make readme`"
    check_picture(readme.PICTURE, tmp_path / "drawn.png")


def test_numbers_without_a_place_are_an_error() -> None:
    table = [{"name": "track", "rms_rad_s": "0.12345", "COMB": "7"}]
    filled = readme.filled(TEXT, table)
    assert "RMS error is 0.12 rad/s" in filled
    assert re.search(r"^\| \[`track`\].* \| 0\.12 rad/s \| 7 \|$", filled, re.MULTILINE)
    for wrong in (TEXT.replace("RMS error is", "error is"), TEXT.replace("| [`track`]", "| `trace`"), 2 * TEXT):
        with pytest.raises(ValueError, match=r"place of track once, not [02] times"):
            readme.filled(wrong, table)


@pytest.mark.usefixtures("mapped")
def test_the_clock_of_its_core_is_the_estimate() -> None:
    found = Estimate.of(readme.cores()["track"], bus_of("axi-lite"), "ecp5")
    assert f" an ECP5 reaches about {found.clock_hz / 1e6:.0f} MHz" in TEXT


def test_all_commands_have_one_drive() -> None:
    drive = readme.command().removeprefix("tachometry compare ").partition(" --methods")[0]
    assert f"tachometry generate {drive} " in TEXT
    assert f'drive="{drive}"\n' in (ROOT / "docs" / "demo.sh").read_text()


def test_pictures_are_there() -> None:
    for name in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", TEXT):
        assert (ROOT / name).stat().st_size > 1000, name


def test_it_is_short() -> None:
    assert len(TEXT.splitlines()) <= 110


PAGES = [*ROOT.glob("*.md"), *sorted((ROOT / "docs").glob("*/*.md")), *sorted((ROOT / "tests").glob("*/*.md"))]


def anchors(page: Path) -> set[str]:
    """Return the headings of a page, as links name them."""
    headings = re.findall("^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#\s]*)(?:#([^)]*))?\)", page.read_text(encoding="utf-8"))
    for link, anchor in links:
        target = page.parent / link if link else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), f"{link}#{anchor}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_are_named_are_there(page: Path) -> None:
    layers = "spec|hdl|sim|cli|tests|bench|docs"
    named = re.findall(rf"`((?:{layers})/[\w/]+\.(?:py|md|h|sv|toml))`", page.read_text("utf-8"))
    for file in named:
        assert (ROOT / file).exists() or "NAME" in file, file


def test_every_page_is_one_step_from_the_readme() -> None:
    for page in (ROOT / "docs").glob("*/*.md"):
        assert page.relative_to(ROOT).as_posix() in TEXT, page.name
