"""The watch of the encoder, from its pins and the words of the command line alone; see `extras.harness`."""

import pytest
from extras.harness import Case, agreeing, in_icarus, on_a_bus, refused

from tachometry.sim.encoder.imperfections import LineFault
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.spec import ParameterError

A_STANDS, B_STANDS, INDEX_COUNTS, ILLEGAL, A_OPEN, B_OPEN, Z_OPEN, INDEX_MISSED = range(1, 9)
SLOW = "ppr=4 clock=1kHz tick=4ms max-time=40ms health=yes"  # a second ends many times
STANDS = "ppr=1 clock=50Hz tick=4clk max-time=40clk health=yes health-edges=2 health-errors=65535"
CASES = (
    Case("m", STANDS, clocks=600, swings=True, seed=1),  # of A
    Case("m", STANDS, clocks=600, swings=True, seed=3),  # of B
    Case("m", f"{SLOW} index=yes index-at=edge health-edges=6 health-errors=1", edges=120, clocks=20_000),
    Case("m", f"{SLOW} index=yes index-at=edge index-reset=yes health-edges=2 health-errors=0", 120, 20_000, seed=2),
    Case(
        "m",
        "ppr=1 clock=50Hz tick=4clk max-time=40clk health=yes index=yes index-at=edge health-edges=3",
        clocks=6000,
        swings=True,
    ),
    Case("s", f"{SLOW} preset=-7 index=yes health-edges=6 health-errors=9 filter=1", edges=60, clocks=20_000),
    Case(
        "m",
        "ppr=8 tick=40us max-time=400us health=yes health-edges=900 health-errors=900 differential=3 "
        "index=yes filter=2",
        12,
    ),
    Case(
        "m", "ppr=8 tick=40us max-time=400us health=yes health-edges=900 health-errors=900 differential=2 invert=a", 12
    ),
    Case(
        "m",
        "ppr=8 tick=40us max-time=400us health=yes health-edges=900 health-errors=900 differential=2",
        12,
        late=True,
    ),
)
READ = Case(
    "m",
    "sensor=sampled ppr=512 bits=9 tick=8clk max-time=80clk max-speed=3000rpm health=yes zero=5 preset=-9 "
    "position-modulo=64",
    edges=60,
)
BUS = Case("m", "ppr=2 health=yes health-edges=3 health-errors=0 differential=3 index=yes index-at=edge", swings=True)


def rule(case: Case) -> None:
    """The first fault and their number in each tick are as the rules say, of pins, errors and indices as shown."""
    spec, run, texts = case.spec, case.run(), case.texts
    if spec.filter_clocks or spec.preset is not None or "invert" in texts:
        return  # whose pins are not as they are seen
    second, turn, size = spec.timing.clock_hz, 4 * int(texts["ppr"]), 1 << spec.position_width
    a, b = case.level("a"), case.level("b")
    errors = {*run.errors.tolist()}
    index = dict(zip(run.index.clock.tolist(), run.index.index_position.tolist(), strict=True)) if spec.index else {}
    opened = dict.fromkeys("ab" + "z" * bool(index), 0) if "differential" in texts else {}
    lines = {line: (case.level(line), case.level(f"{line}_n")) for line in opened}
    line, alone, counted, due = "", 0, 0, 0
    forward, was_forward, origin = True, True, None
    health, faults, index_error = {}, 0, 0
    first, at = 0, {}
    for clock in range(2, spec.latency.pin_to_count + len(a)):
        at[clock] = (first, min(faults, 255), index_error)
        here, found = clock - 2, set()
        changed = [name for name, level in (("a", a), ("b", b)) if here and level[here] != level[here - 1]]
        if len(changed) == 2:
            alone = 0
        elif changed:
            alone, line = (alone + 1 if changed == [line] and alone else 1), changed[0]
            if alone == int(texts["health-edges"]):
                alone = 0
                found.add(B_STANDS if line == "a" else A_STANDS)
        if clock in errors:
            counted += 1
            if counted == int(texts.get("health-errors", 10)) + 1:
                found.add(ILLEGAL)
        if clock % second == second - 1:
            alone = counted = 0
        for name, (level, other) in lines.items():
            opened[name] = opened[name] + 1 if level[here] == other[here] else 0
            if opened[name] == int(texts["differential"]) + 1:
                found.add({"a": A_OPEN, "b": B_OPEN, "z": Z_OPEN}[name])
        if due:
            found.add(INDEX_COUNTS)
            index_error, due = due, 0
        if clock in index:
            way = (index[clock] - (0 if "index-reset" in texts else origin or 0) + size // 2) % size - size // 2
            off = (way - (turn if forward else -turn) + size // 2) % size - size // 2
            due = off if way and origin is not None and forward == was_forward else 0
            origin, was_forward = index[clock], forward
        if len(changed) == 1:
            forward = (a[here] ^ b[here - 1]) == 1
        if found:
            first, faults = first or min(found), faults + 1
    for row in case.rows():
        if row.tick:
            health[row.health] = True
            shown = (row.health, row.faults, getattr(row, "index_error", 0))
            assert shown == at[row.clock], (row.clock, shown, at[row.clock])
            assert row.fault == (row.health != 0)
    assert faults > 2
    assert len(health) > 1  # a core without registers keeps the first


test_cores = agreeing(CASES, rule)
test_bus = on_a_bus(BUS)
test_reads_on_a_bus = on_a_bus(READ)
test_verilog = in_icarus(CASES[3])
test_refusals = refused(
    {
        "health=yes differential=1": "differential must be from 2us to 1.048576s at this clock, not 1us",
        "health=yes differential=0": "differential must be from 2us to 1.048576s at this clock, not 0s",
        "health=yes differential=soon": "differential must be",
        "differential=1us": "differential must be given together with --health",
        "health=no health-edges=9": "health_edges must be given together with --health",
        "health=yes sensor=hall": "health must be left out for hall",
        "health=yes health-edges=1": "health_edges must be from 2 to 65536, not 1",
    }
)


def test_an_encoder_without_complements_breaks_none() -> None:
    with pytest.raises(ParameterError, match="must not be of a_n without --differential"):
        VirtualEncoder(8, broken=LineFault("a_n", 0.1))
