"""The map of a disc in the core, from the pins and the words of the command line alone; see `extras.harness`."""

import json
from contextlib import nullcontext
from dataclasses import replace
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from extras.harness import BASE, Case, agreeing, in_icarus, on_a_bus, refused
from proofs.formal.mutants import mutant
from support.nightly import nightly

from tachometry.hdl.extras import disc as gates
from tachometry.hdl.extras import sectors
from tachometry.hdl.front_end import index_capture
from tachometry.hdl.methods import count_way, quotient_velocity, tick_counts, timed, track, window_ends
from tachometry.sim import build, golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.golden.methods import track as twin
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.plan import plan_at
from tachometry.spec import ParameterError, of_texts
from tachometry.spec.core.disc import Disc
from tachometry.spec.core.extras import disc as of_disc
from tachometry.spec.core.extras.disc import DiscMap
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.formats.sectors import Sectors, sectors_of
from tachometry.spec.registers.manifest import manifest

EDGES = 100
FAR = tuple(np.clip(np.random.default_rng(7).normal(0, 0.15, EDGES), -0.4, 0.4).round(5).tolist())


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let far.json be a map whose index is at place 2, other.json one without an index, and slow.json off centre."""
    monkeypatch.chdir(tmp_path)
    far = Disc(EDGES, FAR, 4, 2, 0.01, 0.05, (60.0, 150.0), 40.0, False)
    slow = replace(far, displacement=tuple(np.cos(np.arange(EDGES) * 2 * np.pi / EDGES) + 0.2 * np.array(FAR)))
    steep = replace(far, displacement=tuple(3 * np.sin(np.arange(EDGES) * 2 * np.pi / EDGES)))
    for name, one in {"far": far, "other": replace(far, index_place=None), "slow": slow, "steep": steep}.items():
        Path(f"{name}.json").write_text(one.text)


class Mapped(Case):
    """A shaft whose index is where it should be; the table is seldom written, and the place seldom forgotten."""

    def trace(self) -> PinTrace:
        trace = super().trace()
        a, b = trace.lines["a"].astype(int), trace.lines["b"].astype(int)
        turn = (np.diff((a ^ b) + 2 * b) + 1) % 4 - 1  # along 00, 10, 11, 01
        place = np.append(0, np.cumsum(turn))
        seldom = (np.random.default_rng(self.seed).random(len(trace.clock)) < 0.03).astype(np.uint8)
        names = {"disc_write", "disc_forget"} & trace.lines.keys()
        lines = trace.lines | {name: trace.lines[name] & seldom for name in names}
        lines["z"] = (place % EDGES == 2).astype(np.uint8)
        return PinTrace.of_lines(trace.clock, trace.n_clocks, lines)


CASES = (
    Mapped("mt", "disc=far.json index=yes", edges=100),
    Mapped("t", "disc=other.json disc-table=edges max-speed=100rev/s", edges=100),
    Mapped("mt", "disc-table=edges disc=far.json index=yes index-once=yes preset=7 whole-cycles=yes", edges=60),
    Mapped(
        "t", "disc=far.json index=yes index-reset=yes tick=300clk max-time=3000clk unit=rpm", edges=120, clocks=400_000
    ),
    Mapped("mt", "disc=slow.json disc-table=sectors:9 index=yes", edges=100),
)
TRACKED = (
    Mapped("track", "disc=far.json index=yes tick=300clk multiplier=block max-time=3000clk", edges=70, clocks=200_000),
    Mapped("track", "disc=other.json disc-table=edges tick=1000clk smooth=yes max-time=5000clk", edges=60),
    Mapped(
        "track",
        "disc=slow.json disc-table=sectors index=yes tick=300clk max-time=3000clk max-speed=20rev/s",
        60,
        120_000,
    ),
)
SLOW = (
    Mapped("s", "disc=far.json index=yes", edges=100),
    Mapped("s", "disc=other.json disc-table=edges max-time=180clk tick=90clk", edges=100, clocks=20_000),
    Mapped(
        "s", "disc=slow.json disc-table=sectors index=yes tick=3clk max-time=9clk max-speed=9000rev/s", 100, late=True
    ),
    Mapped(
        "s", "disc=far.json index=yes tick=300clk max-time=2100clk unit=rad/s lowpass=50Hz", 100, 200_000, late=True
    ),
)
BOUNDED = (
    Mapped("mt", "disc=far.json index=yes bounds=yes edge-error=0.25", edges=100),
    Mapped("t", "disc=other.json disc-table=edges bounds=yes max-speed=100rev/s", edges=100, late=True),
    Mapped("mt", "disc=slow.json disc-table=sectors index=yes bounds=yes", edges=100, late=True),
)
WRITTEN = (
    Mapped("mt", "disc-table=sectors:9 index=yes", edges=100),
    Mapped("track", "disc-table=sectors:20 index=yes tick=300clk max-time=3000clk max-speed=20rev/s", 60, 90_000),
    Mapped("t", "disc-table=sectors index=yes bounds=yes", edges=100, late=True),
    Mapped("s", "disc-table=sectors:11 index=yes", edges=100, late=True),
    Mapped("s", "disc=far.json index=yes tick=1clk max-time=3clk max-speed=9000rev/s", edges=200, clocks=4000),
)
# Beside what shows a place of the shaft.
_FINE = "disc=far.json index=yes tick=400clk max-time=4000clk"
BESIDE = (
    Mapped("track", f"{_FINE} electrical=3 lead=1tick probe=2 stream=axi", edges=60, clocks=120_000, late=True),
    Mapped("track", f"{_FINE} position-compare=1.5:0.25:200:1clk:fine smooth=yes", edges=60, clocks=120_000, late=True),
    Mapped("mt", "disc=far.json index=yes tick=99clk max-time=990clk electrical=3 probe=1", 99, 90_000, late=True),
    Mapped("t", "disc=slow.json disc-table=sectors index=yes position-compare=3:5:20:9clk", edges=100, late=True),
)
BUS = (
    Case("mt", "disc=far.json index=yes position-modulo=rev/4", swings=True),
    Case("t", "disc=other.json disc-table=edges", edges=60),
    Case("mt", "disc-table=sectors:5 index=yes", swings=True),
)


def rule(case: Case) -> None:
    """The map is used in some ticks and not in others, and never while it is bypassed."""
    used, bypass = case.run().ticks.disc_used, case.level("disc_bypass")
    assert 0.01 < used.mean() < 0.99
    assert not any(used[[bypass[clock] == 1 for clock in case.run().ticks.clock]])


test_cores = agreeing(CASES + TRACKED + BOUNDED + SLOW + WRITTEN + BESIDE, rule)
test_first_bus, test_second_bus, test_third_bus = map(on_a_bus, BUS)
test_refusals = refused({"disc-table=edges": "disc_table must not be given with method m"})


@pytest.mark.parametrize(
    ("method", "words", "why"),
    [
        ("mt", "disc=far.json", ""),
        ("m", "disc=far.json", "must not be given with method m"),
        ("s", "disc=far.json cancel=no", "cancel must be yes with --disc"),
        ("s", "disc=far.json bounds=yes", "disc does not work with --bounds"),
        ("mt", "disc=none.json", "disc must be a file that can be read, not 'none.json': "),
        (
            "mt",
            "disc=far.json ppr=24",
            "the map of this encoder, 96 counts a turn with x4 decoding, not of 100 with x4",
        ),
        ("mt", "disc=other.json index=yes", "must have an index: type tachometry calibrate with --index"),
        ("mt", "disc=far.json index=yes index-at=A=0,B=1", "must have the index at 3, as --index-at, not 2"),
        ("mt", "disc-table=edges ppr=4097", "disc_table must be of 2 to 16384 counts per turn, not 16388"),
        ("mt", "disc-table=edges ppr=1 decoding=1", "disc_table must be of 2 to 16384 counts per turn, not 1"),
        ("mt", "disc-table=sectors:3", "disc_table must be edges or sectors:N, N from 4 to 256, not sectors:3"),
        (
            "mt",
            "disc=far.json disc-table=none",
            "disc_table must be edges or sectors:N, N from 4 to 256, not none",
        ),
        ("mt", "disc-table=auto", "disc_table must be edges without --disc"),
        ("t", "disc=other.json disc-table=sectors", "must be edges without an index in a state of the lines"),
        ("mt", "disc=steep.json disc-table=sectors:4 index=yes", "must have more sectors than 4 of 32 edges, which"),
        ("mt", "disc=far.json timer=tick", "timer must be clock with --disc"),
        ("mt", "disc=far.json reverse=yes index=yes", "disc must be measured with --reverse, as the core counts"),
        ("t", "disc-table=edges teeth=60-2 sensor=pulses ppr=60 decoding=1", "does not work with --teeth"),
    ],
)
def test_refusals_of_maps(method: str, words: str, why: str) -> None:
    if not why:
        assert DiscMap.of(Case(method, words).spec.extras)
        return
    with pytest.raises(ParameterError) as caught:
        _ = Case(method, words).spec.ports
    assert why in str(caught.value)


def turning(spec: Any, places: Any, apart: int = 23, **levels: Any) -> PinTrace:
    """Return a shaft that is at these places one after the other, with an index at each place 2 of a turn."""
    clock = np.arange(len(places)) * apart
    level = quadrature(np.asarray(places))
    lines = {
        "a": level & np.uint8(1),
        "b": level >> np.uint8(1),
        "z": (np.asarray(places) % EDGES == 2).astype(np.uint8),
    }
    return PinTrace.of_lines(clock, int(clock[-1]) + 200, lines | levels).completed(spec)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("", ""),
        (" - begins", ""),
        *(pytest.param(*one, marks=nightly) for one in (
            ("Mux(self.ends, len(table.slopes) - 1, ", "Mux(0, 0, "),
            ("half + at_index", "half"),
            ("Mux(was, value, moved)", "moved"),
            ("self.place + ~back", "self.place"),
        )),
    ],
)  # fmt: skip
@pytest.mark.parametrize("method", ["mt", pytest.param("track", marks=nightly)])
def test_sectors_follow_a_shaft_both_ways(method: str, text: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over edge 0 and the borders of sectors, on lines that do not close."""
    slopes = np.random.default_rng(5).integers(-99, 99, 8)
    lines = Sectors(EDGES, 4, 6, tuple(slopes.tolist()), (9, -7, 5, -8))
    monkeypatch.setattr(of_disc, "sectors_of", lambda *_: lines)
    words = "max-time=3000clk tick=300clk" if method == "track" else ""
    spec = Case(method, f"disc=slow.json disc-table=sectors index=yes {words}").spec
    ends = [0, 230, 90, 105, 94, 106, -130, 17, -20]
    places = np.concatenate([np.arange(one, other, 1 if other > one else -1) for one, other in pairwise(ends)])
    with mutant(sectors.SectorTable, text, wrong) if text else nullcontext():
        assert bool(lockstep(spec, turning(spec, places), Cxxrtl()).n_mismatches) == bool(text)


