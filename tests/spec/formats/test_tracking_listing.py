"""The listing of the tracking method computes what the recursion says, on every way, and nothing overflows."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support.tracking import Interpreter, core, windows

from tachometry.sim.golden.methods.track_recursion import Recursion, log2
from tachometry.sim.golden.methods.track_sampled import SampledRecursion
from tachometry.spec import TrackTachometer, of_texts
from tachometry.spec.formats.tracking import WIDTH
from tachometry.spec.formats.tracking_code import FIRST_INPUT, assembled
from tachometry.spec.formats.tracking_instruction import Instruction, Jump
from tachometry.spec.formats.tracking_sampled import SampledTracking

# Ticks of few clocks and of many, of one length and of several; words as wide as they come.
CORES = [
    core(tick="200us", clock="12MHz", max_speed="500rad/s", max_time="8ms"),
    core(external_tick="yes", max_tick_period="683us", ppr="81000"),
    core(tick="1ms", max_time="20ms", ppr="16"),
    core(max_memory="5ms"),
    core(max_speed="56.25rev/s", max_time="60us", clock="48MHz", frac_bits="32"),
]
# Motions that meet every instruction, and one whose velocity goes beyond its bounds, to either side.
MOTIONS = [(CORES[0], 5, 1100), (CORES[1], 4, 300), (CORES[2], 5, 300), (CORES[3], 6, 300), (CORES[4], 4, 60)]


def run(spec: TrackTachometer, seed: int, n_ticks: int) -> Counter[int]:
    """Run the program; how often each instruction was met."""
    machine, state = Interpreter(spec.program), Recursion(spec.form, spec.program.ahead)
    for nth, row in enumerate(windows(spec, seed, n_ticks).rows()):
        assert machine.tick(*row) == state.tick(*row), f"seed {seed}, tick {nth}"
        assert machine.words["T"] == state.memory, f"seed {seed}, tick {nth}"
    return machine.met


@pytest.mark.parametrize("multiplier", ["serial", "block"])
def test_listing(multiplier: str) -> None:
    """Every instruction is met."""
    cores = [replace(core, multiplier=multiplier) for core, *_ in MOTIONS]
    met = sum((run(core, *motion) for core, (_, *motion) in zip(cores, MOTIONS, strict=True)), Counter[int]())
    code = cores[0].program.code
    labels = {place: label for label, place in code.labels.items()}
    missed = [(labels.get(place), one) for place, one in enumerate(code.instructions) if not met[place]]
    assert not missed
    assert len(cores[0].program.words) <= FIRST_INPUT
    assert len(code.instructions) < 1024  # one more makes the memory of the program twice as large


@pytest.mark.parametrize("multiplier", ["serial", "block"])
def test_listing_of_reads(multiplier: str) -> None:
    """Some are far from where they are expected, one or two in a row; nothing checks them."""
    texts = {"sensor": "sampled", "bits": "17", "crc": "none", "period": "128", "multiplier": multiplier}
    spec, rng, n_ticks = of_texts("track", texts), np.random.default_rng(1), 600
    assert isinstance(spec, TrackTachometer)
    form = spec.form
    assert isinstance(form, SampledTracking)
    machine, state = Interpreter(spec.program), SampledRecursion(form, spec.program.ahead)
    speed = np.repeat(rng.choice([0, 3.7, -200, 41], n_ticks // 100), 100)
    place = np.floor(np.cumsum(speed) + rng.normal(0, 0.3, n_ticks)).astype(np.int64)
    place += (rng.random(n_ticks) < 0.05) << rng.integers(2, 12, n_ticks)
    held = silent = 0
    for nth, has in enumerate((rng.random(n_ticks) > 0.05).tolist()):
        silent = 0 if has else silent + 1
        moved, held = (int(place[nth]) - held, int(place[nth])) if has else (0, held)
        kind, fine = form.phase(held)
        row = (int(has), int(rng.integers(4000)), fine, 0, moved, kind, 0, silent, form.tick_cycles)
        assert machine.tick(*row) == state.tick(*row), f"tick {nth}"
    assert all(machine.met[machine.program.code.labels[label]] > 9 for label in ("later", "alone", "silent"))


def test_a_speed_that_changes_gently_leaves_32_reads() -> None:
    spec = of_texts("track", {"sensor": "sampled", "bits": "12"})
    assert isinstance(spec, TrackTachometer)
    form = spec.form
    assert isinstance(form, SampledTracking)
    machine, state, memory = Interpreter(spec.program), SampledRecursion(form, spec.program.ahead), list[float]()
    for nth in range(400):
        row = (1, 0, 0, 0, 10 + (nth > 300 and nth % 16 == 0), 0, 0, 0, form.tick_cycles)
        assert machine.tick(*row) == state.tick(*row)
        memory.append(state.memory / (form.tick_cycles << form.time_bits))
    assert max(memory) > 300
    assert min(memory[300:]) == pytest.approx(32, rel=0.01)


@pytest.mark.parametrize(
    ("word", "upset", "held"), [("noises", -1 << WIDTH - 2, "noises_first"), ("D", 1 << WIDTH - 4, "most_noise")]
)
def test_what_outlives_a_rest_is_held_if_it_was_upset(word: str, upset: int, held: str) -> None:
    """Else the noise would be learned from few events for ever, or five times it would not fit a word."""
    program, half = CORES[0].program, CORES[0].form.tick_cycles // 2
    machine = Interpreter(program)
    rows = [(1, half, 1, half, 1, nth % 4, 0, (nth + 1) % 4, 2 * half) for nth in range(4)]
    for row in rows:
        machine.words[word] = upset
        machine.tick(*row)
    assert machine.words[word] == program.form.constants[held]


@pytest.mark.parametrize("grows", [1, -1])
def test_a_memory_of_the_most_events_shrinks_or_stays(grows: int) -> None:
    form, program = CORES[0].form, CORES[0].program
    machine, state, half = Interpreter(program), Recursion(form, program.ahead), form.tick_cycles // 2
    rows = [(1, half, 1, half, 1, nth % 4, 0, (nth + 1) % 4, 2 * half) for nth in range(4)]
    assert [machine.tick(*row) for row in rows] == [state.tick(*row) for row in rows]
    state.memory = machine.words["T"] = 10_000 * form.tick_cycles << form.time_bits
    state.log_memory = machine.words["log_T"] = log2(state.memory)
    machine.words["growing"] = state.log_memory + state.log_growth
    if grows < 0:
        state.grows, machine.words["growth"] = grows, -machine.words["count"]
    for both in (machine, state):
        both.tick(*rows[0])
    assert machine.words["T"] == state.memory


@pytest.mark.parametrize("multiplier", ["serial", "block"])
@pytest.mark.parametrize("number", [1, 2])
def test_a_memory_of_a_clock_does_not_shrink(number: int, multiplier: str) -> None:
    """Half of it is rounded up, so it would be negative after some events, and grow to that side."""
    program, tick = replace(CORES[2], multiplier=multiplier).program, CORES[2].form.tick_cycles
    machine, state = Interpreter(program), Recursion(program.form, program.ahead)
    row = (number, number * tick // 2, number**2, tick // 4, number, 0, 0, 0, tick)
    for _ in range(40):
        assert machine.tick(*row) == state.tick(*row)
        assert machine.words["T"] == state.memory
        state.grows, state.log_growth = -1, program.constants["log_half"]
        machine.words["growth"] = -program.constants["count"]
        machine.words["growing"] = state.log_memory + state.log_growth
    assert state.memory == program.constants["clock"]


@pytest.mark.parametrize(
    ("lines", "word"),
    [
        ("a + b; if neg goto there; c; end; there:; d; end", "c"),
        ("a + b; if neg goto there; - c; end; there:; d; end", "c"),
        ("a + b; if neg goto there; c; end; there:; - d; end", ""),  # there the sum is still needed
        ("a + b; if neg goto there; c keep; end; there:; zero s+ d; end", ""),  # and the sign
        ("a + b; if neg goto there; c = d; end; there:; d; end", ""),  # a jump does not store
        ("a + b; if neg goto there; c log; end; there:; d; end", ""),
        ("c = a + b; if neg goto there; c; end; there:; d; end", ""),  # it is not there yet
        ("a + b; goto there; there:; c; end", "c"),
        ("if neg goto there; back:; c; goto back; there:; d; goto back", ""),  # it is gone to as well
    ],
)
def test_a_jump_adds_the_term_behind_it(lines: str, word: str) -> None:
    code = assembled(lines).instructions
    assert next(one.word for one in code if one.jump not in (Jump.NEVER, Jump.END)) == word


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("a + b; if neg goto there; c = d; there:; e", "c"),
        ("a + b; if pos goto there; c = ~ keep; e = d + a; there:; b", "ce"),
        ("a + b; if neg goto there; c = d; there:; one + two; if neg goto last; e; last:; end", "c"),
        ("a + b; if neg goto there; c = d; there:; if one goto back; d; back:; e; end", "c"),
        ("if one goto there; a + b; if neg goto there; c = d; end; there:; end", "c"),  # both ways end
        ("if one goto there; a + b; if neg goto there; c = d; end; there:; a; end", ""),
        ("a + b; if neg goto there; c = d; there:; sum + e; end", ""),  # there the sum is still needed
        ("a + b; if neg goto there; c = d; there:; if neg goto last; e; last:; end", ""),
        ("a + b; if neg goto there; c = d; there:; if one goto back; sum + d; back:; e; end", ""),
        (
            "if one goto back; a + b; if neg goto there; c = d; back:; e = f; there:; d; end",
            "",
        ),  # it is gone to as well
        ("a + b; if neg goto there; c = d + e + f; there:; end", ""),  # of two instructions
        ("a + b; if neg goto there; c = d log; there:; end", ""),
        ("a + b; if one goto there; c = d; there:; end", ""),  # no sum decides
        ("a + b; if neg goto there; c = d; e = f; g = h; i = j; k = l; there:; end", ""),  # a jump is quicker
    ],
)
def test_a_sum_is_stored_on_the_condition_that_passed_over_it(lines: str, words: str) -> None:
    code = assembled(lines, ports=2).instructions
    assert "".join(one.store for one in code if one.jump and one.store) == words
    assert {one.jump for one in code if one.jump and one.store} <= {Jump.POS if "neg" in lines else Jump.NEG}


@pytest.mark.parametrize(
    ("line", "terms"),
    [
        ("a + b - c", [("a", "b"), ("", "c")]),
        ("~ + b", [("b", "~")]),
        ("zero - a + b", [("b", "a")]),
        ("$a s- ~", [("$a", "~")]),
        ("a keep s+ b", [("", "a"), ("", "b")]),
        ("a log + b", [("", "a"), ("", "b")]),
        ("a - o@up", [("a", "o@up")]),
        ("o@up - a", [("", "o@up"), ("", "a")]),  # what the tick chooses has one port
        ("a min b", [("a", "b"), ("", "b")]),
        ("a hi+ b", [("", "a"), ("", "b")]),
    ],
)
def test_two_terms_are_added_at_once(line: str, terms: list[tuple[str, str]]) -> None:
    made = assembled(f"{line}\nend", ports=2).instructions
    assert [(one.first, one.word) for one in made if one.jump != Jump.END] == terms


@pytest.mark.parametrize(
    ("listing", "idle"),
    [
        ("a by; b product time", 1),  # the factor is not there yet
        ("a by; b over by", 1),
        ("a by; b over 1", 0),
        ("a product time; b by", 0),
        ("a product time; b; c by", 0),
        ("a product time; b; c; d by", 1),  # both would shift at once
        ("a exp; b; c by", 1),
        ("a exp; b; c; d by", 0),
        ("a product time; goto there; back:; b; end; there:; c by; goto back", 1),  # two clocks behind the jump
        ("a product time; b; goto there; back:; c; end; there:; d by; goto back", 0),
        ("a = b; c = d - a", 2),  # it is not written yet
        ("a = b; c = d + a", 0),  # but is the sum
        ("a = b; c = a + d", 0),
        ("a = b; c; d; e = a + c", 0),
    ],
)
def test_what_comes_too_early_waits(listing: str, idle: int) -> None:
    made = assembled(listing, ports=2).instructions
    assert made.count(Instruction()) == idle


def test_an_edge_that_a_sign_chooses_waits_for_the_sign() -> None:
    assert assembled("a keep; b; c = $places").instructions.count(Instruction()) == 1
