"""The cores that `make size` measures, and the bars that they must reach."""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from amaranth.lib import wiring

from tachometry.boards.fpga import ecp5_memory
from tachometry.hdl import core_of
from tachometry.hdl.core.bus_tachometer import BusTachometer
from tachometry.hdl.core.demo import Demo
from tachometry.hdl.export import export
from tachometry.hdl.export.verilog import verilog_of
from tachometry.sim.studies.size import CORE, TARGETS
from tachometry.spec import (
    AxesSpec,
    Encoder,
    MTachometer,
    MTTachometer,
    Port,
    RairanTachometer,
    Speed,
    STachometer,
    TachometerSpec,
    Timing,
    TrackTachometer,
    TTachometer,
)
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.core.compare import Compare
from tachometry.spec.core.health import Health
from tachometry.spec.core.index import Index
from tachometry.spec.core.stream import Stream
from tachometry.spec.registers.buses import BUSES, bus_of, ports_on, registers_on
from tachometry.spec.registers.demo import DemoMap, demo_manifest, demo_ports

FINE = Compare.parse("compare", "100.5:12.5:0:10us:fine")


@dataclass(frozen=True)
class Configuration:
    """A core to be measured."""

    # name and what: its name, and what distinguishes it, for the tables
    name: str
    what: str
    spec: AnySpec
    # limits by target and figure: Fmax must reach its bar, everything else must not exceed it
    bars: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_option: bool = True  # whether the difference from the first configuration is what one option costs
    targets: tuple[str, ...] = tuple(TARGETS)
    bus: str = "none"  # on which its registers are, or `none`
    demo: bool = False  # with emulator and telemetry
    # name of the configuration that differs only in that it has no greatest speed, if there is one
    without_max_speed: str = ""
    after: str = ""  # source of a script that changes the netlist, see `Target`

    @property
    def has_speed_bar(self) -> bool:
        """Whether its Fmax has to reach something on any target."""
        return any("Fmax" in bars for bars in self.bars.values())

    @property
    def component(self) -> wiring.Component:
        """The core, with its registers on its bus if it has one."""
        bus = bus_of(self.bus)
        if bus is None:
            return core_of(self.spec)
        if self.demo and isinstance(self.spec, TachometerSpec):
            return Demo(DemoMap(self.spec), bus)
        return BusTachometer(registers_on(self.spec, bus), bus)

    @property
    def hardware(self) -> tuple[str, tuple[Port, ...]]:
        """Verilog and ports."""
        bus = bus_of(self.bus)
        if self.demo and bus is not None and isinstance(self.spec, TachometerSpec):
            registers = DemoMap(self.spec)
            described = {"generator": "", "license": "", **demo_manifest(registers, bus, CORE)}
            return verilog_of(self.component, described), demo_ports(registers, bus)
        return export(self.spec, CORE, self.bus)[f"{CORE}.v"], ports_on(self.spec, bus)


