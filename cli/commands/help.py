"""`tachometry help`: a command or one of its options, explained."""

import click

from tachometry.cli.options.motion import FORMS
from tachometry.cli.options.option import LONG, command
from tachometry.cli.options.option_aliases import meant


@command(
    """\b
Examples:
  tachometry help generate
  tachometry help generate --tick""",
    context_settings={"ignore_unknown_options": True},
)
@click.argument("command", required=False, metavar="[COMMAND]")
@click.argument("name", required=False, metavar="[--OPTION]")
@click.pass_context
def help(context: click.Context, command: str | None, name: str | None) -> int:
    """Explain a command, or one of its options."""
    parent = context.parent
    assert parent is not None
    assert isinstance(parent.command, click.Group)
    if command is None:
        click.echo(parent.get_help())
        return 0
    named = parent.command.get_command(parent, command)
    if named is None:
        raise click.UsageError(
            f"COMMAND must be one of {', '.join(parent.command.list_commands(parent))}, not {command!r}"
        )
    with click.Context(named, info_name=command, parent=parent) as of_command:
        of_command.meta[LONG] = True
        if name is None:
            click.echo(named.get_help(of_command))
            return 0
        options = {one: parameter for parameter in named.get_params(of_command) for one in parameter.opts}
        if name not in options:
            near = " or ".join(meant(name, options))
            raise click.UsageError(f"{command} has no option {name!r}" + (f": try {near}" if near else ""))
        record = options[name].get_help_record(of_command)
        formatter = of_command.make_formatter()
        formatter.write_dl([record] if record else [])
        click.echo(formatter.getvalue().rstrip("\n"))
        if name == "--motion":
            click.echo("\n" + FORMS.replace("\b\n", ""))
    return 0
