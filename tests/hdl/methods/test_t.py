"""The T method has rules that no other has."""

from support.timed import TICK, run, spec_of, speed


def test_a_count_while_the_divider_runs_opens_the_next_window() -> None:
    spec = spec_of("t")
    busy = spec.form.division_clocks
    at = {5: 1, 45: 1, 45 + busy - 1: 1, 45 + busy + 10: 1}
    got = run(spec, at, 45 + busy + 11)
    assert got == [(45, speed(1, 40), 40, False), (45 + busy + 10, speed(1, 11), 11, False)]
    # A clock later it is free.
    got = run(spec, {5: 1, 45: 1, 45 + busy: 1}, 46 + busy)
    assert got[-1] == (45 + busy, speed(1, busy), busy, False)


def test_lattice() -> None:
    """Ticks are the periods; more than one count in a tick is out of range: a count per tick, and flagged."""
    spec = spec_of("t", timer="tick", bound_decay=False)
    assert spec.times.interval_unit == TICK
    got = run(spec, {2: 1, 5: 1, 6: 0, 9: -1, 11: -1, 13: 3, 15: 1, 16: -2, 18: -1}, 19 * TICK)
    assert [(clock // TICK, velocity / 256, interval) for clock, velocity, interval, *_ in got] == [
        (5, 85 / 256, 3),
        (9, 0, 4),
        (11, -0.5, 2),
        (13, 1, 1),
        (15, 0.5, 2),
        (16, -1, 1),
        (18, -0.5, 2),
    ]


def test_paper_exact_has_no_sign_rule_and_no_decay() -> None:
    got = run(spec_of("t", paper_exact=True), {5: 1, 45: 1, 95: -1, 125: -1}, 300)
    assert [row[:2] for row in got] == [(45, speed(1, 40)), (95, speed(-1, 50)), (125, speed(-1, 30))]
