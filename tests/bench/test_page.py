"""The page without a server: what it uses in the place of NumPy gives the same."""

import functools
import json
import re
import shlex
import shutil
import subprocess
import sys
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from zipfile import ZipFile

from playwright.sync_api import expect, sync_playwright
from support.nightly import nightly
from support.script import load

from tachometry.cli.explore import POLICY

PAGE = Path(__file__).resolve().parents[2] / "bench" / "page"
ASKED = """
from tachometry.cli.explore.answers import FUNCTIONS, answer
core = {"ppr": "500", "clock": "48MHz", "tick": "20us", "max-speed": "400rad/s"}
adaptive = core | {"method": "rairan", "adaptive": "0.02", "max-time": "10ms"}
asked = [("check", core), ("check", adaptive), ("curves", core)]
answers = [answer(name, {"options": options}, FUNCTIONS) for name, options in asked]
"""


def test_answers_are_the_same_without_numpy(tmp_path: Path) -> None:
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "__init__.py").write_bytes((PAGE / "floats.py").read_bytes())
    (tmp_path / "numpy" / "typing.py").write_text("from numpy import ArrayLike, NDArray\n")
    names: dict[str, object] = {}
    exec(ASKED, names)
    wanted = json.dumps(names["answers"])
    assert "worst error" in wanted
    text = f"import json, sys; sys.path.insert(0, {str(tmp_path)!r}){ASKED}print(json.dumps(answers))"
    assert subprocess.check_output([sys.executable, "-c", text], text=True).strip() == wanted


def test_the_page_has_its_policy_before_anything_is_loaded() -> None:
    """All scripts and styles are files beside it: a policy lets none within the page run."""
    text = load("page/build").index((files("tachometry.cli.explore") / "static" / "page.html").read_text())
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    assert 0 < text.index(policy) < min(text.index("<script"), text.index("<link"))
    assert [*re.findall(r'<script src="(.+?)" defer></script>', text)][-2:] == ["answered.js", "page.js"]
    assert len(re.findall("<script", text)) == 3
    assert not re.findall(r"<style| style=| on\w+=", text)


class _Files(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


@nightly  # fetches packages of the npm registry, and needs Chromium
def test_the_browser_writes_the_files_of_the_command(tmp_path: Path) -> None:
    subprocess.run([sys.executable, PAGE / "build.py", tmp_path / "page"], check=True)
    handler = functools.partial(_Files, directory=str(tmp_path / "page"))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, sync_playwright() as playwright:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page()
        page.set_default_timeout(300_000)
        page.goto(f"http://127.0.0.1:{server.server_port}/#lines=2500&clock=100MHz&max-speed=6000rpm&bus=axi-lite")
        expect(page.locator("#methods td").first).to_be_visible(timeout=300_000)
        assert page.locator("#moving").is_hidden()
        with page.expect_download() as download:
            page.click("#download")
        download.value.save_as(tmp_path / "core.zip")
        command = page.inner_text("#command")
        page.fill("#o-clock", "48")
        expect(page.locator("#o-clock-error")).to_contain_text("48MHz", timeout=300_000)
        browser.close()
        server.shutdown()
    subprocess.run([sys.executable, "-m", *shlex.split(command)[:-1], tmp_path / "build"], check=True)
    with ZipFile(tmp_path / "core.zip") as archive:
        found = {name: archive.read(name) for name in archive.namelist()}
    assert found == {file.name: file.read_bytes() for file in (tmp_path / "build").iterdir()}
