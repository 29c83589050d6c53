"""The method of Rairán 2013: counts and sampling periods, both begun by a count."""

from dataclasses import dataclass

from tachometry.spec.option import option
from tachometry.spec.tachometer import Port, TachometerSpec

# The estimates are looked up by Ndt1, or by Nep1 − 1, in a table with as many entries at most.
MAX_TABLE = 2048
ESTIMATES = ("n1", "n2", "n3")


@dataclass(frozen=True, kw_only=True)
class RairanTachometer(TachometerSpec):
    """Tachometer of Rairán 2013: sampling periods dt that a count begins, one clock being his ts.

    A window begins with a count. It lasts dt, which has Nep1 counts (high speeds, n1 = Nep1), or until the next count,
    Ndt1 whole dt later (low speeds, n1 = 1/Ndt1). Velocity is n1, n2 or n3 in counts per tick, dt being the tick,
    correctly rounded. What it does at reversals and at rest is in docs/rairan.md.

    Parameters
    ----------
    estimate : str
        `n1`, the upper end of what the speed can be; `n2`, the lower; `n3`, eq. (11), their harmonic mean.
    paper_exact : bool
        Table 1 to the letter and nothing else: no direction, no standstill.
    bound_decay : bool
        Without a count the estimate falls with the time since the last one.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    estimate: str = option(
        "n3", "n1, the upper bound, n2, the lower, or n3, their harmonic mean, eq. (11).", choices=ESTIMATES
    )
    paper_exact: bool = option(False, "The published algorithm and nothing else: no direction, no standstill.")
    bound_decay: bool = option(True, "Let the velocity fall with the time since the last count.")

    method = "rairan"
    module = "rairan"
    own_ticks = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.estimate not in ESTIMATES:
            raise ValueError(f"estimate must be one of {', '.join(ESTIMATES)}, not {self.estimate!r}")
        if self.bounds and self.paper_exact:
            raise ValueError("bounds must not be given with paper_exact, which leaves its own")
        if self.timing.max_ticks >= MAX_TABLE:
            raise ValueError(
                f"max_ticks must be from 2 to {MAX_TABLE - 1} with method {self.method}, not {self.timing.max_ticks}"
            )
        if (self.estimate == "n3" or self.bounds) and self.max_count > MAX_TABLE:
            why = "estimate n3" if self.estimate == "n3" else "bounds"
            raise ValueError(f"max_speed must be at most {MAX_TABLE} counts per tick with {why}, not {self.max_count}")

    @property
    def depth(self) -> int:
        """Entries of the table, a power of two: by Ndt1 and, for n3, by Nep1 − 1."""
        return 1 << max(self.timing.max_ticks, self.max_count - 1 if self.estimate == "n3" else 0).bit_length()

    @property
    def table(self) -> tuple[int, ...]:
        """Contents by address i; 0 at address 0 stands for the velocity 0.

        n1, n2: ⌊2^f/d + ½⌋ with d = i and i + 1. n3: ⌊2^(f+2)/q⌋ with q = 2i + 1. q is odd, so no multiple of ½ is
        among what is rounded, and with h the entry ⌊2^f·2/q + ½⌋ is ⌊(h + 1)/2⌋ (low) and ⌊2^f/(2q) + ½⌋ is
        ⌊(h + 4)/8⌋ (high).
        """
        f = self.native_frac_bits
        if self.estimate == "n3":
            return (0, *((1 << (f + 2)) // (2 * i + 1) for i in range(1, self.depth)))
        more = self.estimate == "n2"
        return (0, *(((1 << (f + 1)) // (i + more) + 1) // 2 for i in range(1, self.depth)))

    @property
    def table_width(self) -> int:
        """Bits of an entry."""
        return max(self.table).bit_length()

    def _bound(self, d: int, more: int, towards: int) -> int:
        """`d` counts in dt, or one in −d of them, that may be `more` clocks longer; rounded outward, and clipped."""
        dt = self.timing.tick_cycles
        up, down = (d * dt, dt + more) if d >= 0 else (dt, -d * dt + more)
        if down <= 0:
            return self.bound_limit
        raw = (up << self.native_frac_bits) // down if towards < 0 else -((-up << self.native_frac_bits) // down)
        return min(raw, self.bound_limit)

    @property
    def lower_table(self) -> tuple[int, ...]:
        """Lower bounds by twice the address of the estimate, and one more if it is high; 0 for low 0.

        n2 of a dt, or of Ndt1 + 1 of them, that took a clock longer.
        """
        rows = [(self._bound(-i - 1, 1, -1) if i else 0, self._bound(i, 1, -1)) for i in range(self.bound_depth)]
        return tuple(entry for row in rows for entry in row)

    @property
    def upper_table(self) -> tuple[int, ...]:
        """Upper bounds likewise; none for low 0. n1 of a dt, or of Ndt1 of them, that took a clock less."""
        none = self.bound_limit
        rows = [(self._bound(-i, -1, 1) if i else none, self._bound(i + 1, -1, 1)) for i in range(self.bound_depth)]
        return tuple(entry for row in rows for entry in row)

    @property
    def bound_depth(self) -> int:
        """Entries of each bound's table for low speeds, and for high ones: by Ndt1 and by Nep1 − 1."""
        return 1 << max(self.timing.max_ticks, self.max_count - 1).bit_length()

    @property
    def tie(self) -> int | None:
        """The Ndt1 for which n1 or n2 is just half an LSB, if there can be one: it is rounded up, to 1 or to −0."""
        ndt1 = (2 << self.native_frac_bits) - (self.estimate == "n2")
        return ndt1 if self.estimate != "n3" and ndt1 <= self.timing.max_ticks else None

    @property
    def memory(self) -> tuple[str, int, int]:
        """What holds the reciprocal: what it is, entries, bits of an entry."""
        return "table", self.depth, self.table_width

    @property
    def method_ports(self) -> tuple[Port, ...]:
        return (
            Port("n_ep1", "output", self.max_count.bit_length()),
            Port("n_dt1", "output", self.interval_width),
        )

    @property
    def update_spacing(self) -> int:
        """Fewest clocks between two updates: a count may come at any time."""
        return 1

    def has_room(self, clocks: int) -> bool:
        return clocks <= self.update_spacing

    @property
    def serial(self) -> bool:
        return False

    @property
    def datapath_latency(self) -> int:
        # From the end of dt or a count: a clock for the decision, one for the address, one for the table, one for the
        # sum; `tick` takes two as well.
        return 4 - self.tick_latency
