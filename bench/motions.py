"""Situations in which methods are compared: a motion, an encoder, and from when on errors count."""

from collections.abc import Mapping
from dataclasses import dataclass

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.spec.language.option import read_options
from tachometry.spec.language.units import parse_time

# Faults of encoders, by the options of the command line.
IDEAL: Mapping[str, str] = {}
JITTER = {"jitter": "0.05"}
REAL = {"jitter": "0.05", "nonuniformity": "0.1", "phase-error": "10"}
BAD = {"jitter": "0.1", "nonuniformity": "0.2", "phase-error": "20"}


@dataclass(frozen=True)
class Situation:
    """Describes a row of the table of all situations."""

    name: str
    motion: str
    start: str  # errors before this time are left out
    faults: Mapping[str, str]  # of the encoder, by the options of the command line
    lines: int = 500  # of the encoder; every edge counts

    @property
    def start_s(self) -> float:
        """Errors before this time, in seconds, are left out."""
        return float(parse_time("start", self.start))

    @property
    def random(self) -> bool:
        """Whether seeds make a difference."""
        return bool({"jitter", "nonuniformity"} & self.faults.keys())

    @property
    def counts_per_rev(self) -> int:
        """Every edge counts."""
        return 4 * self.lines

    @property
    def options(self) -> str:
        """The options of `tachometry compare`, without a seed and the core."""
        faults = "".join(f" --{name} {text}" for name, text in self.faults.items())
        lines = "" if self.lines == 500 else f"--ppr {self.lines} "
        return f'{lines}--motion "{self.motion}" --from {self.start}{faults}'

    def record(self, seed: int) -> Encoding:
        """Return what the encoder records, with a seed for all that is random."""
        values = read_options(EncoderOptions, {**self.faults, "seed": str(seed)})
        encoder = VirtualEncoder(self.lines, **values)
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

_ILLEGAL, _LOST = {**REAL, "illegal": "0.001"}, {**REAL, "lost": "0.002"}  # a line of 500, at random
_STEPS = "+".join(f"constant:{speed}rad/s:50ms" for speed in (10, 50, 20, 80, 5, 30))
_CHIRP = "+".join(f"sine:50rad/s:{1 << n}Hz:{1000 >> n}ms" for n in range(1, 7))
_BACKLASH = "3*(constant:8rad/s:80ms+ramp:8rad/s:0:10ms+stop:3ms+constant:-6rad/s:80ms+ramp:-6rad/s:8rad/s:20ms)"
_JOGS = "2*(stop:30ms+s-curve:0:30rad/s:25ms+s-curve:30rad/s:0:25ms+stop:40ms+s-curve:0:-18rad/s:20ms"
_IMPACT = "constant:60rad/s:200ms+ramp:60rad/s:-30rad/s:300us+s-curve:-30rad/s:60rad/s:40ms+constant:60rad/s:100ms"

OTHERS = (
    Situation("S-curve through 0", "2*(s-curve:20rad/s:-80rad/s:60ms+s-curve:-80rad/s:20rad/s:90ms)", "20ms", REAL),
    Situation("spindle orients", "constant:300rad/s:80ms+s-curve:300rad/s:0:120ms+stop:60ms", "20ms", REAL),
    Situation("triangle", "10*(ramp:-20rad/s:20rad/s:20ms+ramp:20rad/s:-20rad/s:20ms)", "50ms", REAL),
    Situation("chirp", _CHIRP, "100ms", REAL),
    Situation("speed steps", _STEPS, "10ms", REAL),
    Situation(
        "load step",
        "constant:100rad/s:150ms+ramp:100rad/s:76rad/s:9ms+s-curve:76rad/s:100rad/s:70ms+constant:100rad/s:150ms",
        "50ms",
        REAL,
    ),
    Situation("impact", _IMPACT, "50ms", REAL),
    Situation("stick-slip", "15*(stop:28ms+s-curve:0:20rad/s:6ms+s-curve:20rad/s:0:6ms)", "50ms", REAL),
    Situation("backlash", _BACKLASH, "50ms", REAL),
    Situation("jogs", _JOGS + "+s-curve:-18rad/s:0:20ms)", "20ms", REAL),
    Situation("coast to rest", "constant:30rad/s:100ms+ramp:30rad/s:0:300ms+stop:100ms", "50ms", REAL),
    Situation("cogging", "constant:3rad/s:1s", "100ms", {**REAL, "vibration": "40mrad:6Hz"}),
    Situation("ripple of 0.3 %", "constant:150rad/s:400ms", "100ms", {**REAL, "vibration": "0.5mrad:150Hz"}),
    Situation("eccentric disc", "constant:50rad/s:600ms", "100ms", {**REAL, "eccentricity": "0.25"}),
    Situation("lost pulses", "constant:100rad/s:400ms", "100ms", _LOST),
    Situation("lost pulses, ramp", _RAMP, "40ms", _LOST),
    Situation("illegal transitions", "constant:50rad/s:400ms", "100ms", _ILLEGAL),
    Situation("bounce", "constant:5rad/s:800ms", "200ms", {**REAL, "bounce": "2:100us"}),
    Situation("coarse disc, ramp", "ramp:0:100rad/s:400ms", "40ms", REAL, 64),
    Situation("coarse disc, reversals", "sine:50rad/s:5Hz:400ms", "100ms", REAL, 64),
    Situation("coarse disc, slow", "constant:1.3rad/s:2s", "1s", REAL, 16),
    Situation("fine disc, very slow", "constant:0.5rad/s:1s", "300ms", REAL, 5000),
    Situation("fine disc, fast", "ramp:0:314rad/s:50ms+constant:314rad/s:50ms", "60ms", REAL, 10_000),
)
"""Motions and encoders that nothing was tuned with."""
