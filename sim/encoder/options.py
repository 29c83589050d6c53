"""The options of the virtual encoder are declared once, for commands, sweeps and situations; --help needs no numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.units import DEGREES, FRACTION, TIME, number_reader, read_nearest

if TYPE_CHECKING:  # numpy is slow to import
    from tachometry.sim.encoder.imperfections import Bounce, LineFault
    from tachometry.sim.encoder.motion import Vibration


def _vibration(what: str, text: str) -> Vibration:
    from tachometry.sim.encoder.motion import Vibration

    return Vibration.parse(text)


def _bounce(what: str, text: str) -> Bounce:
    from tachometry.sim.encoder.imperfections import Bounce

    return Bounce.parse(text)


def _line_fault(what: str, text: str) -> LineFault:
    from tachometry.sim.encoder.imperfections import LineFault

    return LineFault.parse(what, text)


def _interpolation(what: str, text: str) -> tuple[float, int]:
    """Return the LSB of an interpolation error, and its periods in a turn."""
    lsb, _, periods = text.partition(":")
    if not periods.strip().isdecimal() or not 1 <= int(periods) <= 1 << 20:
        raise ParameterError(what, f"must be LSB:PERIODS, as 0.15:1024, with 1 to {1 << 20} periods, not {text!r}")
    return number_reader(FRACTION)(what, lsb), int(periods)


def _seed(what: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ParameterError(what, f"must be a whole number, not {text!r}") from None


def _time(what: str, text: str) -> float:
    return read_nearest(what, text, TIME)


def _fault(help: str, metavar: str, parse: Callable[[str, str], float], name: str = "") -> float:
    found: float = option(None, help, text="0", name=name, metavar=metavar, parse=parse)
    return found


_MOST_NOISE = 1000  # LSB

_VIBRATION = """Sinusoidal vibration of the shaft, such as 1mrad:50Hz. In rad, mrad or deg; Hz, kHz, MHz or GHz. It is \
part of the true motion."""
_BOUNCE = """Contact bounce, such as 3:500us. After an edge the line falls back COUNT times within TIME (s, ms, us or \
ns), or within half the way to the next edge."""
_BROKEN = "A broken wire, such as b:200ms: high from then on. Line a, b, z, c of halls, or a complement as a_n."
_STUCK = "A shorted wire, such as a:200ms: constant from then on. Line a, b, z, c of halls, or a complement as a_n."
_INDEX_SKEW_S = """Delay of the index after A and B, such as 3us or -3us. In s, ms, us or ns; the index is then not \
gated."""
_INTERPOLATION = "Interpolation error of reads, such as 0.15:1024. A sine of LSB with PERIODS a turn."
_JITTER = """Gaussian jitter of the edges in time, such as 0.05 or 5%. Its standard deviation over the gap to the \
nearer neighbour, below 0.5."""
_NONUNIFORMITY = "Uneven disc: edges are off by up to FRACTION of a pitch. Below 0.5, the same in every turn."
_ECCENTRICITY = "Disc off centre: edges are off by up to FRACTION of a pitch. The displacement is a sine over a turn."
_PHASE_ERROR_DEG = """Phase error of B in electrical degrees, such as 5deg. B comes so many degrees later than 90 \
after A; between -90 and 90."""
_DUTY_ERROR_DEG = """Duty error in electrical degrees, such as 5 or 5deg. Pulses of A and B are as many degrees wider \
than 180; between -90 and 90."""
_ILLEGAL = "Probability that an edge comes together with the next. Both lines change at once then."
_FRAME_ERRORS = "Probability that a read of a sampled position is wrong. Its frame shows that."


@dataclass(frozen=True, kw_only=True)
class EncoderOptions:
    """Says how a shaft vibrates beside its motion, and what is wrong with its encoder.

    Phase error, duty error, nonuniformity and eccentricity (a pitch is 90 degrees, and both edges of a state may be
    off) must add up to less than 90 electrical degrees: then no state vanishes. They are of the disc, hence part of the
    truth. Each imperfection has a stream of random numbers of its own. The help of an option says what it is; beyond:

    - `jitter`: Neighbours are edges, start and end of the recording. Shifts are clipped at 0.49 gaps: edges keep their
      order.
    - `phase_error_deg`, electrical degrees: Of the pulses' centres, forwards.
    - `duty_error_deg`, electrical degrees: The pauses are narrower by as much.
    - `bounce`: The line returns at random moments. Half the way is to the next edge of either line. Edges that come
      together do not bounce.
    - `lost`: A pulse that begins before the recording or ends after it is not missed.
    - `illegal`: An edge is not late if the one before it is, or if the next one is of the same line, as after a
      reversal.
    - `index_width`: At 1 the index is high only while the lines are in its state. A wider one is about that state: 2
      quarters go on forward, 4 begin one before it.

    It raises ValueError if a parameter is out of range.
    """

    _group = "Encoder faults"

    vibration: Vibration | None = option(  # noqa: RUF009
        None, _VIBRATION, metavar="AMPL:FREQ", group="Motion", parse=_vibration
    )
    jitter: float = _fault(_JITTER, "FRACTION", number_reader(FRACTION))
    nonuniformity: float = _fault(_NONUNIFORMITY, "FRACTION", number_reader(FRACTION))
    eccentricity: float = _fault(_ECCENTRICITY, "FRACTION", number_reader(FRACTION))
    phase_error_deg: float = _fault(_PHASE_ERROR_DEG, "DEGREES", number_reader(DEGREES, "deg"), name="phase-error")
    duty_error_deg: float = _fault(_DUTY_ERROR_DEG, "DEGREES", number_reader(DEGREES, "deg"), name="duty-error")
    bounce: Bounce | None = option(None, _BOUNCE, metavar="COUNT:TIME", parse=_bounce)  # noqa: RUF009
    lost: float = _fault(
        "Probability that a line misses a pulse, so two edges.", "PROBABILITY", number_reader(FRACTION)
    )
    illegal: float = _fault(_ILLEGAL, "PROBABILITY", number_reader(FRACTION))
    broken: LineFault | None = option(None, _BROKEN, metavar="LINE:TIME", parse=_line_fault)  # noqa: RUF009
    stuck: LineFault | None = option(None, _STUCK, metavar="LINE:TIME", parse=_line_fault)  # noqa: RUF009
    index_width: int = option(
        1, "Quarter periods of the index mark, 1 to 16. A mark wider than 1 is not gated by A and B.", metavar="N"
    )
    index_skew_s: float = option(None, _INDEX_SKEW_S, text="0s", name="index-skew", metavar="TIME", parse=_time)
    noise: float = _fault(
        "Noise of sampled positions: standard deviation in LSB. At most 1000.", "LSB", number_reader(FRACTION)
    )
    interpolation: tuple[float, int] | None = option(None, _INTERPOLATION, metavar="LSB:PERIODS", parse=_interpolation)
    frame_errors: float = _fault(_FRAME_ERRORS, "P", number_reader(FRACTION), name="frame-errors")
    seed: int = option(0, "Seed of all random numbers; equal seeds give equal files.", metavar="N", parse=_seed)

    def __post_init__(self) -> None:
        for name in ("jitter", "nonuniformity", "eccentricity"):
            value = getattr(self, name)
            if not 0 <= value < 0.5:
                raise ParameterError(name, f"must be from 0 to less than 0.5, not {value}")
        if not 0 <= self.noise <= _MOST_NOISE:
            raise ParameterError("noise", f"must be from 0 to {_MOST_NOISE}, not {self.noise}")
        for name in ("illegal", "lost", "frame_errors"):
            value = getattr(self, name)
            if not 0 <= value <= 1:
                raise ParameterError(name, f"must be from 0 to 1, not {value}")
        for name, value in (("phase_error_deg", self.phase_error_deg), ("duty_error_deg", self.duty_error_deg)):
            if not -90 < value < 90:
                raise ParameterError(name, f"must be more than -90 and less than 90, not {value}")
        uneven = self.nonuniformity + self.eccentricity
        errors = abs(self.phase_error_deg) + abs(self.duty_error_deg) + 180 * uneven
        if not errors < 90:
            raise ValueError(
                "phase error, duty error and 180 times nonuniformity and eccentricity together must be less than 90 "
                f"electrical degrees, not {errors:.6g}"
            )
        if not 1 <= self.index_width <= 16:
            raise ParameterError("index_width", f"must be from 1 to 16, not {self.index_width}")
        if self.seed < 0:
            raise ParameterError("seed", f"must be at least 0, not {self.seed}")
