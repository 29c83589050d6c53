"""The functions of `import tachometry` do what the commands do."""

import doctest
import inspect
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import run as command

import tachometry
from tachometry import api
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.spec import ParameterError, TachometerSpec, of_manifest
from tachometry.spec.language.option import options_of

CORE: dict[str, Any] = {"ppr": 500, "clock": "1MHz", "tick": "1ms", "max_time": "20ms"}


def test_examples_of_docstrings() -> None:
    assert doctest.testmod(api).failed == 0
    assert doctest.testmod(api).attempted >= 7


def test_the_page_of_a_drive_in_python_is_what_python_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parent.parent / "docs" / "guides" / "python.md").read_text(encoding="utf-8")
    cells = "\n".join(re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    (tmp_path / "build").mkdir()
    monkeypatch.chdir(tmp_path)
    result = doctest.DocTestRunner().run(doctest.DocTestParser().get_doctest(cells, {}, "python.md", None, 0))
    assert (result.failed, result.attempted) == (0, cells.count(">>> "))
    assert (tmp_path / "build" / "drive" / "spindle.v").is_file()


def test_names_are_there_and_completed() -> None:
    assert set(tachometry.__all__) == {*api.__all__, "__version__"} == set(dir(tachometry))
    assert [getattr(tachometry, name) for name in api.__all__] == [getattr(api, name) for name in api.__all__]
    assert {"ppr", "max_speed", "axes", "loop", "kp", "method"} < set(inspect.signature(api.Tachometer).parameters)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"method": "s", "index": True, "cancel": False}, "--method s --index --no-cancel"),
        ({"method": "s", "axes": 3}, "--method s --axes 3"),
        ({"method": "m", "loop": True, "kp": 6400, "kv": 160}, "--method m --loop --kp 6400 --kv 160"),
    ],
)
def test_cores_and_their_files_are_those_of_the_command(options: dict[str, Any], words: str, tmp_path: Path) -> None:
    spec = tachometry.Tachometer(**CORE, max_speed="400rad/s", **options)
    common = "--ppr 500 --clock 1MHz --tick 1ms --max-time 20ms --max-speed 400rad/s"
    assert command("generate", *common.split(), *words.split(), "--name", "core", "-o", tmp_path / "command") == 0
    assert spec == of_manifest(tmp_path / "command" / "core.json")
    for path in tachometry.generate(spec, tmp_path / "api", "core"):
        assert path.read_bytes() == (tmp_path / "command" / path.name).read_bytes()


def test_a_capture_is_replayed(tmp_path: Path) -> None:
    spec = tachometry.Tachometer(**CORE, method="s")
    (tmp_path / "c.csv").write_text(
        "time,a,b\n" + "".join(f"{k / 1000},{k // 2 % 2},{(k + 1) // 2 % 2}\n" for k in range(50))
    )
    for capture in (tmp_path / "c.csv", tachometry.read_capture(tmp_path / "c.csv")):
        run = tachometry.replay(spec, capture)
        assert (run.n_mismatches, run.true_velocity) == (0, None)
        assert abs(int(run.position[-1])) == 49
        assert np.allclose(abs(run.velocity[-5:]), 1000 * 2 * np.pi / 2000)


def test_a_log_is_replayed(tmp_path: Path) -> None:
    spec = tachometry.Tachometer(**CORE, method="m")
    rows = "".join(f"{5 * k},{10 * k},{1.8 * k % 360:.1f}\n" for k in range(300))
    (tmp_path / "log.csv").write_text(f"time_ms,n,shaft_deg\n{rows}")
    for options in ({"count": "n"}, {"angle": "shaft_deg"}):
        run = tachometry.replay(spec, tmp_path / "log.csv", **options)
        assert abs(run.position[-1] - 2990) <= 2
    with pytest.raises(ValueError, match=r"\(of a counter, count n takes its counts\)$"):
        tachometry.replay(spec, tmp_path / "log.csv")


def test_axes_have_their_own_runs() -> None:
    spec = tachometry.Tachometer(**CORE, method="s", axes=2)
    assert spec.scale == spec.tachometer.scale
    run = tachometry.simulate(spec, ["constant:300rpm:30ms", "constant:-600rpm:30ms"])
    other = tachometry.Run(run.simulation, 1)
    for one, rpm in ((run, 300), (other, -600)):
        assert one.true_velocity is not None
        assert np.allclose(one.true_velocity[-1], rpm * np.pi / 30)
        assert abs(one.velocity[-1] / one.true_velocity[-1] - 1) < 0.02


