"""The command `tachometry` with all of its commands, and what their errors say."""

import os
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path

import click
from click.shell_completion import shell_complete

from tachometry.cli.files import DISK, writable_caches
from tachometry.cli.options.option import message_of
from tachometry.sim.signals.progress import show_work
from tachometry.sim.signals.temporary import PREFIX

COMMANDS = {
    "plan": "Show what a core can measure: resolution and time over speed.",
    "generate": "Write a core as Verilog, with the files of its use.",
    "simulate": "Run a core on a virtual encoder, and compare it.",
    "replay": "Run a core on captured signals, and compare it.",
    "calibrate": "Measure the disc of an encoder from captures.",
    "compare": "Compare methods on the same edges.",
    "sweep": "Run methods over ranges of options and speeds.",
    "loop": "Simulate a velocity loop: core, motor, controller.",
    "verify": "Compare all engines with the golden models.",
    "check": "Check generated cores against manifest and model.",
    "build": "Build a bitstream or vendor project for a board.",
    "program": "Load a bitstream into a board.",
    "monitor": "Show, record and test the measurements of a board.",
    "explore": "Configure a core in the browser, with its curves.",
    "completion": "Print a script for completion in the shell.",
    "help": "Explain a command, or one of its options.",
}
_COMPLETE = "_TACHOMETRY_COMPLETE"  # the variable that click's scripts of the shells set


def load(name: str) -> click.Command:
    """Import a command, which has the name of its file."""
    command: click.Command = getattr(import_module(f"tachometry.cli.commands.{name}"), name)
    return command


class _Commands(click.Group):
    """Loads a command by its name when it is called, so that the help of all of them is quick."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        return load(name) if name in COMMANDS else None

    def resolve_command(
        self, context: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            near = ["--version"] if args[0] == "version" else get_close_matches(args[0], COMMANDS, n=2)
            guess = f" Did you mean {' or '.join(near)}?" if near else ""
            context.fail(f"No such command {args[0]!r}.{guess}")
        return super().resolve_command(context, args)

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


class Refused(Exception):
    """A request cannot be met; the message is for the user."""


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  tachometry plan --ppr 500 --max-speed 400rad/s
  tachometry generate --ppr 500 -o build
  tachometry simulate --ppr 500 --clock 200kHz --tick 1ms \\
      --motion ramp:0:40rad/s:500ms --plot ramp.png --save-capture ramp.sr
  tachometry replay ramp.sr --ppr 500 --clock 200kHz --tick 1ms --trace v.csv

tachometry COMMAND -h has the most common options, --help all of them, and
tachometry help COMMAND explains each.""",
)
@click.version_option(package_name="tachometry", message="%(prog)s %(version)s")
@click.pass_context
def cli(context: click.Context) -> None:
    """Measure the speed of a servo drive in an FPGA: encoder pins in, velocity out.

    Generates tachometer cores as Verilog, and compares every bit of them with a golden model, on the signals of a
    virtual encoder or on those that a logic analyser has captured.

    Exit status: 0 success, 1 hardware and golden model differ, 2 error, 70 a fault of tachometry itself, 130
    interrupted, 141 nobody reads the output.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
        return
    context.with_resource(writable_caches())
    show_work(_working)


def _working(what: str) -> AbstractContextManager[None]:
    from tachometry.cli.reports.terminal import working  # rich is slow to import

    return working(what)


def run(args: Sequence[str]) -> int:
    """Run a command line; its exit status.

    It raises Refused if it is wrong, or cannot be done here.
    """
    if instruction := os.environ.get(_COMPLETE):
        return shell_complete(cli, {}, "tachometry", _COMPLETE, instruction)
    with refusals():
        try:
            # Not `cli.main()`: it puts an empty line before the one on Ctrl-C.
            with cli.make_context("tachometry", list(args)) as context:
                return cli.invoke(context) or 0
        except click.exceptions.Exit as exit:
            return exit.exit_code


@contextmanager
def refusals() -> Iterator[None]:
    """Raise `Refused`, with the line that the user reads, for what a command raises that cannot be done."""
    try:
        yield
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "tachometry"
        raise Refused(f"{error.format_message()} (see {command} --help)") from error
    except click.ClickException as error:
        raise Refused(error.format_message()) from error
    except BrokenPipeError:
        raise
    except OSError as error:
        raise Refused(_of_system(error)) from error
    except ValueError as error:
        raise Refused(message_of(error)) from error
    except subprocess.TimeoutExpired as error:
        raise Refused(f"{os.path.basename(error.cmd[0])} takes longer than {error.timeout:g} s") from error
    except (OverflowError, MemoryError) as error:
        raise Refused(f"a number is too large for this computer: {str(error) or 'out of memory'}") from error


def _of_system(error: OSError) -> str:
    parts = Path(os.fsdecode(error.filename or "")).parts
    if hidden := [k for k, part in enumerate(parts) if part.startswith(PREFIX)]:
        return f"cannot write a temporary file in {Path(*parts[: hidden[0]])}: {error.strerror}"
    if error.filename:
        return f"{error.filename}: {error.strerror}"
    if error.errno in DISK:
        return f"cannot write standard output or a temporary file: {error.strerror}"
    return str(error)
