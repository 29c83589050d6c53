"""On a bad line every damaged frame is rejected, every loss is counted, and no other is shown."""

from functools import cache

import numpy as np
import pytest
from support.nightly import only_rows
from support.telemetry import FRAME_CLOCKS, Sent, damaged, frames_of

from tachometry.boards.host import link
from tachometry.boards.host.registers import HostRegisters
from tachometry.spec import of_texts
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.demo import DemoMap, demo_manifest
from tachometry.spec.registers.frames import with_check

MANY, FEW = 10_000_000, 300_000  # bytes
CHUNK = 997


@cache
def registers() -> HostRegisters:
    bus = bus_of("uart")
    assert bus is not None
    texts = {"ppr": "500", "clock": "12MHz", "bounds": "yes", "age": "yes", "filter": "4"}
    return HostRegisters(demo_manifest(DemoMap(of_texts("s", texts)), bus))


@cache
def sent(n_bytes: int, seed: int) -> Sent:
    length = frames_of(registers(), 1, 0)[1].shape[1]
    return damaged(registers(), n_bytes // length + 1, seed)


def check_line(n_bytes: int, seed: int) -> None:
    """Feed the receiver in pieces that begin and end anywhere."""
    line = sent(n_bytes, seed)
    receiver = link.Receiver(registers(), frame_clocks=FRAME_CLOCKS)
    for start in range(0, len(line.data), CHUNK):
        receiver.feed(line.data[start : start + CHUNK])
    beginning = frames_of(registers(), 1, 0)[1].tobytes()[:10]
    receiver.feed(beginning)
    receiver.reset()
    assert len(receiver.telemetry) == receiver.counts.frames == len(line.words)
    assert np.array_equal(np.array(receiver.telemetry, dtype=np.uint32), line.words)
    assert receiver.counts.lost == line.lost
    length = frames_of(registers(), 1, 0)[1].shape[1]
    assert receiver.counts.bytes_dropped == len(line.data) + len(beginning) - length * len(line.words)


# Of a million bytes with seed 1, one damaged frame has the right check by chance.
@pytest.mark.parametrize(("many", "seed"), only_rows([(MANY // 10, 2)], [(MANY // 10, 2), (MANY, 1)]))
def test_millions_of_bytes_of_a_bad_line(many: int, seed: int) -> None:
    line = sent(many, seed)
    assert len(line.data) > 0.95 * many
    assert line.lost > 0.15 * len(line.words)
    check_line(many, seed)


def test_words_that_no_register_can_show_are_no_frame() -> None:
    """The check of some random bytes is right by chance."""
    words, frames = frames_of(registers(), 1, 3)
    receiver = link.Receiver(registers())
    receiver.feed(frames[0].tobytes())
    assert list(receiver.telemetry) == [tuple(words[0])]
    for bit in range(8 * (frames.shape[1] - 2)):
        changed = bytearray(frames[0, :-2].tobytes())
        changed[bit >> 3] ^= 1 << (bit & 7)
        receiver = link.Receiver(registers())
        receiver.feed(with_check(bytes(changed)))
        found = list(receiver.telemetry)
        assert not found or registers().possible(found[0])
    impossible = words.copy()
    status = [register["name"] for register in registers().captured].index("STATUS")
    impossible[0, status] |= 1 << 31
    head = frames[0, :1].tobytes()
    receiver = link.Receiver(registers())
    receiver.feed(with_check(head + impossible.astype("<u4").tobytes() + b"\0"))
    assert not receiver.telemetry


def test_many_losses_while_the_time_wraps() -> None:
    """Frames are lost while the time wraps."""
    n_frames = (1 << 32) // FRAME_CLOCKS + 100
    names = [register["name"] for register in registers().captured]
    words, frames = frames_of(registers(), n_frames, 5)
    wraps = int(np.flatnonzero(np.diff(words[:, names.index("TIME")].astype(np.int64)) < 0)[0])
    receiver = link.Receiver(registers(), frame_clocks=FRAME_CLOCKS)
    receiver.feed(frames[wraps - 20].tobytes())
    receiver.feed(frames[wraps + 20].tobytes())
    assert receiver.counts.lost == 39


def test_frames_may_come_byte_by_byte() -> None:
    """A frame is there with its last byte."""
    words, frames = frames_of(registers(), 20, 4)
    receiver = link.Receiver(registers(), frame_clocks=FRAME_CLOCKS)
    for number, frame in enumerate(frames):
        for byte in frame.tobytes():
            assert len(receiver.telemetry) == number
            receiver.feed(bytes([byte]))
    assert np.array_equal(np.array(receiver.telemetry, dtype=np.uint32), words)
    assert (receiver.counts.lost, receiver.counts.bytes_dropped) == (0, 0)