def test_a_picture_is_drawn(tmp_path: Path) -> None:
    run = tachometry.simulate(tachometry.Tachometer(**CORE, method="s"), "constant:300rpm:30ms")
    assert run.plot(tmp_path / "p.png") is None
    assert (tmp_path / "p.png").read_bytes() == run._repr_png_()
    figure = run.plot()
    assert figure is not None
    assert figure._repr_png_() == run._repr_png_()  # type: ignore[attr-defined]


def test_results_print_in_ten_lines() -> None:
    spec = tachometry.Tachometer(**CORE, method="s")
    cores = [tachometry.Tachometer(**CORE, method=method) for method in ("s", "m", "t", "mt", "rairan")]
    assert isinstance(spec, TachometerSpec)
    results: list[Any] = [
        spec,
        tachometry.plan(spec),
        tachometry.simulate(spec, "constant:300rpm:30ms"),
        tachometry.compare([core for core in cores if isinstance(core, TachometerSpec)], "constant:300rpm:30ms"),
    ]
    for result in results:
        assert repr(result).count("\n") < 10
    assert repr(results[1]).splitlines()[1].split("  ")[0] == "speed (rad/s)"
    assert "resolution (rpm)" in repr(tachometry.plan(tachometry.Tachometer(**CORE, method="s", unit="rpm")))
    assert "RMS error (rpm)" in repr(results[3])
    assert "mismatches  0\n" in repr(results[2])
    assert [line.split()[0] for line in repr(results[3]).splitlines()[2:]] == ["s", "m", "t", "mt", "rairan"]
    assert results[3]._repr_html_().count("<tr>") == 6


def test_the_stub_has_every_option() -> None:
    """If this fails, write what is compared into the file."""

    def of(name: str, fields: list[str]) -> str:
        return f"class {name}(TypedDict, total=False):\n" + "".join(fields)

    named = sorted(inspect.signature(api.Tachometer).parameters)
    core = [f"    {name}: {'bool' if _is_flag(name) else 'Value'} | None\n" for name in named]
    faults = [f"    {about.name.replace('-', '_')}: Value | None\n" for about in options_of(EncoderOptions)]
    head = "from typing import TypeAlias, TypedDict\n\nValue: TypeAlias = str | int | float\n\n"
    wanted = head + of("CoreOptions", core) + "\n" + of("EncoderFaults", faults)
    stub = Path(__file__).parent.parent / "package" / "options.pyi"
    assert stub.read_text(encoding="utf-8") == wanted


def _is_flag(name: str) -> bool:
    return name in ("parallel", "loop") or (name in api._OPTIONS and api._OPTIONS[name].flag)


def test_what_is_wrong_is_said() -> None:
    spec = tachometry.Tachometer(**CORE, method="s")
    assert isinstance(spec, TachometerSpec)
    with pytest.raises(ParameterError, match="jiter must be an option of the encoder: vibration, jitter"):
        tachometry.simulate(spec, "constant:300rpm:30ms", jiter=0.1)  # type: ignore[call-arg]
    with pytest.raises(ParameterError, match=r'^tick must have its unit, as in "100us", not 0.0001$'):
        tachometry.Tachometer(ppr=500, clock=48e6, tick=1e-4)
    with pytest.raises(ParameterError, match=r"^bounds must be left out with axes: "):
        tachometry.Tachometer(**CORE, method="s", axes=2, bounds=True)
    with pytest.raises(ValueError, match="motion must be one for each of 1 axes, not 2"):
        tachometry.simulate(spec, ["constant:300rpm:30ms"] * 2)
    with pytest.raises(ValueError, match="captures must be one for each of 1 axes, not 0"):
        tachometry.replay(spec)
    with pytest.raises(ValueError, match="specs must be of different methods"):
        tachometry.compare([spec, spec], "constant:300rpm:30ms")
    with pytest.raises(ParameterError, match="there is no such option: did you mean ppr"):
        tachometry.Tachometer(**CORE, method="s", pprr=3)  # type: ignore[call-arg]
