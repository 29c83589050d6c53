"""The client: against the golden bank, against the simulated core, and against boards that are none."""

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from support.random_case import random_case

from tachometry.boards.host import client
from tachometry.boards.host.snapshot import Snapshot
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import RegisterMap

CASES = [("m", 16), ("s", 4), ("rairan", 2), ("t", 3), ("mt", 1)]


@cache
def case(method: str, seed: int) -> tuple[TachometerSpec, PinTrace, dict[str, Any]]:
    spec, _, trace = random_case(seed, method)
    return spec, trace, manifest(spec, "spindle") | {"registers": RegisterMap(spec).described()}


class GoldenBoard:
    """A board whose registers the golden bank answers, `gap` clocks after each other."""

    def __init__(self, registers: RegisterMap, trace: PinTrace, gap: int) -> None:
        self._bank = GoldenBank(registers, trace)
        self._gap = gap
        self._accesses: list[Access] = []
        self.clock = 0

    def read(self, offset: int) -> int:
        return self._access(offset, None)

    def write(self, offset: int, value: int) -> None:
        self._access(offset, value)

    def _access(self, offset: int, value: int | None) -> int:
        self.clock += self._gap
        self._accesses.append(Access(self.clock, offset // 4, value))
        data, error = self._bank.answers(self._accesses)[-1]
        assert not error
        return data or 0  # what is not defined is 0 here


@pytest.mark.parametrize(("method", "seed"), CASES)
def test_snapshots_are_those_of_the_golden_bank(method: str, seed: int) -> None:
    """Snapshots say what the core's outputs were when they were taken."""
    spec, trace, described = case(method, seed)
    registers = RegisterMap(spec)
    board = GoldenBoard(registers, trace, 7)
    bench = client.Client(board.read, board.write, described)
    before = bench.counters()
    assert before.keys() == registers.counted.keys()
    for _ in range(5):
        board.clock += trace.n_clocks // 8
        snapshot = bench.snapshot()
        taken = board._bank._captured
        assert dict(snapshot) == {name: taken[name] for name in snapshot}
        assert {port.name for port in spec.ports.outputs if not port.is_strobe} <= snapshot.keys()
        assert snapshot.velocity_rad_per_s == snapshot["velocity"] * spec.velocity.rad_per_s_per_lsb
        assert snapshot.flags.keys() == {field.name for field in registers["STATUS"].fields}
        bounds = snapshot.bounds_rad_per_s
        assert (bounds is None) == (not taken.get("bounds_valid"))
        if bounds is not None:
            assert [round(bound / spec.velocity.rad_per_s_per_lsb) for bound in bounds] == [
                taken["velocity_lower"],
                taken["velocity_upper"],
            ]
    bench.hold(True)
    first = bench.snapshot()
    board.clock += 500
    lost = bench.counters()["lost_updates"]
    bench.clear()
    assert dict(bench.snapshot()) == dict(first)
    assert bench.counters()["lost_updates"] < lost
    bench.hold(False)
    board.clock += 300
    assert dict(bench.snapshot()) != dict(first)


def test_a_snapshot_cannot_be_changed() -> None:
    snapshot = Snapshot({"velocity": -3, "forced": 1}, frozenset({"forced"}), 0.5)
    assert (dict(snapshot), dict(snapshot.flags), snapshot.velocity_rad_per_s, len(snapshot)) == (
        {"velocity": -3, "forced": 1},
        {"forced": True},
        -1.5,
        2,
    )
    assert repr(snapshot) == "Snapshot(velocity=-3, forced=1)"
    assert snapshot.bounds_rad_per_s is None
    for change in ("snapshot['velocity'] = 1", "snapshot.flags['forced'] = False", "snapshot.velocity_rad_per_s = 1"):
        with pytest.raises((TypeError, AttributeError)):
            exec(change)


def memory(described: dict[str, Any]) -> tuple[dict[int, int], Callable[[int, int], None]]:
    """Return a board that shows what its registers are after reset."""
    words: dict[int, int] = {}
    for register in described["registers"]["map"]:
        words[register["offset"]] = sum(field["reset"] << field["low"] for field in register["fields"])
    return words, words.__setitem__


def test_another_core_is_refused() -> None:
    described = case("m", 16)[2]
    other = case("s", 4)[2]
    words, write = memory(described)
    mine, theirs = (one["registers"]["configuration"] for one in (described, other))
    with pytest.raises(
        client.WrongBoard,
        match=f"^the board has configuration 0x{mine:08x}, the manifest of spindle says 0x{theirs:08x}$",
    ):
        client.Client(words.__getitem__, write, other)
    with pytest.raises(
        client.WrongBoard, match=r"^the board must answer with 0x54414348, as a tachometer does, not 0xffffffff$"
    ):
        client.Client(lambda offset: -1, write, described)


def test_a_manifest_without_registers_is_refused() -> None:
    described = manifest(of_texts("s", {"ppr": "8"}))
    with pytest.raises(ValueError, match=r"^manifest must be that of a core on a bus, which tachometry generate --bus"):
        client.Client(lambda offset: 0, lambda offset, value: None, described)


@pytest.mark.parametrize(("form", "range_"), [("edges", "-6.4 to 6.35"), ("sectors", "-3.2 to 3.15")])
def test_a_map_of_the_disc_is_written_and_read_back(form: str, range_: str) -> None:
    texts = {"ppr": "2", "clock": "1MHz", "tick": "20clk", "max-time": "60clk", "index": "yes", "disc-table": form}
    spec = of_texts("mt", texts)
    trace = PinTrace.of(VirtualEncoder(2, index=True).record(parse_motion("stop:9ms")).recording, spec).completed(spec)
    board, described = GoldenBoard(RegisterMap(spec), trace, 9), manifest(spec, "spindle")
    bench = client.Client(board.read, board.write, described | {"registers": RegisterMap(spec).described()})
    displacement = [((7 * edge) % 41 - 20) * described["disc"]["counts_per_lsb"] for edge in range(8)]
    assert bench.write_disc(displacement)
    bench.hold(True)
    assert not bench.write_disc(displacement)
    few, far = displacement[:7], [7.0, -7.0] * 4
    for wrong, message in ((few, "must have 8 edges, not 7"), (far, f"from {range_} counts")):
        with pytest.raises(ValueError, match=message):
            bench.write_disc(wrong)
    spec, trace, described = case("s", 4)
    board = GoldenBoard(RegisterMap(spec), trace, 9)
    with pytest.raises(KeyError, match="no map of the disc that is written: see --disc-table"):
        client.Client(board.read, board.write, described).write_disc(displacement)


def test_angles_are_in_degrees_and_sines_in_1() -> None:
    texts = {"ppr": "25", "clock": "1MHz", "tick": "100clk", "max-time": "600clk", "electrical": "7", "sincos": "yes"}
    spec = of_texts("s", texts)
    trace = PinTrace.of(VirtualEncoder(25).record(parse_motion("stop:9ms")).recording, spec).completed(spec)
    board, described = GoldenBoard(RegisterMap(spec), trace, 9), manifest(spec, "spindle")
    bench = client.Client(board.read, board.write, described | {"registers": RegisterMap(spec).described()})
    bench.write_degrees("ANGLE_SET", -90)
    board.clock += 1000
    now = bench.snapshot()
    assert (now.in_unit("angle"), now["angle_valid"]) == (270, 1)
    assert [now.in_unit(name) for name in ("angle_sin", "angle_cos", "position")] == [-1, pytest.approx(0, abs=1e-4), 0]
    bench.write_degrees("ANGLE_OFFSET", 12.3)
    board.clock += 1000
    assert bench.snapshot().in_unit("angle") == pytest.approx(282.3, abs=0.01)
    with pytest.raises(KeyError):
        bench.write_degrees("ANGLE_ON", 0)
