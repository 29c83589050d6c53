"""Options that a sweep can vary: those of cores, of methods and of the encoder."""

import click

from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.motion import encoder_options

# Gives what the options of the encoder make.
ENCODER = click.command("sweep")(encoder_options(lambda encoder, motion: (encoder, motion)))


def by_name(command: click.Command) -> dict[str, click.Option]:
    """Return the options of a command by their names, without dashes."""
    options = [parameter for parameter in command.params if isinstance(parameter, click.Option)]
    return {option.opts[0].lstrip("-"): option for option in options}


def point_options() -> dict[str, click.Option]:
    """Return all options that a sweep can vary, by their names."""
    return core_click_options() | by_name(ENCODER)
