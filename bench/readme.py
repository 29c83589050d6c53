"""Runs the comparison that README.md prints, and writes its numbers, and its picture: docs/demo.png.

The cells are those of `--size`, which needs the extra `size`.
"""

import re
import shlex
from collections.abc import Iterable, Mapping

from compare import rows
from pages import ROOT, stamp, write

from tachometry.spec import METHODS, TachometerSpec, of_texts

README, PICTURE = ROOT / "README.md", ROOT / "docs" / "demo.png"
HEADLINE = {"track": "RMS error is ", "hostmot2": r"LinuxCNC's method\s+has "}


def command(picture: str = "") -> str:
    """Return the command; it draws a picture of this name if there is one."""
    (line,) = re.findall(r"^tachometry compare .*$", README.read_text(encoding="utf-8"), re.MULTILINE)
    return re.sub(r"--plot \S+", f"--plot {shlex.quote(picture)}" if picture else r"\g<0>", line)


def cores() -> dict[str, TachometerSpec]:
    """Return the cores that it compares, by their methods."""
    texts = dict(re.findall(r"--(lines|clock|pwm|max-speed) (\S+)", command()))
    return {name: of_texts(name, texts) for name in METHODS}


def filled(text: str, table: Iterable[Mapping[str, str]]) -> str:
    """Return README with the numbers of a table of the command: errors, and cells if it has them.

    It raises ValueError if README does not have a place for each number once.
    """
    for row in table:
        name, error = row["name"], f"{float(row['rms_rad_s']):.2g} rad/s"
        numbers = {f"({HEADLINE[name]})\\S+ rad/s": error} if name in HEADLINE else {}
        if name in METHODS:
            numbers[rf"(\n\| \[?`{name}`[^\n]*\| )[^|\n]+(?= \| \d+ \|\n)"] = error
        if name in METHODS and "COMB" in row:
            numbers[rf"(\n\| \[?`{name}`[^\n]*rad/s \| )\d+(?= \|\n)"] = row["COMB"]
        for place, number in numbers.items():
            text, n = re.subn(place, rf"\g<1>{number}", text)
            if n != 1:
                raise ValueError(f"README.md must have the place of {name} once, not {n} times: {place}")
    return text


def main() -> None:
    """Write both."""
    table = rows(f"{command(str(PICTURE))} --size")
    write(README, filled(README.read_text(encoding="utf-8"), table))
    stamp(README)


if __name__ == "__main__":
    main()