# What methods are compared with: the defaults, and no max_speed.
COMMON: Any = {"encoder": Encoder(500, 4), "timing": Timing.parse("48MHz", "20us", "10ms")}
MAX_SPEED = Speed.parse("1000rad/s")
MAX_TICK = 1920  # 40 us
REFERENCE = STachometer(**COMMON, max_speed=MAX_SPEED, frac_bits=16)
BARS = {
    "ECP5": {"COMB": 265, "FF": 260, "DP16KD": 0, "MULT": 0, "Fmax": 190, "latency": 4},
    "HX8K": {"LC": 340, "RAM": 0, "Fmax": 130},
    "UP5K": {"Fmax": 52},
}
TABLE_BARS = {
    "ECP5": {"COMB": 235, "FF": 240, "DP16KD": 1, "MULT": 0, "Fmax": 135, "latency": 4},
    "HX8K": {"LC": 305, "RAM": 4, "Fmax": 130},
}
OUTPUT_REGISTER_BARS = {"ECP5": {"COMB": 235, "FF": 215, "DP16KD": 1, "MULT": 0, "Fmax": 200, "latency": 4}}
# The clock of the reference on the slowest FPGA, and 100 MHz on the others.
FAST = {"HX8K": {"Fmax": 100}, "UP5K": {"Fmax": 48}}
DEFAULT_BARS = {"ECP5": {"COMB": 340, "DP16KD": 0, "MULT": 0, "Fmax": 180, "latency": 8}} | FAST
M_BARS = {"ECP5": {"COMB": 300, "MULT": 0, "Fmax": 100}} | FAST
RAIRAN_BARS = {"ECP5": {"COMB": 450, "MULT": 0, "Fmax": 100}} | FAST
ADAPTIVE_BARS = {"ECP5": {"COMB": 700, "MULT": 0, "Fmax": 100}}
TIMED_BARS = {"ECP5": {"COMB": 600, "MULT": 0, "Fmax": 100}} | FAST
EVERY_CLOCK_BARS = {
    "ECP5": {"COMB": 700, "DP16KD": 8, "MULT": 4, "Fmax": 100, "latency": 12},
    "HX8K": {"Fmax": 100},
}
TRACK_BARS = {
    "ECP5": {"COMB": 820, "FF": 920, "MULT": 0, "Fmax": 90},
    "UP5K": {"Fmax": 24},
}
# The reference core, and 250 COMB and 100 FF for the bank.
BUS_BARS = {"ECP5": {"COMB": 265 + 250, "FF": 260 + 100}}
# Of 8 axes 60 COMB and 65 FF for each, of 32 axes 26 and 22.
AXES_BARS: dict[int, Mapping[str, Mapping[str, float]]] = {
    1: {},
    8: {"ECP5": {"COMB": 8 * 60, "FF": 8 * 65, "MULT": 0, "Fmax": 140}},
    32: {"ECP5": {"COMB": 32 * 26, "FF": 32 * 22, "MULT": 0, "Fmax": 140}},
}
TRACK_AXES: tuple[tuple[int, str, Mapping[str, Mapping[str, float]]], ...] = (
    (8, "100us", {"ECP5": {"COMB": 1500, "Fmax": 48}}),
    (32, "100us", {"ECP5": {"COMB": 32 * 90}}),
    (64, "200us", {"ECP5": {"COMB": 64 * 60}}),
)
LOOP_BARS = {
    "ECP5": {"COMB": 1150, "FF": 700, "DP16KD": 2, "MULT": 0, "Fmax": 100},
    "UP5K": {"Fmax": 36},
}
LOOPS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("", "reference with control loop", {}),
    ("conventional", "and a conventional observer", {"synchronised": False}),
    ("parallel", "and a parallel multiplier", {"multiplier": "parallel"}),
    ("generator", "and a command generator", {"command": "generator"}),
)
PAPER = STachometer(encoder=Encoder(500, 1), timing=Timing.parse("48MHz", "1ms", "10ms"))


def variants(
    name: str, what: str, spec: TachometerSpec, bars: Mapping[str, Mapping[str, float]]
) -> tuple[Configuration, ...]:
    """Return a method with and without a greatest speed, and with ticks from outside if it does not make its own."""
    found = [Configuration(name, what, spec, bars, is_option=False)]
    fast = replace(spec, max_speed=MAX_SPEED)
    found.append(
        Configuration(f"{name}-max-speed", f"{what}, 1000 rad/s", fast, bars, is_option=False, without_max_speed=name)
    )
    if not spec.facts.own_ticks:
        inside = (found[0].name, what, spec), (found[1].name, found[1].what, fast)
        for inner, about, each in inside:
            without = f"{name}-external-tick" if each.max_speed else ""
            made = replace(each, external_tick=True, max_tick_cycles=MAX_TICK)
            found.append(
                Configuration(
                    f"{inner}-external-tick",
                    f"{about}, external tick",
                    made,
                    FAST,
                    is_option=False,
                    without_max_speed=without,
                )
            )
    return tuple(found)


