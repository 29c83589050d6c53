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
from tachometry.spec.core.reads import ERROR_BIT, NO_ANSWER, WRONG_CHECK, Reads
from tachometry.spec.language.units import plural

_HALF = 64  # clocks of the golden master in half a period of the encoder's clock
_REASONS = {NO_ANSWER: "no answer", WRONG_CHECK: "a wrong check", ERROR_BIT: "an error bit"}
Floats = NDArray[np.float64]


def of_frames(recording: Recording, spec: TachometerSpec) -> Recording:
    """Return what a core reads of a shaft that is where the frames of a capture have it, and turns evenly in between.

    Line A of the recording is the encoder's clock, at whatever frequency, and line B its answer. It raises OptionError
    for other sensors than ssi and biss, and CaptureError if there are not two right frames.
    """
    reads, sampled, source = spec.reads, spec.encoder.sampled, recording.source
    if reads is None or sampled is None or spec.encoder.sensor not in ("ssi", "biss"):
        raise OptionError("sensor", f"must be ssi or biss for a capture of its lines, not {spec.encoder.sensor}")
    fall = recording.time[1:][(recording.a[1:] == 0) & (recording.a[:-1] == 1)]
    if len(fall) < 3:
        raise CaptureError("a capture must have frames: line A must be the encoder's clock, which falls in each bit")
    time, found = _frames(recording, fall, reads)
    good = found.reason == 0
    wrong = ", ".join(f"{_REASONS[why]} {n}" for why, n in Counter(found.reason[~good].tolist()).items())
    if np.count_nonzero(good) < 2:
        why = wrong or "there is one"
        raise CaptureError(f"a capture must have two right frames, with --bits and --crc as they are: {why}")
    turns = (np.cumsum(ways(found.sample[good], reads.width)) + 0.5) / (1 << sampled.bits) / float(spec.encoder.turns)
    motion = Motion.of_table(time[good] - time[good][0], (-1 if spec.encoder.reverse else 1) * 2 * np.pi * turns)
    notes = [f"{plural(len(good), 'frame')}; between two the shaft is taken to turn evenly"]
    notes += [f"{plural(len(good) - int(good.sum()), 'frame')} not taken: {wrong}"] if wrong else []
    lines = {} if source is None else dict(zip(("encoder_clock", "encoder_data"), source.lines.values(), strict=False))
    read = Source(lines, recording.duration, len(recording.time) - 1, notes=tuple(notes))
    return replace(encoder_of(spec).record(motion).recording, source=read)


def _frames(recording: Recording, fall: Floats, reads: Reads) -> tuple[Floats, Records]:
    """Return when the encoder took its positions, and what the golden master reads in a time of equal periods."""
    period = float(np.median(np.diff(fall)))
    first = np.flatnonzero(np.append(True, np.diff(fall) > 2 * period))
    last = np.append(first[1:], len(fall)) - 1
    frame = np.repeat(np.arange(len(first)), last - first + 1)
    bit = np.arange(len(fall)) - first[frame]
    waits = 2 * _HALF * (int(bit.max()) + 2)
    own = replace(reads, clock_hz=2 * _HALF * reads.encoder_hz, start_wait=waits * reads.biss)
    own = replace(own, delay=round(reads.delay / reads.clock_hz / period * 2 * _HALF))
    start = (own.longest + own.rest + waits) * np.arange(len(first))
    meant = start[frame] + 1 + 2 * _HALF * bit
    seen = np.concatenate([fall, fall[first] - period / 2, fall[last] + period])
    meant = np.concatenate([meant, meant[first] - _HALF, meant[last] + 2 * _HALF])
    at = np.interp(recording.time, np.sort(seen), np.sort(meant))
    found = records(own, start, Line(np.round(at).astype(np.int64), recording.b))
    return fall[first] + period / 2 * reads.biss, found