def test_sectors_are_the_nearest_line() -> None:
    """Of a disc that is off centre nothing is left, of white errors most."""
    angle, noise = np.arange(2000) * np.pi / 1000, np.random.default_rng(3).normal(0, 0.1, 2000)
    for far, left in ((np.sin(angle), 0.003), (np.sin(angle) + np.tile((0.1, 0, 0.1, 0), 500), 0.003), (noise, 0.1)):
        lines = sectors_of(tuple(far.tolist()), 32, 1 / 960, True)
        wrong = np.array(lines.values) / 960 / 2**lines.fine + np.tile(lines.quarters, 500) / 960 - far
        assert (len(lines.slopes), lines.bits, lines.values[-1] + lines.slopes[-1]) == (33, 6, 0)
        assert len(sectors_of(tuple(far[:100].tolist()), 32, 1 / 960, True).slopes) == 26
        assert np.std(wrong) < left
        assert np.abs(np.fft.rfft(wrong)[1:7]).max() * 2 / 2000 < 0.003


def test_every_arrow_of_trust() -> None:
    """Two turns make it sure; a slip is seen, a second one takes it out of use, and one that agrees brings it back."""
    spec = Case("mt", "disc=far.json index=yes").spec
    turns = [np.arange(0, 250), 251 + np.arange(0, 200), 452 + np.arange(0, 101), 554 + np.arange(0, 320)]
    places = np.concatenate(turns)  # the place jumps by 2 of the index that the core expects, three times
    real = np.concatenate(
        [np.arange(0, 250), 250 + np.arange(0, 200), 450 + np.arange(0, 101), 551 + np.arange(0, 320)]
    )
    level, z = quadrature(real), (places % EDGES == 2).astype(np.uint8) * (real % 4 == 2)
    lines = {"a": level & np.uint8(1), "b": level >> np.uint8(1), "z": z.astype(np.uint8)}
    trace = PinTrace.of_lines(np.arange(len(real)) * 23, len(real) * 23 + 200, lines).completed(spec)
    run = golden.run(spec, trace)
    ticks = run.ticks
    seen = [(bool(u), bool(s)) for u, s in zip(ticks.disc_used, ticks.disc_sure, strict=True)]
    assert [one for one, other in pairwise([*seen, None]) if one != other] == [
        (False, False),
        (True, False),
        (True, True),
    ]
    assert lockstep(spec, trace, Cxxrtl()).n_mismatches == 0


