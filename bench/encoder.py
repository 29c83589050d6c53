"""Draws imperfections of an encoder and measures what the core makes of them, for docs/measured/encoder.md.

The lines are drawn and the golden model run at constant speed; everything is exact, so that the files are the same on
every machine.
"""

import math
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
from motions import REAL, values_of
from numpy.typing import NDArray
from pages import MEASURED, Rows, data, markdown, measure, write

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.golden.front_end import decode
from tachometry.sim.signals.run import Run
from tachometry.sim.signals.tables import HeldVelocity, held_velocity, velocity_error
from tachometry.spec import TachometerSpec, TrackTachometer, of_texts

PAGE, PICTURE = MEASURED / "encoder.md", MEASURED / "encoder.svg"

FloatArray = NDArray[np.float64]

_DATA = data("encoder")
FAST, SLOW = _DATA["fast"], _DATA["slow"]
EXAMPLES: Mapping[str, str] = _DATA["examples"]
PULSES = _DATA["pulses"]
DURATION_S, SETTLED_S = 0.5, 0.05
SHOWN = slice(600, 616)  # ticks
DISCS: Mapping[str, Mapping[str, str]] = {"ideal": {}, "real": REAL}

# The picture: periods of an encoder with two in a turn, a seed that shows one lost pulse and one illegal, and pixels.
PULSES_PER_REV, PERIODS, SEED = 2, 4, 17
LEFT, WIDTH, TOP, ROW, LANE, GAP, COUNT = 190, 560, 32, 108, 12, 5, 2
GREY, BLACK, BLUE, RED = "#bbb", "#222", "#2a78c8", "#b3261e"


def turn(counts_per_tick: float, encoder: VirtualEncoder, spec: TachometerSpec) -> tuple[Encoding, Run]:
    """Return an encoder at constant speed on a core's golden model."""
    speed = counts_per_tick / (4 * encoder.pulses_per_rev * float(spec.timing.tick_seconds))
    encoding = encoder.record(parse_motion(f"constant:{speed!r}rev/s:{DURATION_S}s"))
    return encoding, golden.run(spec, encoding.recording.place(spec.timing.clock_hz))


def velocity_errors(spec: TachometerSpec, encoding: Encoding, run: Run) -> str:
    """Return RMS and mean error of the held velocity in per cent of the speed, once the start is forgotten."""
    held = held_velocity(spec, run)
    settled = held.time >= SETTLED_S
    error = velocity_error(HeldVelocity(held.time[settled], held.velocity_rad_s[settled]), encoding.true_speed)
    assert error is not None
    percent = 100 / float(encoding.true_speed(0.0))
    return f"{error.rms * percent:.1f} % ({error.mean * percent:+.1f} %)"


def row(example: str) -> list[str]:
    """Return a row of the table."""
    words = example.replace("--", "").split()[example == "none" :]
    faults = dict(zip(words[::2], words[1::2], strict=True))
    core = {name: faults.pop(name) for name in ("decoding", "filter") if name in faults}
    spec = of_texts("s", _DATA["core"] | core)
    ppr, decoding = spec.encoder.pulses_per_rev, spec.encoder.decoding
    encoder = VirtualEncoder(ppr, start_angle_rad=math.pi / (4 * ppr), **values_of(faults, SEED))
    fast, slow = (turn(counts, encoder, spec) for counts in (FAST, SLOW))
    encoding, run = fast
    sampled = (run.ticks.clock[-1] - spec.latency.tick - spec.latency.pin_to_count) / spec.timing.clock_hz
    true = int(encoding.true_position(sampled, decoding))
    return [
        example,
        f"{run.ticks.position[-1] - true} of {true}",
        str(len(run.errors)),
        str(int(run.ticks.get("filtered_edges")[-1])),
        " ".join(map(str, run.ticks.pulse_count[SHOWN])),
        velocity_errors(spec, *fast),
        velocity_errors(spec, *slow),
    ]


def table() -> Rows:
    """Return the table of imperfections."""
    heads = ["encoder and core", "position off (counts)", "decode_error", "filtered_edges"]
    heads += [f"{what} at {FAST} counts per tick" for what in ("m_e", "velocity error, RMS (mean),")]
    return [[*heads, f"and at {SLOW}"], *map(row, EXAMPLES)]


