"""`tachometry completion`: the shell completes commands and options, by click's own means."""

import os
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from tachometry.cli.files import Outputs
from tachometry.cli.options.option import command

# Where shells look for the script of a command by themselves, below the home directory; zsh needs a line in .zshrc.
_PLACES = {
    "bash": ".local/share/bash-completion/completions/tachometry",
    "fish": ".config/fish/completions/tachometry.fish",
    "zsh": ".zfunc/_tachometry",
}
_OF_ZSH = "for zsh, .zshrc must have once: fpath+=~/.zfunc; autoload -Uz compinit; compinit"


@command("""\b
Examples:
  tachometry completion
  tachometry completion fish""")
@click.argument("shell", required=False, type=click.Choice([*_PLACES], case_sensitive=False), metavar="[bash|fish|zsh]")
def completion(shell: str | None) -> int:
    """Let the shell complete commands, options and their values, from the next one that is opened.

    Without an argument it is the shell of the environment variable SHELL. The script that click makes for it is
    written where the shell looks for it, in the home directory.
    """
    name = Path(os.environ.get("SHELL", "bash")).name if shell is None else shell
    if name not in _PLACES:
        raise ValueError(
            f"the shell must be one of {', '.join(_PLACES)}, not {name!r}: type tachometry completion bash"
        )
    kind = get_completion_class(name)
    assert kind is not None
    target = Path.home() / _PLACES[name]
    script = kind(click.Command("tachometry"), {}, "tachometry", "_TACHOMETRY_COMPLETE").source()
    with Outputs({"script": target}) as outputs:
        outputs["script"].write_text(script, encoding="utf-8", newline="\n")
    click.echo(target)
    if name == "zsh":
        click.echo(_OF_ZSH)
    return 0
