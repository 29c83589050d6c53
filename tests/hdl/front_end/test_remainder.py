"""`position_modulo` of an encoder that is read, where it is no bits of the position."""

from pathlib import Path
from typing import Any

import pytest
from hdl.core.test_sampled import core
from hdl.front_end.test_place import check_registers
from support.nightly import nightly

from tachometry.hdl.core import sampled_tachometer
from tachometry.hdl.front_end import remainder, sampled_position
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.studies.lockstep import lockstep


def test_registers_have_it_with_the_position_that_it_is_of() -> None:
    check_registers(core("m geared"), 1)


@nightly
@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        (remainder, "~value[-1]", "value[-1]"),
        (remainder, "form.divisor // 2", "0"),
        (remainder, "Mux(less[-1], ", "Mux(less <= 0, "),
        (remainder, "left == 1", "left == 2"),
        (sampled_position, "Mux(self.coming, turn, 0)", "turn"),
        (sampled_position, "around - zero", "around"),
        (sampled_position, "self.open_number & ~known", "~known"),
        (sampled_position, '"clear": begins', '"clear": 0'),
        (sampled_tachometer, "spec.latency.place", "spec.latency.tick"),
        (sampled_tachometer, 'held["tick"].eq(box.done)', 'held["tick"].eq(reader.tick)'),
    ],
)
def test_a_wrong_remainder_is_seen(monkeypatch: pytest.MonkeyPatch, module: Any, old: str, new: str) -> None:
    text = Path(module.__file__).read_text(encoding="utf-8")
    assert text.count(old) == 1
    wrong: dict[str, Any] = {"__name__": "wrong"}
    exec(compile(text.replace(old, new), "wrong", "exec"), wrong)
    name = {remainder: "Remainder", sampled_position: "SampledPosition"}.get(module, "SampledTachometer")
    right = getattr(module, name)
    for one, method in vars(wrong[name]).items():
        if callable(method) and one != "__init__":
            monkeypatch.setattr(right, one, method)
    spec = core("m geared")
    assert any(lockstep(spec, stress(spec, seed, 40).completed(spec), PySim()).n_mismatches for seed in (8, 2))
