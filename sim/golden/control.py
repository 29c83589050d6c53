"""The golden control loop computes observer and controller in exact integers, one control tick at a time."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.command_generator import Command, Demand, Gains, generated
from tachometry.sim.golden.front_end import count, decoded
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run, Table
from tachometry.spec import TachometerSpec
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.form import GAINS, GUARD_BITS, ControlForm, Term
from tachometry.spec.control.ports import CONTROL, CURRENT
from tachometry.spec.language.port import UPDATE

__all__ = ["Command", "Control", "Demand", "Gains", "control", "run_loop"]

IntArray = NDArray[np.int64]
_COMMANDS = ("command_position", "command_velocity", "command_acceleration")


class Control:
    """Keeps the state of a loop between two control ticks.

    - `y`, `w`, `z`: In 2^−f of an LSB of the velocity; w = z − y.
    - `saturated`: Whether it was held within the limit.
    """

    def __init__(self, form: ControlForm) -> None:
        self._form = form
        self.y = self.w = self.current = 0
        self.saturated = False
        self._held = self._n = self._sum = 0
        self._waits = self._ticked = False
        # For each term the shift and the coefficients, as reading them takes most of the time.
        self._terms = {term: (one.shift, one.values) for term, one in form.terms.items()}
        self._limit = form.current_limit
        self._half = 1 << (form.factor_bits - 1)
        wraps = form.position_width + form.position_bits
        self._turn, self._half_turn, self._most_error = 1 << wraps, 1 << (wraps - 1), form.most_error

    @property
    def z(self) -> int:
        """The observer's filter."""
        return self.y + self.w

    def set(self, gains: Gains) -> None:
        """Set the gains from the next control tick on."""
        form = self._form
        raw = (gains.position, gains.velocity, gains.acceleration, gains.disturbance)
        for term, one in zip(GAINS, raw, strict=True):
            self._terms[term] = (form.terms[term].shift, (one << form.gain_shift,))
        self._limit = min(gains.limit, form.current_limit)

    def update(self, velocity: int, *, measured: bool = True) -> None:
        """Take an update of the velocity, after the last control tick; one that is not measured is only held."""
        if self._form.synchronised and self._waits:
            return
        self._held = velocity
        self._waits = self._ticked and measured

    def tick(self, position: int, command: Command) -> int:
        """Return a control tick at a position, in counts: the new current."""
        form = self._form
        if not form.synchronised:
            self._observe(1)
        elif self._waits or self._n == form.longest:
            self._observe(self._n)
        self._waits, self._ticked = False, True
        error = (command.position - (position << form.position_bits) + self._half_turn) % self._turn - self._half_turn
        error = max(-self._most_error, min(error, self._most_error))
        speed = (command.velocity << (form.extra_bits - form.command_bits)) - self.y
        total = (
            self._product(Term.POSITION, error)
            + self._product(Term.VELOCITY, speed)
            + self._product(Term.ACCELERATION, command.acceleration)
            + self._product(Term.DISTURBANCE, self.w)
        )
        wanted = (total + (1 << (GUARD_BITS - 1))) >> GUARD_BITS
        held = max(-self._limit, min(wanted, self._limit))
        self.saturated = command.enable and held != wanted
        self.current = held if command.enable else 0
        self._sum += self.current
        self._n += 1
        return self.current

    def _observe(self, n: int) -> None:
        """Compute eq. (22) for velocity and observer, with the currents of n control ticks."""
        fine = self._held << self._form.extra_bits
        z = self.z
        if Term.FILTER in self._terms:
            self.y += self._product(Term.FILTER, fine - self.y, n)
        else:
            self.y = fine
        z -= self._product(Term.OBSERVER, z - self.y, n)
        self.w = z + self._product(Term.CURRENT, self._sum, n) - self.y
        self._sum = self._n = 0

    def _product(self, term: Term, word: int, n: int = 1) -> int:
        shift, values = self._terms[term]
        return ((word << shift) * values[n - 1] + self._half) >> self._form.factor_bits


def control(
    spec: LoopSpec,
    clock: IntArray,
    position: IntArray,
    updates: Table,
    commands: Sequence[Command],
    gains: Sequence[Gains] | None = None,
) -> Table:
    """Return what the loop shows with `current_valid`, of a shaft whose motion does not follow from its currents.

    - `clock`, shape (n,): Clocks of the control ticks.
    - `updates`: Of the tachometer, with `velocity`.
    - `gains`: One for each control tick, where they are inputs.
    """
    loop = Control(spec.form)
    rows: list[tuple[int, bool, int, int]] = []
    velocity = updates.velocity.tolist()
    measured = [True] * len(velocity)
    if spec.tachometer.facts.awaits_count:
        measured = (updates.forced == 0).tolist()
    # An update in the clock of a control tick comes after it.
    before = np.searchsorted(updates.clock, clock, side="left").tolist()
    done = 0
    for number, (until, place, command) in enumerate(zip(before, position.tolist(), commands, strict=True)):
        if gains is not None:
            loop.set(gains[number])
        for row in range(done, until):
            loop.update(velocity[row], measured=measured[row])
        done = until
        loop.tick(place, command)
        rows.append((loop.current, loop.saturated, loop.y, loop.w))
    columns = np.array(rows, dtype=np.int64).reshape(-1, 4).T
    names = ("current", "current_saturated", "filtered_velocity", "disturbance")
    return Table(clock + spec.latency.tick_to_result, dict(zip(names, columns, strict=True)))


def run_loop(
    spec: LoopSpec,
    trace: PinTrace,
    commands: Sequence[Command] | Sequence[Demand],
    tables: Callable[[TachometerSpec, PinTrace], dict[str, Table]],
    gains: Sequence[Gains] | None = None,
) -> Run:
    """Return what the core of `spec` must show for these pins; `tables` is the golden model of a tachometer.

    There is a command for each control tick within the trace; of a core with a command generator, a demand;
    and gains, where they are inputs.
    """
    alone = spec.tachometer
    clock = np.arange(spec.latency.first_tick, trace.n_clocks, spec.period)
    # The position is as late as a tick shows it.
    places, _ = count(alone, decoded(alone, trace), clock - alone.latency.tick)
    found = tables(alone, trace)
    given = [one for one in commands if isinstance(one, Command)]
    columns: dict[str, IntArray] = {}
    if spec.command == "generator":
        demands = [one for one in commands if isinstance(one, Demand)]
        given = generated(spec.generator, places.position.tolist(), demands)
        rows = np.array([(one.position, one.velocity, one.acceleration) for one in given], dtype=np.int64)
        columns = dict(zip(_COMMANDS, rows.reshape(-1, 3).T, strict=True))
    shown = control(spec, clock, places.position, found[UPDATE], given, gains)
    found |= {CONTROL: Table(clock, columns), CURRENT: shown.rows(shown.clock < trace.n_clocks)}
    return Run.of_ports(spec, trace.n_clocks, found)
