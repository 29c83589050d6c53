"""Options are declared once, and every way to a core reads them alike."""

import importlib
import inspect
import pickle
import pkgutil
import re
from fractions import Fraction
from pathlib import Path

import pytest
from support.options import had_by

import tachometry.spec
from tachometry.hdl.export import export
from tachometry.sim import golden
from tachometry.sim.studies.pairs import configurations, spec_of
from tachometry.spec import (
    METHODS,
    Encoder,
    LoopSpec,
    ParameterError,
    STachometer,
    Timing,
    common_options,
    of_manifest,
    of_options,
    of_texts,
    own_options,
)
from tachometry.spec.control import AnySpec
from tachometry.spec.core.extras import EXTRAS
from tachometry.spec.core.index import Index
from tachometry.spec.language.option import options_of
from tachometry.spec.language.units import PI, Speed
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.registers.buses import BUSES

PPR = {"ppr": "500"}
SMALL = {"ppr": "8", "clock": "1MHz", "tick": "20clk", "max-time": "200clk"}
# Options beside those of `SMALL`, an empty one for none, and the whole message.
REFUSED = Path(__file__).with_name("refused.txt").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("made", [*METHODS.values(), AxesSpec])
def test_parameters_are_given_by_name(made: type) -> None:
    assert {one.kind for one in inspect.signature(made).parameters.values()} == {inspect.Parameter.KEYWORD_ONLY}


def test_what_is_described_does_not_change() -> None:
    """Every dataclass of spec/ and of golden models is frozen, so it can be kept in a cache and shared by processes."""
    spec, models = (pkgutil.walk_packages(one.__path__, f"{one.__name__}.") for one in (tachometry.spec, golden))
    for module in (*spec, *models):
        for name, made in vars(importlib.import_module(module.name)).items():
            params = getattr(made, "__dataclass_params__", None)
            assert params is None or params.frozen, name


@pytest.mark.parametrize("method", METHODS)
def test_defaults_are_those_of_python(method: str) -> None:
    made, usual = METHODS[method], {"max_time": "100ms"} if method == "track" else {}
    assert of_texts(method, PPR) == made(encoder=Encoder(500))
    assert Timing.parse() == Timing(48_000_000, 960, 500)
    assert of_texts(method, PPR).timing == Timing.parse(**usual)
    assert Timing.parse("10MHz") == Timing.parse("10MHz", "20us", "10ms") == Timing(10_000_000, 200, 500)
    for unit in ("count/tick", "rad/s", "rev/s", "rpm"):
        spec = made(encoder=Encoder(500), unit=unit)
        assert of_texts(method, PPR | {"unit": unit}) == spec
        if method == "track":  # its noise is less than that of others
            assert spec.velocity.rad_per_s_per_lsb < 7e-5
        else:
            assert spec.velocity.frac_bits == (16 if unit == "count/tick" else 10)
    texts = had_by(method, {"ppr": "20", "clock": "100MHz", "tick": "4clk", "max-time": "2000clk", "unit": "rpm"})
    coarse = Timing(100_000_000, int(texts["tick"].removesuffix("clk")), 500)
    assert of_texts(method, texts) == made(encoder=Encoder(20), timing=coarse, unit="rpm")
    assert of_texts(method, texts).velocity.frac_bits < 10  # as many as there can be
    if not made.facts.own_ticks:
        external = of_texts(method, PPR | {"external-tick": "yes", "clock": "50MHz"})
        assert external == made(encoder=Encoder(500), timing=Timing.parse("50MHz", **usual), external_tick=True)
        assert external.tick.longest == 2000


def test_every_option_does_what_it_says() -> None:
    texts = """ppr=24 decoding=2 clock=1MHz tick=100us max-time=5ms external-tick=yes max-tick-period=150us unit=rpm
        lsb=2^-3 velocity-width=20 max-speed=900rpm position-width=20 filter=3 index=yes index-reset=on age=1
        bounds=true edge-error=0.25 lowpass=50rad/s cancel=no reciprocal=table sensor=Pulses reverse=yes invert=Z,a
        index-at=a=1"""
    spec = of_texts("s", dict(word.split("=", 1) for word in texts.split()))
    assert spec == STachometer(
        encoder=Encoder(24, 2, "pulses", reverse=True, invert="a,z"),
        timing=Timing(1_000_000, 100, 50),
        external_tick=True,
        max_tick_cycles=150,
        unit="rpm",
        frac_bits=3,
        velocity_width=20,
        max_speed=Speed.parse("900rpm"),
        position_width=20,
        filter_clocks=3,
        index=Index(reset=True, at="A=1"),
        age=True,
        bounds=True,
        edge_error=Fraction(1, 4),
        lowpass=Fraction(50),
        cancel=False,
        reciprocal_source="table",
    )
    assert {about.name for about in (*common_options(), *own_options("s"))} - {
        "dt",
        *("bits", "sample-age", "zero", "chip", "encoder-clock", "line-delay", "crc", "gray", "repeat"),
        "frac-bits",
        "lines",
        "cpr",
        "pole-pairs",
        "teeth",
        "blanking",
        "ratio",
        "pwm",
        "health",
        "health-edges",
        "health-errors",
        "differential",
        *(about.name for extra in EXTRAS for about in options_of(extra)),
        "preset",
        "index-once",
        "position-modulo",
        "position-compare",
    } == {word.split("=")[0] for word in texts.split()}


