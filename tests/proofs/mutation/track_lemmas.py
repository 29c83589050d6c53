# amaranth: UnusedElaboratable=no
"""Lemmas about the tracking method: where its program is, in every clock of a tick.

Every path through the program takes the same number of clocks. So each instruction has its clock of the tick, and the
words that the machine holds are those of the program before `pc`. The ends of the ranges of other registers follow.
"""

from amaranth import Shape
from proofs.mutation.inductive import Known

from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.methods.track_machine import _layout, _word
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking_code import NOT_TAKEN, TAKEN, Condition, Instruction, Op
from tachometry.spec.formats.tracking_program import TABLES


def begins(code: tuple[Instruction, ...]) -> list[int]:
    """Clock in which each instruction begins, from the first one on.

    Raises
    ------
    AssertionError
        If it is not the same one on every path.
    """
    found = {0: 0}
    for place, item in enumerate(code):
        ways = {place + 1: item.steps}
        if item.op == Op.JUMP:
            ways = {item.address: TAKEN}
            if item.steps != Condition.ALWAYS:
                ways[place + 1] = NOT_TAKEN
        if item.op != Op.OUT:
            for way, clocks in ways.items():
                assert found.setdefault(way, found[place] + clocks) == found[place] + clocks
    return [found[place] for place in range(len(code))]


def _definitions(spec: TrackTachometer) -> list[str]:
    """Return the program, the clocks of its instructions, and those of them that each stage of the machine has."""
    code = spec.program.instructions
    address = max(len(code).bit_length(), (TABLES * 2 - 1).bit_length())
    layout = _layout(address)
    width, more = layout.size, Shape.cast(layout.members["more"]).width
    lines = [
        f"reg [{width - 1}:0] words [0:{(1 << address) - 1}];",
        f"reg [9:0] begins [0:{(1 << address) - 1}];",
        "initial begin",
    ]
    lines += [
        f"words[{k}] = {width}'d{_word(layout, item)}; begins[{k}] = {begin};"
        for k, (item, begin) in enumerate(zip(code, begins(code), strict=True))
    ]
    lines += [f"words[{k}] = 0; begins[{k}] = 0;" for k in range(len(code), 1 << address)]
    lines.append("end")
    for stage, back in (("fetching", 1), ("following", 2), ("now", 3)):
        lines += [f"wire [{address - 1}:0] {stage}_at = {{datapath.machine.pc}} - {address}'d{back};"]
        # In parentheses, as a name in brackets is a register of the mutant.
        lines += [f"wire [{width - 1}:0] {stage}_word = words[({stage}_at)];"]
        lines += [f"wire [9:0] {stage}_begins = begins[({stage}_at)];"]
    left = f"[{width - 1}:{width - more}]"
    lines += [f"wire [{more - 1}:0] done_steps = now_word{left} - {{datapath.machine.now}}{left};"]
    lines += ["wire signed [15:0] now_since = $signed({1'b0, now_begins}) + $signed({1'b0, done_steps}) + 2;"]
    start = spec.times.longest_tick - 2
    return [*lines, *_left(spec, start), f"wire signed [15:0] since = {start - 2} - left;"]


def _left(spec: TrackTachometer, start: int) -> list[str]:
    """Return the clocks that are left of a tick: that is what an external tick counts; else each state has its
    number.
    """
    if spec.external_tick:
        return ["wire signed [15:0] left = $signed({sampling_clock.left});"]
    states = SamplingClock(spec.timing.tick_cycles).states
    bits = max(states).bit_length()
    of_state = dict.fromkeys(range(1 << bits), start + 1)  # no state of a tick
    in_tick = states[-spec.timing.tick_cycles :]
    of_state |= dict(zip(in_tick, range(start, -2, -1), strict=True))
    return [
        f"reg signed [15:0] lefts [0:{(1 << bits) - 1}];",
        "initial begin",
        *(f"lefts[{state}] = {left};" for state, left in of_state.items()),
        "end",
        "wire signed [15:0] left = lefts[({sampling_clock.state})];",
    ]


def _lemmas(spec: TrackTachometer) -> list[str]:
    """Return those for a core."""
    width = _layout(max(len(spec.program.instructions).bit_length(), (TABLES * 2 - 1).bit_length())).size
    more = Shape.cast(_layout(1).members["more"]).width
    fetched, held, active = (f"{{datapath.machine.{name}}}" for name in ("fetched", "held", "active"))
    now = "{datapath.machine.now}"
    rest = f"[{width - more - 1}:0]"
    start = spec.times.longest_tick - 2
    length = len(spec.program.instructions)
    length_clocks = begins(spec.program.instructions)[-1]
    elapsed = "{tick_counts.elapsed}"
    found = [
        f"!{active} || {held}",
        f"!{held} || {fetched}",
        f"{fetched} || {{datapath.machine.pc}} == 0",
        f"!{fetched} || {{datapath.machine.fetch__data}} == fetching_word",
        f"!{held} || {{datapath.machine.following}} == following_word",
        f"!{active} || {now}{rest} == now_word{rest}",
        f"!{active} || {now}[{width - 1}:{width - more}] <= now_word[{width - 1}:{width - more}]",
        f"!{fetched} || {held} || fetching_at < {length}",
        f"!{held} || {active} || following_at < {length}",
        f"!{active} || now_at < {length}",
        f"!{fetched} || {held} || since == $signed({{1'b0, fetching_begins}})",
        f"!{held} || {active} || since == $signed({{1'b0, following_begins}}) + 1",
        f"!{active} || since == now_since || {{pulse_counter.complete}} && now_since == {length_clocks + 2}",
        f"left >= -1 && left <= {start}",
        f"!{{pulse_counter.complete}} || left == {start}",
        f"!{{pulse_counter.tick}} || left == {start - 1}",
        "{datapath.machine.phase} != 3",
        f"{{tick_counts.number}} <= {spec.widths.max_count} && {{tick_counts.open_number}} <= {spec.widths.max_count}",
        f"{elapsed} <= {spec.timing.max_ticks}",
        "{tick_counts.counted} == |{tick_counts.number}",
    ]
    if spec.age:
        found += ["{age.before} <= 1", f"{{age.before}} == 0 || {fetched} || {{updates__valid}}"]
    found += [
        f"!{{updates__valid}} || since == {length_clocks + 3} || {{pulse_counter.complete}} || {{pulse_counter.tick}}",
    ]
    if spec.times.min_tick_cycles and spec.external_tick:
        found.append(f"!{{enough}} || left < {start - (spec.times.min_tick_cycles - 2)}")
    return found


def known(spec: TrackTachometer) -> Known:
    """Return all of it."""
    return Known(_definitions(spec), _lemmas(spec))
