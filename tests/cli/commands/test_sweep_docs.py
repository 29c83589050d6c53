"""docs/guides/sweep.md shows the file that is there, and a command that means the same."""

import re
import shlex

import click
from support import docs

from tachometry.cli.commands.sweep import sweep
from tachometry.cli.options.sweep import by_name, point_options
from tachometry.cli.options.sweep_settings import of_command_line, of_file

DOCS = docs.DOCS / "guides"
PAGE = (DOCS / "sweep.md").read_text()


def test_the_file_is_shown_as_it_is() -> None:
    assert f"```toml\n{(DOCS / 'sweep.toml').read_text()}```" in PAGE


def test_the_options_beside_it_mean_the_same() -> None:
    options = by_name(sweep) | point_options()
    command = re.search(r"^    tachometry sweep (--ppr(?:.*\\\n)*.*)$", PAGE, re.MULTILINE)
    assert command is not None
    words = shlex.split(command[1].replace("\\\n", ""))
    raw, _, _ = sweep.make_parser(click.Context(sweep)).parse_args(words)
    file = of_file(DOCS / "sweep.toml", options)
    for output in ("results", "plot"):
        del file.fixed[output]
    assert of_command_line(raw, options) == file
