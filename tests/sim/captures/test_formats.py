"""Files that people have are read rightly, or refused in a line; damaged ones too."""

import itertools
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.damage import damaged
from support.formats import FORMATS, QUARTERS, STEP_S, Format
from support.nightly import only

from tachometry.sim.captures.file import CaptureError
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


@pytest.mark.parametrize("n", only([12], [12, 100]))
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_damage_is_refused_or_stays_where_it_is(form: Format, n: int, tmp_path: Path) -> None:
    """A damaged file is refused, or read rightly before the damage and after it."""
    whole, messages = read(form, tmp_path).level.tolist(), list[str]()
    for content in damaged(form.content, form.name, n):
        try:
            level = read(replace(form, content=content), tmp_path).level.tolist()
        except CaptureError as error:
            messages.append(str(error))
            continue
        before, after = (
            sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], zip(*two, strict=False)))
            for two in ((whole, level), (whole[::-1], level[::-1]))
        )
        assert before + after >= len(whole) - 12, content
    assert not [message for message in messages if "\n" in message]


@pytest.mark.parametrize("form", [form for form in FORMATS if form.name in ("plain", "waveform")], ids=["plain", "vcd"])
def test_a_damaged_file_is_read_as_it_says(form: Format, tmp_path: Path) -> None:
    """Of files that are plain enough still, another reader says the same."""
    n_read = 0
    for content in damaged(form.content, form.name, 400):
        text = content.decode("latin-1")
        if form.suffix == ".vcd":
            head, end, body = text.partition("$enddefinitions $end\n")
            plain = head + end == form.content.decode().partition("#")[0]
            rows = re.findall(r"#([0-9]+)\n([01])!\n([01])\"\n", body)
            plain &= body == "".join(f'#{time}\n{a}!\n{b}"\n' for time, a, b in rows)
            times = [int(time) * 1e-6 for time, _, _ in rows]
        else:
            plain = bool(re.fullmatch(r"time,a,b\n([0-9]+\.[0-9]+,[01],[01]\n)+", text))
            rows = [(time, a, b) for time, a, b in (line.split(",") for line in text.split()[1:])] if plain else []
            times = [float(time) for time, _, _ in rows]
        if not plain or times != sorted(times):
            continue
        recording, n_read = read(replace(form, content=content), tmp_path), n_read + 1
        moved = [k for k in range(len(rows)) if k == 0 or rows[k][1:] != rows[k - 1][1:]]
        assert recording.level.tolist() == [int(rows[k][1]) + 2 * int(rows[k][2]) for k in moved], text
        np.testing.assert_allclose(recording.time, [times[k] - times[0] for k in moved], rtol=1e-12, atol=1e-15)
        assert recording.duration == pytest.approx(times[-1] - times[0])
    assert n_read > 10
