"""The command `tachometry`."""

import signal
import sys
import threading
import warnings
from collections.abc import Sequence
from typing import NoReturn

import click

from tachometry.cli.commands.compare import compare
from tachometry.cli.commands.figures import figures
from tachometry.cli.commands.generate import generate
from tachometry.cli.commands.plan import plan
from tachometry.cli.commands.replay import replay
from tachometry.cli.commands.simulate import simulate
from tachometry.cli.commands.sweep import sweep
from tachometry.cli.commands.verify import verify
from tachometry.cli.options.option import INTERRUPTED, told


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
def cli() -> None:
    """Encoder pins in, velocity out: the speed measurement of a servo drive for FPGAs.

    Generates tachometer cores as Verilog, and compares every bit of them with a golden model, on the signals of a
    virtual encoder or on those that a logic analyser has captured.

    Exit status: 0 success, 1 hardware and golden model differ, 2 error, 130 interrupted.
    """


cli.add_command(plan)
cli.add_command(generate)
cli.add_command(simulate)
cli.add_command(replay)
cli.add_command(compare)
cli.add_command(sweep)
cli.add_command(figures)
cli.add_command(verify)


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; errors are reported in one line on stderr, never by a traceback."""
    if threading.current_thread() is threading.main_thread():
        # Ends as Ctrl-C does: what is done is kept, and nothing is left behind.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        code = _run(sys.argv[1:] if args is None else args)
    except KeyboardInterrupt:
        # The simulator's, if they had not begun yet.
        warnings.filterwarnings("ignore", message="coroutine .* was never awaited")
        code = _fail("interrupted", INTERRUPTED)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "tachometry"
        code = _fail(f"error: {error.format_message()} (see {command} --help)")
    except click.ClickException as error:
        code = _fail(f"error: {error.format_message()}")
    except OSError as error:
        named = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        code = _fail(f"error: {named}")
    except ValueError as error:
        code = _fail(f"error: {told(error)}")
    except (OverflowError, MemoryError) as error:
        code = _fail(f"error: a number is too large for this computer: {error or type(error).__name__}")
    sys.exit(code)


def _run(args: Sequence[str]) -> int:
    try:
        # Not `cli.main()`: it puts an empty line before the one on Ctrl-C.
        with cli.make_context("tachometry", list(args)) as context:
            return cli.invoke(context) or 0
    except click.exceptions.Exit as exit:
        return exit.exit_code


def _fail(message: str, code: int = 2) -> int:
    click.echo(f"tachometry: {' '.join(message.split())}", err=True)
    return code
