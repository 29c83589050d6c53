"""Situations in which methods are compared: a motion, an encoder, and from when on errors count."""

from collections.abc import Mapping
from dataclasses import dataclass

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.spec.language.option import read_options
from tachometry.spec.language.units import parse_time

PULSES_PER_REV = 500
"""Of the encoder; every edge counts."""

# Faults of encoders, by the options of the command line.
IDEAL: Mapping[str, str] = {}
JITTER = {"jitter": "0.05"}
REAL = {"jitter": "0.05", "nonuniformity": "0.1", "phase-error": "10"}
BAD = {"jitter": "0.1", "nonuniformity": "0.2", "phase-error": "20"}


@dataclass(frozen=True)
class Situation:
    """Describes a row of the table of all situations.

    Parameters
    ----------
    name : str
    motion : str
    start : str
        Errors before this time are left out.
    faults : mapping of str to str
        Of the encoder, by the options of the command line.
    """

    name: str
    motion: str
    start: str
    faults: Mapping[str, str]

    @property
    def start_s(self) -> float:
        """Errors before this time, in seconds, are left out."""
        return float(parse_time("start", self.start))

    @property
    def random(self) -> bool:
        """Whether seeds make a difference."""
        return bool({"jitter", "nonuniformity"} & self.faults.keys())

    @property
    def options(self) -> str:
        """The options of `tachometry compare`, without a seed."""
        faults = "".join(f" --{name} {text}" for name, text in self.faults.items())
        return f'--motion "{self.motion}" --from {self.start}{faults}'

    def record(self, seed: int) -> Encoding:
        """Return what the encoder records, with a seed for all that is random."""
        values = read_options(EncoderOptions, {**self.faults, "seed": str(seed)})
        encoder = VirtualEncoder(PULSES_PER_REV, **values)
        return encoder.record(parse_motion(self.motion))


_RAMP = "ramp:0:100rad/s:400ms"
_VERY_SLOW = "constant:0.5rad/s:2s"
_SLOW = "constant:1.3rad/s:1s"
_FAST = "constant:217rad/s:400ms"
_UNIT = "ramp:31rad/s:32rad/s:400ms"
_VIBRATION = {"vibration": "0.2mrad:170Hz"}
_REVERSALS = "sine:50rad/s:5Hz:400ms"
_SLOW_SINE = "sine:3rad/s:2Hz:1s"
_FAST_SINE = "sine:100rad/s:50Hz:300ms"
_TRAPEZOID = "ramp:0:200rad/s:50ms+constant:200rad/s:50ms+ramp:200rad/s:0:50ms+stop:50ms"
_STOP = "constant:20rad/s:200ms+stop:100ms"

SITUATIONS = (
    Situation("ramp", _RAMP, "40ms", IDEAL),
    Situation("ramp, real", _RAMP, "40ms", REAL),
    Situation("ramp, bad", _RAMP, "40ms", BAD),
    Situation("very slow", _VERY_SLOW, "500ms", IDEAL),
    Situation("very slow, real", _VERY_SLOW, "500ms", REAL),
    Situation("slow, jitter", _SLOW, "500ms", JITTER),
    Situation("slow, real", _SLOW, "500ms", REAL),
    Situation("fast", _FAST, "100ms", IDEAL),
    Situation("fast, jitter", _FAST, "100ms", JITTER),
    Situation("fast, real", _FAST, "100ms", REAL),
    Situation("fast, bad", _FAST, "100ms", BAD),
    Situation("unit velocity, vibration", _UNIT, "100ms", {**_VIBRATION, "nonuniformity": "0.1"}),
    Situation("unit velocity, vibration, real", _UNIT, "100ms", {**_VIBRATION, **REAL}),
    Situation("reversals, jitter", _REVERSALS, "100ms", JITTER),
    Situation("reversals, real", _REVERSALS, "100ms", REAL),
    Situation("reversals, bad", _REVERSALS, "100ms", BAD),
    Situation("slow sine", _SLOW_SINE, "100ms", IDEAL),
    Situation("slow sine, real", _SLOW_SINE, "100ms", REAL),
    Situation("fast sine", _FAST_SINE, "100ms", IDEAL),
    Situation("fast sine, real", _FAST_SINE, "100ms", REAL),
    Situation("trapezoid", _TRAPEZOID, "10ms", IDEAL),
    Situation("trapezoid, real", _TRAPEZOID, "10ms", REAL),
    # A real disc has its edges elsewhere, and then the shaft does not rest on one.
    Situation("rest on an edge", "stop:1s", "100ms", {"vibration": "0.3mrad:40Hz"}),
    Situation("stop", _STOP, "100ms", IDEAL),
    Situation("stop, real", _STOP, "100ms", REAL),
)
