"""A control loop in gates about a motor, against its golden model: all that it commands, computed again."""

from dataclasses import dataclass

import numpy as np

from tachometry.sim import golden
from tachometry.sim.golden.command_generator import Command
from tachometry.sim.golden.control import run_loop
from tachometry.sim.studies.loops.control import Outcome, Setting, in_gates, simulation_of


@dataclass(frozen=True)
class Checked:
    """Holds a run in gates."""

    ticks: int  # control ticks
    mismatches: int  # clocks, currents, filtered velocities and disturbances that differ from the golden model's
    # gates and double: of this run, and of one with a controller in double precision
    gates: Outcome
    double: Outcome


def check(setting: Setting, seed: int) -> Checked:
    """Run a setting in gates and in double precision."""
    both = in_gates(setting)
    assert both.gates is not None
    log, through = both.through(simulation_of(both.gates), seed)
    n_ticks = len(range(both.gates.latency.first_tick, through.trace.n_clocks, both.gates.period))
    commands = [Command(*row) for row in through.commands[:n_ticks].tolist()]
    expected = run_loop(both.gates, through.trace, commands, golden.tables).tables["current_valid"]
    columns = (expected.clock, expected.current, expected.filtered_velocity, expected.disturbance)
    wanted = np.stack(columns, axis=1)
    if wanted.shape != through.currents.shape:
        wrong = abs(len(wanted) - len(through.currents)) * len(columns)
    else:
        wrong = int(np.count_nonzero(wanted != through.currents))
    double = setting.outcome(setting.run(simulation_of(setting.spec), seed))
    return Checked(n_ticks, wrong, both.outcome(log), double)
