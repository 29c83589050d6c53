"""The functions of `import tachometry` do what the commands do."""

import doctest
import inspect
import re
from pathlib import Path

import numpy as np
import pytest
from support.command import run as command

import tachometry
from tachometry import api
from tachometry.spec import ParameterError, TachometerSpec, of_manifest

CORE = {"ppr": 500, "clock": "1MHz", "tick": "1ms", "max_time": "20ms"}


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
def test_cores_and_their_files_are_those_of_the_command(options: dict[str, object], words: str, tmp_path: Path) -> None:
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
    tachometry.simulate(tachometry.Tachometer(**CORE, method="s"), "constant:300rpm:30ms").plot(tmp_path / "p.png")
    assert (tmp_path / "p.png").stat().st_size > 10_000


def test_what_is_wrong_is_said() -> None:
    spec = tachometry.Tachometer(**CORE, method="s")
    assert isinstance(spec, TachometerSpec)
    with pytest.raises(ParameterError, match="jiter must be an option of the encoder: vibration, jitter"):
        tachometry.simulate(spec, "constant:300rpm:30ms", jiter=0.1)
    with pytest.raises(ValueError, match="motion must be one for each of 1 axes, not 2"):
        tachometry.simulate(spec, ["constant:300rpm:30ms"] * 2)
    with pytest.raises(ValueError, match="captures must be one for each of 1 axes, not 0"):
        tachometry.replay(spec)
    with pytest.raises(ValueError, match="specs must be of different methods"):
        tachometry.compare([spec, spec], "constant:300rpm:30ms")
    with pytest.raises(ParameterError, match="there is no such option: did you mean ppr"):
        tachometry.Tachometer(**CORE, method="s", pprr=3)