def pulses(motion: str, disc: Mapping[str, str], fine: bool) -> str:
    """Return how far pulses of the compare output are from their places, in counts: the mean, and RMS about it."""
    spec = of_texts("track", PULSES["core"] | {"position-compare": PULSES["compare"][fine]})
    assert isinstance(spec, TrackTachometer)
    encoder = VirtualEncoder(500, start_angle_rad=math.pi / 2000, **values_of(disc, SEED))  # amid position 0
    moved = parse_motion(motion)
    found = golden.run(spec, encoder.record(moved).recording.place(spec.timing.clock_hz)).tables[
        "position_compare_valid"
    ]
    seconds = found.clock / spec.timing.clock_hz
    # A position begins at an edge, half a count before the place of its name.
    wanted = (
        found.position_compare_position / (1 << spec.position_fine_bits)
        if fine
        else found.position_compare_position - 0.5
    )
    off = (moved.angle(seconds) * 1000 / math.pi - wanted)[seconds > SETTLED_S]
    return f"{off.mean():+.3f} ± {off.std():.4f}"


def pulse_table() -> str:
    """Return the table of pulses."""
    rows = [
        [name, f"`{motion}`", *(pulses(motion, disc, fine) for fine in (False, True))]
        for (name, disc), motion in product(DISCS.items(), PULSES["motions"])
    ]
    return markdown(["disc", "motion", "on counts", "on `position_fine`"], rows)


def staircase(time: FloatArray, value: NDArray[Any], end: float, bottom: float, height: float, colour: str) -> str:
    """Return a line of SVG: each value from its time on, one unit being `height` pixels above `bottom`."""
    x, y = LEFT + np.append(time, end) / end * WIDTH, bottom - value * float(height)
    corners = zip(np.repeat(x, 2)[1:-1], np.repeat(y, 2), strict=True)
    points = " ".join(f"{px:.1f},{py:.1f}" for px, py in corners)
    return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.3"/>\n'


def text(x: float, y: float, words: str, anchor: str = "start") -> str:
    """Return a text of SVG."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{BLACK}">{words}</text>\n'


def draw(name: str, magnitude: str, top: float) -> str:
    """Return lines of an encoder over those of an ideal one, and the positions that a decoder makes of both."""
    start = math.pi / (4 * PULSES_PER_REV)
    motion = parse_motion(f"constant:1rev/s:{PERIODS / PULSES_PER_REV}s")
    svg = text(8, top + 2 * LANE, f"--{name}")
    bottoms = [top + (number + 1) * LANE + number * GAP for number in range(3)]
    floor = bottoms[-1] + GAP + 4 * PERIODS * COUNT
    for label, bottom in zip((*"ABZ", "position"), (*bottoms, floor - 2 * PERIODS * COUNT), strict=True):
        svg += text(LEFT - 8, bottom - 2, label, anchor="end")
    for colours, faults in (((GREY, GREY), {}), ((BLACK, BLUE), {name: magnitude})):
        encoder = VirtualEncoder(PULSES_PER_REV, start_angle_rad=start, index=True, **values_of(faults, SEED))
        recording = encoder.record(motion).recording
        assert recording.z is not None
        for bottom, line in zip(bottoms, (recording.a, recording.b, recording.z), strict=True):
            svg += staircase(recording.time, line, motion.duration, bottom, LANE, colours[0])
        step, illegal = decode(recording.a, recording.b, 4)
        position = np.append(0, np.cumsum(step))
        svg += staircase(recording.time, position, motion.duration, floor, COUNT, colours[1])
        for row in np.flatnonzero(illegal) + 1:
            x, y = LEFT + recording.time[row] / motion.duration * WIDTH, floor - position[row] * COUNT
            svg += f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{RED}"/>\n'
    return svg


def picture() -> str:
    """Return the picture as SVG."""
    shown = [(example.split()[0].removeprefix("--"), drawn) for example, drawn in EXAMPLES.items() if drawn]
    width, height = LEFT + WIDTH + 20, TOP + len(shown) * ROW
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="DejaVu Sans, Arial, '
    svg += f'sans-serif" font-size="11">\n<rect width="{width}" height="{height}" fill="white"/>\n'
    svg += text(LEFT, 16, "grey: ideal encoder; black: lines; blue: position that is decoded; red: decode_error")
    return svg + "".join(draw(*one, TOP + number * ROW) for number, one in enumerate(shown)) + "</svg>\n"


def imperfections() -> Rows:
    """Return the table of imperfections, and draw them."""
    write(PICTURE, picture())
    return table()


BLOCKS = {"imperfections": imperfections, "pulses": pulse_table}

if __name__ == "__main__":
    measure(PAGE, BLOCKS)
