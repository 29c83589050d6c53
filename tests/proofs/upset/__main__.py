"""Single flip-flop upsets of every method, and how long they are seen: `make upset`.

Names of methods as arguments choose those, `axes` a core of many, `angle` that of a motor, and `loop` those with a
control loop; `--upsets N` says how many of each; of `track` and `angle` a fortieth, as each of them plays long.
"""

import sys
import time
from collections.abc import Callable, Sequence
from functools import partial

from proofs.upset import angle, axes, loops, tracking
from proofs.upset.campaign import MAPPED, OUTPUTS, UPSET, Campaign, by_register, upsets
from rich.console import Console
from rich.progress import track
from support.report import Table, arguments, chosen


def _fortieth(name: str, n: int) -> Campaign:
    return tracking.upsets(name, max(n // 40, 1))


SUBJECTS: dict[str, Callable[[int], Campaign]] = {
    **{name: partial(upsets, name) for name in (*UPSET, OUTPUTS, *MAPPED)},
    **{name: partial(_fortieth, name) for name in tracking.TRACK},
    "axes": axes.upsets,
    "angle": lambda n: angle.upsets(max(n // 40, 1)),
    **{name: partial(loops.upsets, name) for name in loops.LOOPS},
}
GROUPS = (*UPSET, "track", "axes", "angle", "loop")


def _ticks(campaign: Campaign, clocks: int) -> str:
    return f"{clocks / campaign.spec.timing.tick_cycles:.1f}"


def _table(done: Sequence[tuple[Campaign, float]]) -> Table:
    """Print the table of campaigns and the seconds that they took."""
    heads = ("core", "flip-flops", "upsets", "never seen", "mean", "99 %", "worst", "bound", "seconds", "verdict")
    table = Table(*heads)
    for campaign, seconds in done:
        seen = sorted(campaign.clocks[campaign.clocks > 0].tolist()) or [0]
        bits = f"{campaign.bits.n_flip_flops}"
        memory = len(campaign.bits) - campaign.bits.n_flip_flops
        table.add(
            campaign.name,
            f"{bits} and {memory} of memory" if memory else bits,
            len(campaign.clocks),
            int((campaign.clocks == 0).sum()),
            _ticks(campaign, round(sum(seen) / len(seen))),
            _ticks(campaign, seen[len(seen) * 99 // 100]),
            _ticks(campaign, seen[-1]),
            _ticks(campaign, int(campaign.allowed.max())),
            f"{seconds:.0f}",
            "within it" if campaign.fine else "exceeded",
        )
    return table


def main(words: Sequence[str] | None = None) -> int:
    """Print the table; 1 if an upset was seen for longer than the bound."""
    parser = arguments(__doc__ or "", "METHOD")
    parser.add_argument("--upsets", type=int, default=12_000, metavar="N", help="of each method (%(default)s)")
    options = parser.parse_args(words)
    if options.upsets < 1:
        parser.error(f"--upsets must be at least 1, not {options.upsets}")
    console, done = Console(stderr=True), []
    groups = chosen("method", options.names, GROUPS)
    subjects = [name for name in SUBJECTS if name.split(",")[0] in groups]
    for name in track(subjects, "upsets", console=console, transient=True, disable=not console.is_terminal):
        start = time.monotonic()
        done.append((SUBJECTS[name](options.upsets), time.monotonic() - start))
    _table(done).write(options.output)
    print("\nmean, 99 %, worst: ticks until the outputs were right again, of those that were seen")
    for campaign, _ in done:
        worst = [f"{name} {_ticks(campaign, clocks)}" for name, clocks in list(by_register(campaign))[:5]]
        print(f"{campaign.name}: seen longest in {', '.join(worst)}")
    return int(not all(campaign.fine for campaign, _ in done))


if __name__ == "__main__":
    sys.exit(main())
