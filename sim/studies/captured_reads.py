"""Captures of the lines of an absolute encoder: its frames are read, and turn the shaft of a virtual one."""

from collections import Counter
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import CaptureError, OptionError
from tachometry.sim.encoder.motion import Motion
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.golden.encoder_read import Line, Records, records
from tachometry.sim.golden.sampled import ways
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.source import Source
from tachometry.spec import TachometerSpec
from tachometry.spec.core.chips import WORD_BITS, SpiReads
from tachometry.spec.core.reads import ERROR_BIT, NO_ANSWER, WRONG_CHECK, Reads
from tachometry.spec.core.tformat import CHARACTER, TformatReads
from tachometry.spec.language.units import plural

_HALF = 64  # clocks of the golden master in half a period of the encoder's clock
_REASONS = {NO_ANSWER: "no answer", WRONG_CHECK: "a wrong check", ERROR_BIT: "an error bit"}
Floats = NDArray[np.float64]


def of_frames(recording: Recording, spec: TachometerSpec) -> Recording:
    """Return what a core reads of a shaft that is where the frames of a capture have it, and turns evenly in between.

    Line A of the recording is the encoder's clock, at whatever frequency, or the request of T-format; line B is the
    answer. It raises OptionError for the sensor sampled, and CaptureError if there are not two right frames.
    """
    reads, sampled, source = spec.reads, spec.encoder.sampled, recording.source
    if reads is None or sampled is None:
        raise OptionError("sensor", "must be ssi, biss, spi or tformat for a capture of its lines, not sampled")
    reads_at_rise = isinstance(reads, SpiReads) and not reads.facts.falling
    edge = recording.time[1:][(recording.a[1:] == reads_at_rise) & (recording.a[:-1] != reads_at_rise)]
    if len(edge) < 3:
        line = "the request" if isinstance(reads, TformatReads) else "the encoder's clock, which falls in each bit"
        raise CaptureError(f"a capture must have frames: line A must be {line}")
    time, found = (_requested if isinstance(reads, TformatReads) else _clocked)(recording, edge, reads)
    good = found.reason == 0
    wrong = ", ".join(f"{_REASONS[why]} {n}" for why, n in Counter(found.reason[~good].tolist()).items())
    if np.count_nonzero(good) < 2:
        why = wrong or "there is one"
        raise CaptureError(f"a capture must have two right frames, with --bits and --crc as they are: {why}")
    turns = (np.cumsum(ways(found.sample[good], reads.width)) + 0.5) / (1 << sampled.bits) / float(spec.encoder.turns)
    motion = Motion.of_table(time[good] - time[good][0], (-1 if spec.encoder.reverse else 1) * 2 * np.pi * turns)
    notes = [f"{plural(len(good), 'frame')}; between two the shaft is taken to turn evenly"]
    notes += [f"{plural(len(good) - int(good.sum()), 'frame')} not taken: {wrong}"] if wrong else []
    names = (reads.ports[1].name, reads.line)
    lines = {} if source is None else dict(zip(names, source.lines.values(), strict=False))
    read = Source(lines, recording.duration, len(recording.time) - 1, notes=tuple(notes))
    return replace(encoder_of(spec).record(motion).recording, source=read)


def _clocked(recording: Recording, edge: Floats, reads: Reads) -> tuple[Floats, Records]:
    """Return when the encoder took its positions, and what the golden master reads in a time of equal periods."""
    period = float(np.median(np.diff(edge)))
    pause = 4e-9 * reads.facts.setup if isinstance(reads, SpiReads) else 0  # longer than between two bytes
    first = np.flatnonzero(np.append(True, np.diff(edge) > 2 * period + pause))
    last = np.append(first[1:], len(edge)) - 1
    frame = np.repeat(np.arange(len(first)), last - first + 1)
    bit = np.arange(len(edge)) - first[frame]
    waits = 2 * _HALF * (int(bit.max()) + 2)
    own = replace(reads, clock_hz=2 * _HALF * reads.encoder_hz, start_wait=waits * reads.biss)
    own = replace(own, delay=round(reads.delay / reads.clock_hz / period * 2 * _HALF))
    start = (own.longest + own.rest + waits) * np.arange(len(first))
    offset = 1 + 2 * _HALF * bit
    if isinstance(own, SpiReads):
        offset = np.array(own.changes)[np.minimum(bit, WORD_BITS - 1)] + own.half
    meant = start[frame] + offset
    seen = np.concatenate([edge, edge[first] - period / 2, edge[last] + period])
    meant = np.concatenate([meant, meant[first] - _HALF, meant[last] + 2 * _HALF])
    at = np.interp(recording.time, np.sort(seen), np.sort(meant))
    found = records(own, start, Line(np.round(at).astype(np.int64), recording.b))
    if isinstance(own, SpiReads):
        found.reason[last - first != WORD_BITS - 1] = NO_ANSWER
    if not reads.late:
        return edge[first], found
    found.reason[0] = NO_ANSWER  # when its position was taken is not known
    return edge[np.roll(last, 1)], found


def _requested(recording: Recording, fall: Floats, reads: Reads) -> tuple[Floats, Records]:
    """Return the same of T-format, whose bits last as long as they should."""
    first = fall[np.append(True, np.diff(fall) * reads.encoder_hz > CHARACTER)]
    hz = 2 * _HALF * reads.encoder_hz
    start_wait, delay = (round(clocks * hz / reads.clock_hz) for clocks in (reads.start_wait, reads.delay))
    own = replace(reads, clock_hz=hz, start_wait=start_wait, delay=delay)
    line = Line(np.round(recording.time * hz).astype(np.int64), recording.b)
    return first, records(own, np.round(first * hz).astype(np.int64) - 1, line)
