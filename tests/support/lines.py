"""The lines of virtual encoders are decoded here without the models under test."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.signals.recording import Recording

PPR = 1000
PITCH = 2 * math.pi / (4 * PPR)

FORWARD = [(0, 0), (1, 0), (1, 1), (0, 1)]


GOLDEN = {
    "motion": "ramp:0:400rad/s:50ms+sine:100rad/s:35Hz:100ms+stop:20ms+constant:-300rpm:80ms",
    "vibration": Vibration(1e-3, 487.0),
    "nonuniformity": 0.2,
    "jitter": 0.07,
    "illegal": 0.01,
    "start_angle_rad": 0.4,
    "seed": 2007,
}


def record(motion: str, **parameters: object) -> Encoding:
    return VirtualEncoder(**{"pulses_per_rev": PPR, **parameters}).record(parse_motion(motion))  # type: ignore[arg-type]


def decode(recording: Recording, decoding: int) -> tuple[list[int], int]:
    """Return position after each row, and the number of illegal transitions."""
    position, illegal = [0], 0
    rows = levels(recording)
    for before, now in pairwise(rows):
        step = {1: 1, 3: -1}.get((FORWARD.index(now) - FORWARD.index(before)) % 4, 0)
        illegal += now != before and step == 0
        a_changes = before[0] != now[0]
        if (decoding == 2 and not a_changes) or (decoding == 1 and not (a_changes and now[1] == 0)):
            step = 0
        position.append(position[-1] + step)
    return position, illegal


def decoded_at(encoding: Encoding, t: NDArray[np.float64], decoding: int) -> NDArray[np.int64]:
    position = np.array(decode(encoding.recording, decoding)[0])
    return position[np.searchsorted(encoding.recording.time, t, side="right") - 1]


def levels(recording: Recording) -> list[tuple[int, int]]:
    return list(zip(recording.a.tolist(), recording.b.tolist(), strict=True))
