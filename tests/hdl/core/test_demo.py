"""The whole demo, in the compiled engine: every frame that it sends against the golden models."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from support.demo import DemoPort, uart
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.boards.host.demo import DemoBoard
from tachometry.boards.monitor.selftest import Step, selftest
from tachometry.hdl.core.emulated_reads import EmulatedReads
from tachometry.sim.encoder.absolute import Answers, answer
from tachometry.spec import of_texts
from tachometry.spec.core.index import Index
from tachometry.spec.registers.demo import DemoMap, demo_manifest
from tachometry.spec.registers.emulator import EmulatorSettings, fastest, rate_of, speed_of

_COMMON = {"ppr": "16", "clock": "8MHz", "tick": "20us"}
_READ = {"clock": "8MHz", "tick": "100us", "health": "yes"}
WATCHED = {"health": "yes", "differential": "9"}
CORES = {
    "index, filter, age": of_texts(
        "s", {**_COMMON, "max-time": "2ms", "index": "yes", "age": "yes", "filter": "2"} | WATCHED
    ),
    "external tick, bounds": of_texts("m", {**_COMMON, "max-time": "1ms", "external-tick": "yes", "bounds": "yes"}),
    "reads": of_texts("m", {"sensor": "sampled", "bits": "2+6", "clock": "8MHz", "tick": "20us", "health": "yes"}),
    "biss": of_texts("m", {"sensor": "biss", "bits": "2+8", **_READ, "tick": "50us"}),
    "ssi": of_texts(
        "m",
        {"sensor": "ssi", "bits": "9", "clock": "8MHz", "tick": "100us", "line-delay": "600ns"}
        | {"gray": "yes", "repeat": "yes", "external-tick": "yes"},
    ),
    "as5047p": of_texts("m", {"sensor": "spi", "chip": "as5047p", "bits": "14", **_READ}),
    "amt22": of_texts("m", {"sensor": "spi", "chip": "amt22", "bits": "12", "line-delay": "300ns", **_READ}),
    "tformat": of_texts("m", {"sensor": "tformat", "bits": "3+9", "line-delay": "300ns", **_READ, "clock": "10MHz"}),
    "index that resets": of_texts("rairan", {**_COMMON, "max-time": "2ms", "index": "yes", "index-reset": "yes"}),
}


def random_steps(registers: DemoMap, seed: int) -> list[Step]:
    """Return settings that change at random instants."""
    spec = registers.spec
    rng = np.random.default_rng(seed)

    def settings() -> EmulatorSettings:
        return EmulatorSettings(
            speed=speed_of(spec, float(rng.uniform(-1, 1) * rng.choice([0.01, 0.2, 0.9])) * fastest(spec)),
            rate=int(rng.choice([0, rate_of(spec, fastest(spec) / 0.005)])),
            **{name: int(rng.integers(-40, 40)) for name in ("phase_error", "duty_a", "duty_b")},
            jitter=int(rng.choice([0, 7, 15])),
            bounce=int(rng.choice([0, 1, 9])),
            drop=int(rng.choice([0, 5])),
            glitches=int(rng.choice([0, 9])),
            broken=int(rng.choice([0, 0, 0, 1, 2])),
            stuck=int(rng.choice([0, 0, 0, 1, 2, 4])),
        )

    def changes() -> dict[str, int]:
        if rng.random() < 0.2:
            return {"jump": 1}
        return {name: value for name, value in asdict(settings()).items() if rng.random() < 0.3} or {"speed": 0}

    return [
        Step(f"seed {seed}, {k}", settings(), [(float(rng.uniform(0, 0.004)), changes()) for _ in range(5)], 0.004)
        for k in range(6)
    ]


@pytest.mark.parametrize("name", only([*[*CORES][:1], "biss", "as5047p", "tformat"], [*CORES]))
def test_every_frame_is_that_of_the_golden_models(name: str) -> None:
    spec = CORES[name]
    registers = DemoMap(spec)
    port = DemoPort(spec)
    board = DemoBoard(port, demo_manifest(registers, uart()), timeout=60)
    results = selftest(board, registers, period=40, chosen=random_steps(registers, len(name)))
    assert [result.difference for result in results if not result.passed] == []
    assert min(result.frames for result in results) > 5
    counts = board.link.receiver.counts
    assert (counts.lost, counts.bytes_dropped, port.board.n_broken) == (0, 0, 0)


# The lines of a core in a clock of a read that begins in clock 0.
DRIVEN = {
    "amt22": lambda reads, clock: {
        "spi_cs_n": clock < 1,
        "spi_sck": any(0 <= clock - change - reads.half < reads.half for change in reads.changes),
    },
    "tformat": lambda reads, clock: {"rs485_de": 0 < clock < reads.taken, "b": clock > 0},  # a step backward
}


@pytest.mark.parametrize("name", DRIVEN)
def test_an_emulated_line_changes_when_that_of_the_model_does(name: str) -> None:
    """Where the core does not show each clock: the velocity of method m does not depend on the age of a read."""
    reads = CORES[name].reads
    assert reads is not None
    rows = [DRIVEN[name](reads, clock) for clock in range(reads.longest)]
    line = [row[reads.line] for row in clock_by_clock(EmulatedReads(CORES[name]), rows, [reads.line])]
    place = np.array([(1 << reads.width) - 1 if name == "tformat" else 0])
    model, _ = answer(reads, np.array([0]), Answers(place, 1 + reads.delay))
    assert [clock for clock in range(1, len(line)) if line[clock] != line[clock - 1]] == model[1:].tolist()


def test_pins_and_settings_survive_a_restart() -> None:
    spec = CORES["index, filter, age"]
    registers = DemoMap(spec)
    board = DemoBoard(DemoPort(spec), demo_manifest(registers, uart()), timeout=60)
    board.set(speed=-123456, rate=7, phase_error=-5, duty_b=3, jitter=31, bounce=9, drop=200)
    board.restart()
    words = board.link.words(registers["SPEED"].offset, 4)
    assert words == (-123456 % (1 << 32), 7, -5 % 256 | 3 << 16, 31 | 9 << 8 | 200 << 16)
    # The pins do not change, whatever the emulator does.
    assert board.client.snapshot()["position"] == 0
    board.set(emulated=1, speed=-(1 << 24), rate=0)
    assert board.client.snapshot()["position"] != 0


def test_settings_that_do_not_fit_are_refused() -> None:
    spec = CORES["index, filter, age"]
    board = DemoBoard(DemoPort(spec), demo_manifest(DemoMap(spec), uart()), timeout=60)
    with pytest.raises(ValueError, match="phase_error must be from -128 to 127, not 128"):
        board.set(phase_error=128)
    with pytest.raises(ValueError, match=r"settings must be some of rate, .*, jump, not nope"):
        board.set(speed=5, nope=1)
    assert board.link.read(DemoMap(spec)["SPEED"].offset) == 0
    with pytest.raises(ValueError, match="ticks must be from 0 to 65535, not 65536"):
        board.stream(65536)


def test_the_speed_goes_where_it_shall_at_the_rate_that_is_set_with_it() -> None:
    spec = CORES["index, filter, age"]
    board = DemoBoard(DemoPort(spec), demo_manifest(DemoMap(spec), uart()), timeout=60)
    speed = speed_of(spec, 0.5 * fastest(spec))
    board.set(emulated=1, speed=speed, rate=1 << 10)
    # 2^16 times as slowly as at once: in so many clocks it has hardly begun to turn.
    assert board.client.snapshot()["position"] < 100


def test_the_index_is_high_in_a_quarter_of_each_revolution() -> None:
    """Found by the core, which captures its position."""
    spec = replace(CORES["index, filter, age"], index=Index())
    board = DemoBoard(DemoPort(spec), demo_manifest(DemoMap(spec), uart()), timeout=60)
    board.set(emulated=1, speed=speed_of(spec, 0.1 * fastest(spec)))
    seen = set()
    for _ in range(12):
        snapshot = board.client.snapshot()
        if snapshot["indexed"]:
            seen.add(snapshot["index_position"] % spec.encoder.counts_per_rev)
    assert len(seen) == 1