# The first is what the others are compared with.
CONFIGURATIONS = (
    Configuration(
        "reference",
        "48 MHz, 20 us, 10 ms, 500 PPR x4, 1000 rad/s, 16 fraction bits",
        REFERENCE,
        BARS,
        False,
        without_max_speed="default",
    ),
    Configuration("table", "reciprocal from a table", replace(REFERENCE, reciprocal_source="table"), TABLE_BARS),
    Configuration(
        "table-output-register",
        "and the block RAM's output register, as `build` uses it",
        replace(REFERENCE, reciprocal_source="table"),
        OUTPUT_REGISTER_BARS,
        is_option=False,
        targets=("ECP5",),
        after=inspect.getsource(ecp5_memory),
    ),
    Configuration("default", "no max_speed", replace(REFERENCE, max_speed=None), DEFAULT_BARS),
    Configuration("no-cancel", "eq. (17) instead of eq. (21)", replace(REFERENCE, cancel=False)),
    Configuration("frac-bits-8", "8 fraction bits", replace(REFERENCE, frac_bits=8)),
    Configuration("frac-bits-24", "24 fraction bits", replace(REFERENCE, frac_bits=24)),
    Configuration("x1", "x1 decoding", replace(REFERENCE, encoder=Encoder(500, 1))),
    Configuration("position-16", "16-bit position", replace(REFERENCE, position_width=16)),
    Configuration("filter-4", "glitch filter, 4 clocks", replace(REFERENCE, filter_clocks=4)),
    Configuration("index", "index captures the position", replace(REFERENCE, index=Index())),
    Configuration("index-reset", "and resets it", replace(REFERENCE, index=Index(reset=True))),
    Configuration("index-once", "and is taken once", replace(REFERENCE, index=Index(once=True))),
    Configuration("preset", "position is set by an input", replace(REFERENCE, preset=0)),
    Configuration("probe", "a probe latches position and time", replace(REFERENCE, probe="rising")),
    Configuration("compare", "pulses at positions", replace(REFERENCE, compare=Compare(100, 100, 50, "10us"))),
    Configuration("compare-both", "both ways", replace(REFERENCE, compare=Compare(100, 100, 50, "10us", "both"))),
    Configuration("compare-list", "of a list of 64", replace(REFERENCE, compare=Compare(0, 0, 0, "10us", "both", 64))),
    Configuration("stream", "AXI4-Stream of records", replace(REFERENCE, stream=Stream())),
    Configuration("over-speed", "trips at 900 rad/s", replace(REFERENCE, over_speed=Speed.parse("900rad/s"))),
    Configuration("health", "faults of lines and index", replace(REFERENCE, index=Index(), health=Health())),
    Configuration(
        "complements",
        "and open circuits of three pairs",
        replace(REFERENCE, index=Index(), health=Health(complements=48)),
    ),
    Configuration("position-modulo", "position within a revolution", replace(REFERENCE, position_modulo="rev")),
    Configuration(
        "external-tick",
        "external tick, up to 40 us",
        replace(REFERENCE, external_tick=True, max_tick_cycles=MAX_TICK),
        FAST,
        without_max_speed="default-external-tick",
    ),
    Configuration(
        "default-external-tick",
        "external tick, no max_speed",
        replace(REFERENCE, max_speed=None, external_tick=True, max_tick_cycles=MAX_TICK),
        FAST,
    ),
    Configuration("rad-per-s", "velocity in 2^-10 rad/s", replace(REFERENCE, unit="rad/s", frac_bits=10)),
    Configuration("rpm", "velocity in 2^-6 rpm", replace(REFERENCE, unit="rpm", frac_bits=6)),
    Configuration("velocity-16", "16-bit velocity, saturating", replace(REFERENCE, max_speed=None, velocity_width=16)),
    Configuration("age", "ticks since the update", replace(REFERENCE, age=True)),
    Configuration("bounds", "bounds of the true speed", replace(REFERENCE, bounds=True)),
    Configuration("lowpass", "low-pass filter, 200 rad/s", replace(REFERENCE, lowpass=Fraction(200))),
    *(
        Configuration(
            name,
            what,
            replace(REFERENCE, encoder=Encoder(60, 1, "pulses", missing_teeth=wheel)),
            is_option=False,
            targets=("ECP5",),
        )
        for name, what, wheel in (
            ("pulses", "tooth wheel, 60 teeth", None),
            ("missing-teeth", "crank wheel, 60-2", "60-2"),
        )
    ),
    *(
        Configuration(
            f"bus-{bus.name}",
            f"registers on {bus.name}",
            REFERENCE,
            BUS_BARS if bus.name == "native" else {},
            targets=("ECP5", "HX8K"),
            bus=bus.name,
        )
        for bus in BUSES.values()
    ),
    Configuration("demo", "demo with emulator and telemetry", REFERENCE, is_option=False, bus="uart", demo=True),
    Configuration(
        "long",
        "at most 2^16 ticks (1.3 s)",
        replace(REFERENCE, timing=Timing(48_000_000, 960, 1 << 16)),
    ),
    Configuration(
        "every-clock",
        "a tick per clock, up to 2^16 ticks",
        STachometer(encoder=Encoder(500, 4), timing=Timing(48_000_000, 1, 1 << 16)),
        EVERY_CLOCK_BARS,
        False,
    ),
    Configuration(
        "every-clock-rad",
        "and velocity in 2^10 rad/s",
        STachometer(encoder=Encoder(500, 4), timing=Timing(48_000_000, 1, 1 << 16), unit="rad/s", frac_bits=-10),
        is_option=False,
    ),
    *variants("m", "M method", MTachometer(**COMMON), M_BARS),
    Configuration("m-10", "M method, mean of 10 ticks", MTachometer(**COMMON, average=10), M_BARS, is_option=False),
    *variants("rairan", "Rairán's method, n3", RairanTachometer(**COMMON), RAIRAN_BARS),
    Configuration(
        "rairan-adaptive",
        "adaptive dt, 1 %, 1000 rad/s",
        RairanTachometer(**COMMON, max_speed=MAX_SPEED, adaptive=Fraction(1, 100)),
        ADAPTIVE_BARS,
        is_option=False,
    ),
    Configuration(
        "rairan-exact",
        "Table 1 to the letter, n3",
        RairanTachometer(**COMMON, paper_exact=True),
        is_option=False,
    ),
    *variants("t", "T method", TTachometer(**COMMON), TIMED_BARS),
    *variants("mt", "M/T method", MTTachometer(**COMMON), TIMED_BARS),
    Configuration(
        "mt-whole-cycles", "M/T method, whole cycles", MTTachometer(**COMMON, whole_cycles=True), is_option=False
    ),
    Configuration(
        "track-compare-fine",
        "and pulses between counts",
        TrackTachometer(**COMMON, max_speed=MAX_SPEED, multiplier="serial", compare=FINE),
        is_option=False,
    ),
    Configuration(
        "track",
        "tracking, 1000 rad/s, serial multiplier",
        TrackTachometer(**COMMON, max_speed=MAX_SPEED, multiplier="serial"),
        TRACK_BARS,
        is_option=False,
        targets=("ECP5", "UP5K"),
        without_max_speed="track-wide",
    ),
    Configuration(
        "track-block",
        "tracking, 1000 rad/s, multiplier of the FPGA",
        TrackTachometer(**COMMON, max_speed=MAX_SPEED, multiplier="block"),
        {"ECP5": {"COMB": 1280, "FF": 900, "MULT": 2, "Fmax": 70}, "UP5K": {"Fmax": 24}},
        is_option=False,
        targets=("ECP5", "UP5K"),
    ),
    Configuration(
        "track-external-tick",
        "tracking, external tick",
        TrackTachometer(
            **COMMON, max_speed=MAX_SPEED, multiplier="serial", external_tick=True, max_tick_cycles=MAX_TICK
        ),
        is_option=False,
        targets=("ECP5",),
    ),
    Configuration(
        "track-wide", "tracking, no max_speed", TrackTachometer(**COMMON), is_option=False, targets=("ECP5",)
    ),
    Configuration("t-tick", "T method, times in ticks", TTachometer(**COMMON, timer="tick"), is_option=False),
    Configuration("mt-tick", "M/T method, times in ticks", MTTachometer(**COMMON, timer="tick"), is_option=False),
    *(
        Configuration(f"{name}-bounds", f"{what}, with bounds", method(**COMMON, bounds=True), {}, False, ("ECP5",))
        for name, what, method in (
            ("m", "M method", MTachometer),
            ("rairan", "Rairán's method", RairanTachometer),
            ("t", "T method", TTachometer),
            ("mt", "M/T method", MTTachometer),
        )
    ),
    *(
        Configuration(
            f"axes-{axes}", f"axes of the reference: {axes}", AxesSpec(tachometer=REFERENCE, axes=axes), bars, False
        )
        for axes, bars in AXES_BARS.items()
    ),
    Configuration(
        "axes-8-output-register",
        "and the block RAM's output register",
        AxesSpec(tachometer=REFERENCE, axes=8),
        AXES_BARS[8],
        is_option=False,
        targets=("ECP5",),
        after=inspect.getsource(ecp5_memory),
    ),
    *(
        Configuration(
            f"axes-track-{axes}",
            f"axes of the core track, {tick}: {axes}",
            AxesSpec(
                tachometer=TrackTachometer(
                    encoder=Encoder(500, 4), timing=Timing.parse("48MHz", tick, "10ms"), max_speed=MAX_SPEED
                ),
                axes=axes,
            ),
            bars,
            is_option=False,
            targets=("ECP5",),
        )
        for axes, tick, bars in TRACK_AXES
    ),
    *(
        Configuration(
            f"loop-{name}" if name else "loop",
            what,
            LoopSpec(tachometer=REFERENCE, **options),
            {} if {"multiplier", "command"} & {*options} else LOOP_BARS,
            is_option=False,
        )
        for name, what, options in LOOPS
    ),
    Configuration("paper", "48 MHz, 1 ms, 10 ms, 500 PPR x1, no max_speed", PAPER, is_option=False),
)