FAULTS = (
    (gates.Gates, "Mux(step[0], step[1], was)", "step[0]", 2),
    (gates.Gates, "trust[0].eq(agrees | ~unsure)", "trust[0].eq(1)", 0),
    (gates.Gates, "Mux(shows, self.displaced, latest)", "latest", 0),
    (gates.Gates, "Mux(rest < 0, total, rest)", "total", 1),
    (gates.Gates, "self.disc_forget | writes", "self.disc_forget", 1),
    (gates.Gates, "Mux(back, place, moved)", "moved", 0),
    (tick_counts.TickCounts, "Mux(takes, self.displaced, 0)", "0", 5),
    (track.TrackMethod, "counts.number > 1", "1", 5),
    (count_way.CountWay, "self.displaced_before << self._low", "self.displaced_before", 3),
    (window_ends.WindowEnds, "Mux(self.forced, kept, end)", "end", 12),
    (window_ends.WindowEnds, "== self._moved_on", "== self._moved_on + 1", 12),
    (window_ends.WindowEnds, "self.step_before[0], self.step_before[1], was", "0, 0, was", 11),
    (window_ends.WindowEnds, "self.rises, below, above", "self.rises, above, below", 11),
    (index_capture.IndexCapture, "0 if self._early else self._late", "self._late", 13),
    (timed._is_mapped, "used & opening", "used", 8),
    (timed._is_mapped, "delay(m, mapped)", "(mapped,)", 9),
    (quotient_velocity.QuotientVelocity, "silent_way", "timer_periods", 8),
)


