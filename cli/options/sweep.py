"""Options that a sweep can vary: those of cores, of methods and of the encoder."""

import click

from tachometry.cli.options.core import common_options, method_options
from tachometry.cli.options.motion import encoder_options

# Each gives what its options make; together they are the options of a point.
CORE = click.command("sweep")(common_options(lambda make: make))
METHOD = click.command("sweep")(method_options(lambda **given: given))
ENCODER = click.command("sweep")(encoder_options(lambda encoder, motion: (encoder, motion)))


def by_name(command: click.Command) -> dict[str, click.Option]:
    """The options of a command by their names, without dashes."""
    options = [parameter for parameter in command.params if isinstance(parameter, click.Option)]
    return {option.opts[0].lstrip("-"): option for option in options}


POINT_OPTIONS = by_name(CORE) | by_name(METHOD) | by_name(ENCODER)
