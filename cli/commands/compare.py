"""`tachometry compare`: several methods on the same edges."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.capture import CAPTURE_OPTIONS
from tachometry.cli.options.core import COMMON_CORE_OPTIONS, Make
from tachometry.cli.options.methods import named_methods
from tachometry.cli.options.motion import FORMS, OPTIONAL_MOTION_OPTIONS, Recorder, delay, read_delay, shown_in_unit_of
from tachometry.cli.options.option import FilePath, command, option, output
from tachometry.cli.reports.compare import comparison_table, cost_table, print_comparison, shown_time
from tachometry.cli.reports.terminal import progress_bar
from tachometry.hdl.export import export
from tachometry.sim.signals.files import write_csv
from tachometry.sim.signals.recording import Recording
from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES, OF_READS
from tachometry.sim.studies.comparing.comparison import Comparison, Judging, Source, comparison
from tachometry.sim.studies.size import CORE, SEEDS, TARGETS, Measurement, measure_core, versions
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras import EXTRAS
from tachometry.spec.core.sensors import READ
from tachometry.spec.language.units import parse_time

# Options of a core that change its size alone.
_NO_VELOCITY = ("preset", "index-once", "position-modulo")

_METHODS = """Methods to compare: all, or names with commas between. Methods take options, as in m:average=10 or \
hostmot2:period=500us. difference, hostmot2, simplefoc, odrive and moteus are float models of what is in use; \
least-squares, foaw, kalman, kf-cv, kf-ca and imm are float models of estimators in the literature. \
docs/measured/compare.md has their options. Of positions that are read there are alpha-beta and alpha-beta-gamma with \
index, pll with bandwidth, and savitzky-golay with reads and order in place of these."""
_TUNE = """Show the best of many settings for float models and mt. It replaces those without options by the setting \
with the least RMS error, whose name can be given to --methods. It needs --motion."""
_REPLAY = "Captured lines instead of a --motion. A session, text or waveform, as `tachometry replay` takes it."
_FROM = "Leave out errors before TIME (s, ms, us or ns). [default: until every method has a value]"
_UNTIL = """Leave out errors after TIME (s, ms, us or ns). With --from, --plot shows a part of a long capture. \
[default: the end]"""
_SIZE = "Also measure the cores on an ECP5: COMB, FF, Fmax. It takes half a minute a core, and needs the extra `size`."
_TRADEOFF = """Figure of error over delay, a curve per method. A curve has the settings of a float model, of m over \
--average, or of mt over --min-time that no other setting beats in both error and delay. The error is that of \
--motion, such as a constant speed with a real disc. The delay is measured with an ideal encoder whose speed goes to \
and fro between half the RMS speed of --motion and all of it, 10 times a second: the RMS error over the RMS \
acceleration. A .csv has the numbers of all settings. It needs --motion."""


@command(f"""{FORMS}

