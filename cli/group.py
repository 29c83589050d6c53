"""The command `tachometry` with all of its commands, and what their errors say."""

from collections.abc import Sequence

import click

from tachometry.cli.commands.build import build
from tachometry.cli.commands.compare import compare
from tachometry.cli.commands.figures import figures
from tachometry.cli.commands.generate import generate
from tachometry.cli.commands.loop import loop
from tachometry.cli.commands.monitor import monitor
from tachometry.cli.commands.plan import plan
from tachometry.cli.commands.program import program
from tachometry.cli.commands.replay import replay
from tachometry.cli.commands.simulate import simulate
from tachometry.cli.commands.sweep import sweep
from tachometry.cli.commands.verify import verify
from tachometry.cli.environment import DISK, writable_caches
from tachometry.cli.options.option import told


class Refused(Exception):
    """Tells the user, by its message, that a request cannot be met."""


@click.group(
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  tachometry plan --ppr 500 --max-speed 400rad/s
  tachometry generate --ppr 500 -o build
  tachometry simulate --ppr 500 --clock 200kHz --tick 1ms \\
      --motion ramp:0:40rad/s:500ms --plot ramp.png --save-capture ramp.sr
  tachometry replay ramp.sr --ppr 500 --clock 200kHz --tick 1ms --trace v.csv

`tachometry COMMAND --help` explains a command and all of its options.""",
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
    context.with_resource(writable_caches())


cli.add_command(plan)
cli.add_command(generate)
cli.add_command(simulate)
cli.add_command(replay)
cli.add_command(compare)
cli.add_command(sweep)
cli.add_command(loop)
cli.add_command(figures)
cli.add_command(verify)
cli.add_command(build)
cli.add_command(program)
cli.add_command(monitor)


def run(args: Sequence[str]) -> int:
    """Run a command line; its exit status.

    Raises
    ------
    Refused
        If it is wrong, or cannot be done here.
    """
    try:
        # Not `cli.main()`: it puts an empty line before the one on Ctrl-C.
        with cli.make_context("tachometry", list(args)) as context:
            return cli.invoke(context) or 0
    except click.exceptions.Exit as exit:
        return exit.exit_code
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
        raise Refused(told(error)) from error
    except (OverflowError, MemoryError) as error:
        raise Refused(f"a number is too large for this computer: {error or type(error).__name__}") from error


def _of_system(error: OSError) -> str:
    if error.filename:
        return f"{error.filename}: {error.strerror}"
    if error.errno in DISK:
        return f"cannot write standard output or a temporary file: {error.strerror}"
    return str(error)
