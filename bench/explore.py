"""Takes the picture of docs/guides/explore.md: the page of `tachometry explore` in Chromium."""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from pages import stamp
from playwright.sync_api import sync_playwright

FLAGS = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split()


def take(path: Path) -> None:
    """Write what the page first shows, with its curves."""
    command = [sys.executable, "-m", "tachometry", "explore"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process, sync_playwright() as playwright:
        assert process.stdout is not None
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = chromium.new_page(viewport={"width": 1360, "height": 1180})
        page.goto(process.stdout.readline().strip())
        page.locator("#velocity canvas").wait_for()
        page.screenshot(path=path)
        chromium.close()
        process.terminate()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True, help="the picture, .png")
    picture = parser.parse_args().output
    take(picture)
    stamp(picture)