\b
Examples:
  tachometry compare --ppr 500 --clock 10MHz --tick 100us \\
      --motion "ramp:0:100rad/s:200ms+stop:50ms" --jitter 0.05 --plot all.png
  tachometry compare --ppr 500 --clock 10MHz --tick 100us \\
      --methods "s,s:cancel=no,m:average=10,hostmot2" \\
      --motion "sine:50rad/s:5Hz:1s" --size
  tachometry compare --ppr 500 --clock 10MHz --tick 100us --tune \\
      --motion constant:100rad/s:400ms --from 100ms \\
      --jitter 0.05 --nonuniformity 0.1 --tradeoff delays.png
  tachometry compare --ppr 500 --clock 200kHz --tick 1ms --replay ramp.sr""")
@COMMON_CORE_OPTIONS
@option("Methods", "--methods LIST", default="all", help=_METHODS)
@option("Methods", "--tune", is_flag=True, help=_TUNE)
@OPTIONAL_MOTION_OPTIONS
@option("Capture", "--replay CAPTURE", "capture", type=FilePath(), help=_REPLAY)
@CAPTURE_OPTIONS
@option("Methods", "--from TIME", "start", help=_FROM)
@option("Methods", "--until TIME", help=_UNTIL)
@read_delay("Methods")
@option("Methods", "--size", is_flag=True, help=_SIZE)
@output("--plot", suffixes=(".png", ".pdf", ".svg"), help="Figure of all velocities and errors.")
@output("--csv", help="CSV with a row per method: the table.")
@output("--tradeoff", suffixes=(".png", ".pdf", ".svg", ".csv"), help=_TRADEOFF)
def compare(
    make: Make,
    sensor: str | None,
    methods: str,
    record: Recorder | None,
    tables: list[Path],
    capture: Path | None,
    read: Callable[[Path, TachometerSpec], Recording],
    start: str | None,
    until: str | None,
    read_delay: str,
    tune: bool,
    size: bool,
    plot: Path | None,
    csv: Path | None,
    tradeoff: Path | None,
) -> int:
    """Compare methods on the same edges, of a virtual encoder or a capture.

    Cores are run by their golden models, which the hardware equals bit for bit; the others are float models, those of
    other projects with the settings that these come with unless options or --tune say otherwise. A velocity is read
    once a tick, at the clock in which the velocity of that tick is valid, or --read-delay later; float models are read
    with the first core. Its error is the difference from the shaft's speed at that instant, from when every method has
    a value; the delay is the shift of the true speed that comes closest. It is left out at constant speed, and where
    noise hides it. A capture does not contain the true speed, so there are no errors.
    """
    inputs = tables if capture is None else [capture]
    outputs = Outputs({"--plot": plot, "--csv": csv, "--tradeoff": tradeoff}, inputs=inputs)
    known, usual = (OF_READS, "track") if sensor in READ else (BASELINES, "s")
    missing = {name: one.missing for name, one in known.items() if methods.strip() == "all" and one.missing}
    named = named_methods(methods, make, [name for name in known if name not in missing])
    spec = next((spec for spec in named.specs.values() if spec is not None), None) or make(usual, {})
    for name in (
        () if size else (*_NO_VELOCITY, *(extra.name.replace("_", "-") for extra in EXTRAS if not extra.compared))
    ):
        if name in spec.options:
            raise ValueError(f"--{name} must be left out, or given together with --size: it changes no velocity")
    if record is not None:
        spec = shown_in_unit_of(record.motion, spec)
    source = _source(record, capture, read, spec)
    earliest = None if start is None else delay("start", start)
    latest = math.inf if until is None else float(parse_time("until", until))
    if latest <= (earliest or 0.0):
        raise ValueError(f"--until must be later than --from, {shown_time(earliest or 0.0)}, not {until}")
    tools = _tools() if size else {}
    if source.true_speed is None and (tune or tradeoff is not None):
        raise ValueError(f"{'--tune' if tune else '--tradeoff'} must be given together with --motion")
    with outputs:
        late = delay("read_delay", read_delay)
        judging = Judging(earliest, latest, late, tune, tradeoff is not None, progress_bar)
        result = comparison(spec, named.specs, make, source, judging)
        sizes = _sizes(result, tools) if size else {}
        _write(result, sizes, outputs)
    print_comparison(result, sizes, named.left_out | missing)
    return 0


def _source(
    record: Recorder | None,
    capture: Path | None,
    read: Callable[[Path, TachometerSpec], Recording],
    spec: TachometerSpec,
) -> Source:
    if (record is None) == (capture is None):
        raise ValueError("--motion must be given, or --replay, and not both")
    if capture is not None:
        if spec.encoder.sampled is not None:
            raise ValueError(f"--replay must be of edges, not with --sensor {spec.encoder.sensor}: give --motion")
        return Source(str(capture), read(capture, spec), None)
    assert record is not None
    truth = record(spec)
    return Source("--motion", truth.recording, truth.true_speed, truth.true_angle)


def _write(result: Comparison, sizes: Mapping[str, Measurement], outputs: Outputs) -> None:
    if path := outputs.get("--csv"):
        write_csv(path, *comparison_table(result, sizes))
    if path := outputs.get("--plot"):
        from tachometry.sim.plots.compare import save_comparison  # Matplotlib is slow to import

        save_comparison(path, result.spec, result.curves, result.scores, result.instants, result.true_speed)
    if (path := outputs.get("--tradeoff")) and path.suffix.lower() == ".csv":
        write_csv(path, *cost_table(result))
    elif path:
        from tachometry.sim.plots.tradeoff import save_tradeoff

        save_tradeoff(path, result.spec, result.costs, result.rms_speed)


def _tools() -> dict[str, str]:
    """Return versions of what measures sizes."""
    try:
        return versions()
    except RuntimeError as error:
        raise click.ClickException(f"--size needs the extra `size`: {error}") from error


def _sizes(result: Comparison, tools: dict[str, str]) -> dict[str, Measurement]:
    """Return COMB, FF and Fmax of the cores on an ECP5, by name."""
    specs = {name: spec for name, spec in result.specs.items() if spec is not None}
    sizes = {}
    with progress_bar("measuring sizes", len(specs), "cores") as report:
        for done, (name, spec) in enumerate(specs.items(), 1):
            verilog = export(spec, CORE)[f"{CORE}.v"]
            try:
                sizes[name] = measure_core(spec, TARGETS["ECP5"], verilog, tools, seeds=SEEDS[:3])
            except RuntimeError as error:
                raise click.ClickException(str(error)) from error
            report(done)
    return sizes