def test_what_help_shows_and_what_pairwise_tests_take() -> None:
    """The default where it is a number or a text; both values of a flag, the default left out."""
    shown = {about.name: about.shown for method in METHODS for about in (*common_options(), *own_options(method))}
    assert {
        name: shown[name] for name in ("lowpass", "adaptive", "index", "decoding", "timer", "min-time", "tick")
    } == {
        "lowpass": None,
        "adaptive": None,
        "index": None,
        "decoding": "4",
        "timer": "clock",
        "min-time": "a tick",
        "tick": "20us, or as long as the method needs at this clock",
    }
    options = {about.name: about for method in METHODS for about in (*common_options(), *own_options(method))}
    assert [options[name].tested for name in ("cancel", "index", "bound-decay", "timer")] == [
        ("", "no"),
        ("", "yes"),
        ("", "no"),
        ("", "tick"),
    ]
    assert [options[name].few for name in ("tick", "max-time", "decoding")] == [3, 3, 2]


def test_none_is_leaving_it_out() -> None:
    assert of_texts("m", PPR | {"average": None, "unit": None, "external-tick": "no"}) == of_texts("m", PPR)


@pytest.mark.parametrize("row", REFUSED, ids=lambda row: row.partition(" => ")[0])
def test_errors_name_the_parameter(row: str) -> None:
    words, _, message = row.partition(" => ")
    method, *more = words.split()
    texts = SMALL | {"method": method} | dict(word.split("=", 1) for word in more)
    with pytest.raises(ParameterError) as caught:
        of_options({name: text for name, text in texts.items() if text})
    assert str(caught.value) == message
    assert message.startswith(caught.value.parameter)
    assert str(pickle.loads(pickle.dumps(caught.value))) == message


def test_every_option_is_explained_in_sentences() -> None:
    for method in METHODS:
        for about in (*common_options(), *own_options(method)):
            assert re.fullmatch(r"[A-Z].{15,}\.", about.help), about.name
            assert not re.search(r"\b(same|told|flagged)\b", about.help), about.name


def test_parameters_name_every_field() -> None:
    for method in METHODS:
        spec = of_texts(method, PPR)
        fields = {about.field for about in (*common_options(), *own_options(method)) if not about.tacit}
        assert set(spec.parameters) == fields - {"external_tick"} | {"method"}


@pytest.mark.parametrize("method", METHODS)
def test_options_say_which_core_it_is(method: str) -> None:
    for words in configurations(method):
        spec = spec_of(words)
        assert of_options(spec.options) == spec, words


@pytest.mark.parametrize("bus", ["none", *BUSES])
def test_a_manifest_says_which_core_it_is(bus: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # The manifest is made without the Verilog, which takes a second a core.
    monkeypatch.setattr("tachometry.hdl.export.files.verilog_of", lambda *_: "")
    core = of_texts("s", PPR | {"max-speed": "7000rpm", "tick": "0.1ms", "clock": "30MHz", "max-time": "3ms"})
    assert isinstance(core, STachometer)
    cores: list[AnySpec] = [
        core,
        LoopSpec(tachometer=core, gains="inputs"),
        LoopSpec(
            tachometer=of_texts("track", PPR | {"tick": "6001clk", "max-time": "600100clk", "max-memory": "5ms"}),
            gains="inputs",
        ),
        LoopSpec(tachometer=core, gains="inputs", observer=Fraction(50, 3), velocity_filter=Fraction(0)),
        LoopSpec(tachometer=core, gains="inputs", control_period=9000, velocity_filter=2 * PI * 50),
    ]
    if bus == "none":
        cores += [AxesSpec(tachometer=core, axes=axes, parallel=axes > 1) for axes in (1, 8)]
    for spec in cores:
        (tmp_path / "core.json").write_text(export(spec, "core", bus)["core.json"])
        assert of_manifest(tmp_path / "core.json") == spec


def test_what_is_no_manifest_is_refused(tmp_path: Path) -> None:
    (tmp_path / "endless.json").symlink_to("/dev/zero")
    with pytest.raises(ValueError, match=r"endless.json must be a manifest that tachometry writes"):
        of_manifest(tmp_path / "endless.json")
    path = tmp_path / "core.json"
    for text in ("", "[]", "{}", '{"options": 1}', "[" * 100_000):
        path.write_text(text)
        with pytest.raises(ValueError, match="must be a manifest that tachometry writes"):
            of_manifest(path)
    options = of_texts("s", PPR).options
    for more, message in (
        ({"later": "1"}, "later must not be given with method s: there is no such option"),
        ({"method": "x"}, "method must be one of auto, s, m, t, mt, rairan, track, not 'x'"),
        ({"tick": "0clk"}, "tick must be longer than 0"),
        ({"method": "m", "axes": "2"}, "method must be s or track together with --axes, not m"),
    ):
        with pytest.raises(ParameterError, match=f"^{message}"):
            of_options({name: text for name, text in (options | more).items() if name not in ("cancel", "reciprocal")})
