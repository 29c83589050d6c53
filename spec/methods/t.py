"""The T method: the time from one count to the next (Tsuji 2009, Sec. IV-B)."""

from dataclasses import dataclass

from tachometry.spec.core.facts import Facts
from tachometry.spec.methods.timed import TimedTachometer


@dataclass(frozen=True, kw_only=True)
class TTachometer(TimedTachometer):
    """Divides one count by the time since the count before (T method, eq. (9) of Tsuji 2009).

    The velocity is in counts per tick, correctly rounded. It is 0 for two consecutive counts of opposite sign, which
    are from the same edge of the encoder.
    """

    method = "t"
    facts = Facts(
        title="T",
        summary="takes the time between two counts",
        update_by="count",
        interval="timer periods",
        rest_tenths=22,
    )
    equation = 9
    one_count = True