@nightly
@pytest.mark.parametrize(("box", "text", "wrong", "case"), FAULTS)
def test_wrong_gates_are_seen(box: Any, text: str, wrong: str, case: int) -> None:
    with mutant(box, text, wrong):
        one = (CASES + TRACKED + BOUNDED + SLOW)[case]
        assert lockstep(one.spec, one.trace(), Cxxrtl()).n_mismatches


@pytest.mark.parametrize(
    ("box", "text", "wrong"),
    [
        (None, "", ""),
        pytest.param(tick_counts.TickCounts, "Mux(was, latest, ahead)", "ahead", marks=nightly),
        pytest.param(track.TrackMethod, "machine.sign", "0", marks=nightly),
        pytest.param(gates.Gates, "counted | self._looks", "counted", marks=nightly),
        pytest.param(gates.Gates, "Mux(step[0], step[1], was)", "step[1]", marks=nightly),
    ],
)
def test_silences_know_the_edges_about(box: Any, text: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A shaft that swings slowly waits at edges, whose displacement says how far it may have gone."""
    spec = Case("track", "disc=far.json index=yes tick=300clk multiplier=block max-time=3000clk").spec
    moved = parse_motion("constant:50rad/s:140ms+sine:20rad/s:4Hz:250ms")
    trace = PinTrace.of(VirtualEncoder(25, index=True).record(moved).recording, spec).completed(spec)
    with mutant(box, text, wrong) if box else nullcontext():
        assert bool(lockstep(spec, trace, Cxxrtl()).n_mismatches) == bool(box)
    if box is None:
        run = golden.run(spec, trace)
        assert run.ticks.disc_used[-1]
        twin.compiled.cache_clear()
        monkeypatch.setattr(build, "find_compiler", lambda: None)  # so it is the one in Python
        for name, column in golden.run(spec, trace).updates.columns.items():
            assert np.array_equal(column, run.updates[name]), name
        twin.compiled.cache_clear()


@pytest.mark.parametrize("method", ["t", "mt", pytest.param("track", marks=nightly)])
def test_a_map_of_zeros_changes_nothing(method: str) -> None:
    Path("even.json").write_text(replace(Disc.parse(Path("far.json").read_text()), displacement=(0.0,) * EDGES).text)
    words = "index=yes " + {"track": "tick=300clk max-time=3000clk multiplier=block"}.get(method, "max-speed=200rev/s")
    more = dict(word.split("=") for word in words.split())
    case = Mapped(method, f"disc=even.json {words}", edges=100, clocks=200_000)
    spec, trace = case.spec, case.trace()
    plain = of_texts(method, BASE | more)
    run, without = golden.run(spec, trace), golden.run(plain, trace)
    assert run.ticks.disc_used.any()
    for name in without.updates.columns:
        assert np.array_equal(run.updates[name], without.updates[name]), name


@pytest.mark.parametrize("method", ["t", "mt"])
def test_a_map_takes_the_disc_away(method: str) -> None:
    """Of a shaft at constant speed whose edges lie as the map says, both ways; bounds hold while it is used."""
    words = "disc=far.json index=yes clock=10MHz tick=1000clk max-time=20000clk bounds=yes"
    spec = Case(method, words).spec
    unit = manifest(spec)["disc"]["counts_per_lsb"]
    at = np.arange(1, 401) + np.round(np.array(FAR)[np.arange(1, 401) % EDGES] / unit) * unit
    for way in (1, -1):
        clock = np.rint((at if way > 0 else 500 - at[::-1]) * 1000).astype(np.int64)
        level = quadrature(np.arange(0, 401)[::way])
        lines = {"a": level & np.uint8(1), "b": level >> np.uint8(1)}
        lines["z"] = (np.arange(0, 401)[::way] % EDGES == 2).astype(np.uint8)
        trace = PinTrace.of_lines(np.append(0, clock), 505_000, lines).completed(spec)
        updates = golden.run(spec, trace).updates
        late = updates.rows((updates.clock > 210_000) & (updates.clock < 390_000))
        speed = late.velocity / 2**spec.velocity.frac_bits
        assert np.abs(speed - way).max() < 0.01
        least, most = (late[name] / 2**spec.velocity.frac_bits for name in BOUNDS)
        assert ((least <= way) & (most >= way) & late.bounds_valid).all()
        assert np.median(most - least) < 0.01
        assert not updates.bounds_valid[updates.clock < 2000].any()
        bypassed = golden.run(
            spec, PinTrace.of_lines(trace.clock, trace.n_clocks, trace.lines | {"disc_bypass": 1 + 0 * trace.a})
        )
        assert np.abs(bypassed.updates.velocity / 2**spec.velocity.frac_bits - way)[20:].max() > 0.05
        assert not bypassed.updates.bounds_valid.any()


def test_a_turn_aligns_a_core_without_an_index_while_the_shaft_turns() -> None:
    """A turn of 30 counts is taken in the next clock without a count, and the map is used from then on."""
    spec, engine = Case("mt", "disc=other.json").spec, Cxxrtl()
    for late in range(-3, 4):
        trace = turning(spec, np.arange(300), disc_turn_by=np.full(300, 30, np.uint8))
        trace = trace.with_pulses("disc_turn", np.array([2300 + late]))
        assert lockstep(spec, trace, engine).n_mismatches == 0
        ticks = golden.run(spec, trace).ticks
        assert ticks.clock[ticks.disc_used.argmax()] - 2300 in range(0, 25)


def test_a_place_is_forgotten_with_any_clock_about_a_count() -> None:
    spec, engine = Case("mt", "disc=other.json").spec, Cxxrtl()
    trace = turning(spec, np.arange(200), disc_turn_by=np.full(200, 30, np.uint8))
    for late in (*range(6), *range(23, 29)):  # an update may end with every second count
        forgotten = trace.with_pulses("disc_turn", np.array([500])).with_pulses("disc_forget", np.array([2300 + late]))
        assert lockstep(spec, forgotten, engine).n_mismatches == 0
        used = golden.run(spec, forgotten).ticks.disc_used
        assert used.any()
        assert not used[-1]


@pytest.mark.parametrize("reverse", ["no", "yes"])
@pytest.mark.parametrize("state", ["A=0,B=0", "A=1,B=0", "A=1,B=1", "A=0,B=1"])
def test_the_place_of_the_index_is_where_a_shaft_finds_it(state: str, reverse: str) -> None:
    spec = Case("mt", f"disc-table=edges index=yes index-at={state} reverse={reverse}").spec
    encoder = VirtualEncoder.of(spec.encoder, index=True, index_width=4)
    trace = PinTrace.of(encoder.record(parse_motion("constant:50rad/s:300ms")).recording, spec).completed(spec)
    found = {*(golden.run(spec, trace).index.index_position % 4).tolist()}
    assert found == {DiscMap.of(spec.extras).index_place(spec)}  # type: ignore[union-attr]


def test_a_plan_has_the_error_that_a_map_leaves() -> None:
    for method in ("mt", "track"):
        errors = []
        for words in ("", "disc=far.json", "disc=far.json disc-table=sectors:4"):
            spec = Case(method, f"index=yes tick=300clk max-time=3000clk {words}").spec
            errors.append(float(plan_at(spec, 50.0).disc[0]))
            mapped, left = DiscMap.of(spec.extras), np.hypot(0.051, 0.148 * (":" in words))
            assert not mapped or mapped.edges_off(spec) == pytest.approx(left, rel=0.1)
        assert errors[0] > 1.4 * errors[1]
        assert errors[2] > errors[0]  # lines are of no use for a disc that has uneven lines alone


def test_the_manifest_has_the_table() -> None:
    spec = Case("mt", "disc=far.json index=yes").spec
    entry = json.loads(json.dumps(manifest(spec)["disc"]))
    table = bytes(round(each / entry["counts_per_lsb"]) % 256 for each in FAR)
    assert (entry["entries"], entry["index_place"]) == (EDGES, 2)
    assert entry["sha256"] == sha256(table).hexdigest()
    fast = "disc=far.json index=yes clock=48MHz tick=20us max-time=9ms"
    for form in (Case("mt", fast).spec.displacement, Case("mt", f"{fast} disc-table=sectors:9").spec.displacement):
        assert form is not None
        assert form.low == 2  # bits of a distance that are free for what is added to round
    for words, worst in (("disc=far.json", max(map(abs, FAR))), ("disc-table=edges", 0.99)):  # no bit is idle
        tracked = Case("track", f"{words} index=yes tick=1000clk max-time=5000clk").spec
        assert 64 <= worst / manifest(tracked)["disc"]["counts_per_lsb"] < 128


test_verilog = in_icarus(CASES[0])
