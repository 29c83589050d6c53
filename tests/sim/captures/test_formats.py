"""Files that people have are read rightly, or refused in a line; damaged ones too."""

from pathlib import Path

import numpy as np
import pytest
from support.formats import FORMATS, QUARTERS, STEP_S, Format

from tachometry.sim.captures.read import read_capture
from tachometry.sim.signals.recording import Recording


def read(form: Format, folder: Path) -> Recording:
    return read_capture(form.write(folder), form.a, form.b, form.samplerate_hz, text=form.text)


def counts(recording: Recording) -> int:
    """Return quarter periods forward; a change of both lines is none."""
    quarter = np.array([0, 1, 3, 2])[recording.a + 2 * recording.b]
    steps = (np.diff(quarter) + 1) % 4 - 1
    assert set(steps.tolist()) <= {-1, 0, 1}
    return int(steps.sum())


def test_there_are_enough_formats() -> None:
    assert len({form.name for form in FORMATS}) == len(FORMATS) >= 25


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_a_format_is_read(form: Format, tmp_path: Path) -> None:
    recording = read(form, tmp_path)
    assert counts(recording) == QUARTERS
    np.testing.assert_allclose(recording.time, np.arange(QUARTERS + 1) * STEP_S, rtol=0, atol=1e-12)
    assert recording.source is not None
    assert recording.source.notes == form.notes
