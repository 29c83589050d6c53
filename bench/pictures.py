"""Draws the pictures of the guides with the commands that are on their pages."""

import re
import shlex
import subprocess
import sysconfig
from pathlib import Path

from pages import ROOT, stamp

GUIDES = ROOT / "docs" / "guides"


def main() -> None:
    """Draw them in build/, and copy them beside their pages."""
    page = (GUIDES / "encoder.md").read_text(encoding="utf-8")
    commands = dict(re.findall(r"^tachometry (.* --plot (build/wheel\w*.png))$", page, re.MULTILINE))
    for words, drawn in {**commands, "sweep docs/guides/sweep.toml": "build/sweep.png"}.items():
        command = Path(sysconfig.get_path("scripts")) / "tachometry"
        subprocess.run([command, *shlex.split(words)], cwd=ROOT, check=True)
        picture = GUIDES / Path(drawn).name
        picture.write_bytes((ROOT / drawn).read_bytes())
        stamp(picture)


if __name__ == "__main__":
    main()
