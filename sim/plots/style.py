"""All figures look alike, and equal figures give equal files."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tachometry.spec import METHODS, TachometerSpec
from tachometry.spec.language.units import format_time

FloatArray = NDArray[np.float64]
TrueSpeed = Callable[[FloatArray], FloatArray]

# Nothing of the user's settings, of the day or of a version gets into a figure.
_STYLE: dict[Any, Any] = {
    "svg.hashsalt": "tachometry",  # names of what is drawn twice, else random
    "pdf.compression": 0,  # zlib promises what its output unpacks to, not which bytes it is
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "0.92",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.labelcolor": "0.15",
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 0.9,
}
_METADATA: dict[str, dict[str, None]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
# Of lines that are compared, and of what a run has.
COLOURS = ("#2a78c8", "#d9730d", "#2e6b3e", "#b3261e", "#7b3fa0", "#00838f", "#5d4037", "#c2185b", "#827717", "0.45")
ESTIMATE, ERROR, COUNT, FORCED = "#2a78c8", "#b3261e", "#2e6b3e", "#d9730d"

# Inches.
_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 10.0, 0.8, 0.6, 0.6, 0.5, 0.3

COLUMNS = 1500  # about one for each pixel across


class _Picture(Figure):
    """A figure that a notebook draws, without the state of pyplot."""

    def _repr_png_(self) -> bytes:
        return picture(lambda: self, ".png")


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the style of this project."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def save_figure(path: Path, draw: Callable[[], Figure]) -> None:
    """Write what `draw` returns, in the style of this project; equal figures give equal files."""
    path.write_bytes(picture(draw, path.suffix.lower()))


def picture(draw: Callable[[], Figure], suffix: str) -> bytes:
    """Return what `draw` returns as the bytes of a file."""
    drawn = BytesIO()  # on a full disk Matplotlib would say something else
    with styled():
        draw().savefig(drawn, format=suffix[1:], dpi=160, metadata=_METADATA[suffix])
    return drawn.getvalue()


def columns(x: FloatArray, y: NDArray[np.generic], n_columns: int = COLUMNS) -> NDArray[np.int64]:
    """Return indices of the first, least, greatest and last point in each of `n_columns` equal stretches of x, in
    order.

    A line through them covers the same pixels as one through all. `x` does not decrease.
    """
    if len(x) <= 4 * n_columns:
        return np.arange(len(x))
    column = ((x - x[0]) * (n_columns / (x[-1] - x[0]))).astype(np.int64)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    last = np.append(first[1:], len(x)) - 1
    by_value = np.lexsort((y, column))  # columns stay together: each begins and ends where it did
    return np.unique(np.concatenate([first, by_value[first], by_value[last], last]))


def place_panels(
    spec: TachometerSpec, heights: dict[str, float], what: str | None = None
) -> tuple[Figure, dict[str, Axes]]:
    """Return a figure, titled with the configuration, with one panel below the other, so many inches high.

    The title begins with `what`, or with the method. Panels are placed by hand: what
    Matplotlib's layout engine computes differs from run to run in the last bits.
    """
    names = list(heights)
    height = _TOP + _BOTTOM + sum(heights.values()) + _GAP * (len(names) - 1)
    figure = _Picture(figsize=(_WIDTH, height))
    FigureCanvasAgg(figure)
    panels: dict[str, Axes] = {}
    upper = height - _TOP
    for name in names:
        lower = upper - heights[name]
        place = (_LEFT / _WIDTH, lower / height, 1 - (_LEFT + _RIGHT) / _WIDTH, heights[name] / height)
        panels[name] = figure.add_axes(place, sharex=panels.get(names[0]))
        panels[name].tick_params(which="both", labelbottom=name == names[-1])
        panels[name].yaxis.set_label_coords(-0.065, 0.5)
        upper = lower - _GAP
    figure.suptitle(_title(spec, what), y=1 - 0.1 / height, fontsize=10)
    return figure, panels


def _title(spec: TachometerSpec, what: str | None) -> str:
    timing, unit = spec.timing, spec.scale.shown_unit
    return (
        f"{what or spec.words.heading}: "
        f"{spec.encoder.pulses_per_rev} lines ×{spec.encoder.decoding}, "
        f"tick {format_time(timing.tick_seconds)}, at most {format_time(timing.max_ticks * timing.tick_seconds)}, "
        f"clock {_frequency(timing.clock_hz)}, one count per tick = {unit.of(spec.scale.unit_velocity):.5g} {unit.name}"
    )


def in_words(name: str) -> str:
    """Return a method for a legend, `M method (average=8)` of `m:average=8`; other names stay as they are."""
    method, _, options = name.partition(":")
    if method not in METHODS:
        return name
    return f"{METHODS[method].facts.title or method.upper()} method" + (f" ({options})" if options else "")


def _frequency(hertz: int) -> str:
    size, unit = next((s, u) for s, u in ((10**6, "MHz"), (10**3, "kHz"), (1, "Hz")) if hertz >= s)
    return f"{hertz / size:.9g} {unit}"
