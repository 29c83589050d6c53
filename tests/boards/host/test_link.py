"""On a bad line every damaged frame is rejected, every loss is counted, and no other is shown."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only_rows

from tachometry.boards.host import link
from tachometry.boards.host.registers import HostRegisters
from tachometry.spec import of_texts
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.demo import DemoMap, demo_manifest
from tachometry.spec.registers.frames import CRC_POLYNOMIAL, CRC_START, SEQUENCES, TELEMETRY_HEADER, with_check

FRAME_CLOCKS = 12_000


@dataclass(frozen=True)
class Sent:
    """Holds the frames that were sent, and those that arrive.

    - `words`: Of the frames that arrive as they were sent, in order.
    - `lost`: Frames between the first and the last of them that do not.
    - `data`: What arrives.
    """

    words: NDArray[np.uint32]
    lost: int
    data: bytes


def frames_of(registers: HostRegisters, n_frames: int, seed: int) -> tuple[NDArray[np.uint32], NDArray[np.uint8]]:
    """Return random words that the registers can show, but with their times in order, and the frames of them."""
    random = np.random.default_rng(seed)
    names = [register["name"] for register in registers.captured]
    words = np.zeros((n_frames, len(names)), dtype=np.uint32)
    for column, register in enumerate(registers.captured):
        for field in register["fields"]:
            width = min(field["port_width"] - field["shift"], field["width"])
            low = -(1 << width - 1) if field["signed"] else 0
            values = random.integers(low, low + (1 << width), n_frames)
            words[:, column] |= ((values & (1 << field["width"]) - 1) << field["low"]).astype(np.uint32)
    time = np.arange(n_frames, dtype=np.int64) * FRAME_CLOCKS + random.integers(0, FRAME_CLOCKS // 4, n_frames)
    words[:, names.index("TIME")] = (time % (1 << 32)).astype(np.uint32)
    head = (TELEMETRY_HEADER + np.arange(n_frames) % SEQUENCES).astype(np.uint8)[:, None]
    body = words.astype("<u4").view(np.uint8).reshape(n_frames, -1)
    frames = np.hstack([head, body, np.zeros((n_frames, 1), dtype=np.uint8)])
    check = _checks(frames)
    return words, np.hstack([frames, (check & 0xFF).astype(np.uint8)[:, None], (check >> 8).astype(np.uint8)[:, None]])


def damaged(registers: HostRegisters, n_frames: int, seed: int) -> Sent:
    """Return a fifth of the frames has wrong bits, has lost bytes or all of them, or has others in front or within."""
    words, frames = frames_of(registers, n_frames, seed)
    random = np.random.default_rng([seed, 1])
    length = frames.shape[1]
    kinds = random.choice(6, n_frames, p=[0.8, 0.05, 0.05, 0.04, 0.03, 0.03])
    for start in random.integers(0, n_frames, n_frames // 3000 + 1).tolist():  # the line is cut for a while
        kinds[start : start + int(random.integers(1, 100))] = 6
    kinds[0] = kinds[-1] = 0
    parts, begun = [], 0
    for number in np.flatnonzero(kinds).tolist():
        parts.append(frames[begun:number].tobytes())
        begun = number + 1
        frame = bytearray(frames[number].tobytes())
        kind = kinds[number]
        if kind == 1:  # a few bits
            for bit in random.choice(8 * length, int(random.integers(1, 4)), replace=False):
                frame[bit >> 3] ^= 1 << (bit & 7)
        elif kind == 2:  # many bits
            at = int(random.integers(0, length - 4))
            frame[at : at + 4] = bytes(
                byte ^ int(flip) for byte, flip in zip(frame[at : at + 4], random.integers(1, 256, 4), strict=True)
            )
        elif kind == 3:  # lost bytes
            at = int(random.integers(0, length))
            del frame[at : at + int(random.integers(1, length + 1))]
        elif kind == 4:  # bytes within
            at = int(random.integers(1, length))
            frame[at:at] = random.bytes(int(random.integers(1, 50)))
        elif kind == 5:  # noise in front of a frame that is whole
            frame[0:0] = random.bytes(int(random.integers(1, 50)))
        else:
            frame.clear()
        parts.append(bytes(frame))
    parts.append(frames[begun:].tobytes())
    whole = (kinds == 0) | (kinds == 5)
    return Sent(words[whole], int((~whole).sum()), b"".join(parts))


def _checks(frames: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return CRC-16/MCRF4XX of each row, bit by bit."""
    reflected = int(f"{CRC_POLYNOMIAL:016b}"[::-1], 2)
    table: NDArray[np.uint16] = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = ((table >> 1) ^ np.where(table & 1, reflected, 0)).astype(np.uint16)
    check: NDArray[np.uint16] = np.full(len(frames), CRC_START, dtype=np.uint16)
    for column in frames.T:
        check = (check >> 8) ^ table[(check ^ column) & 0xFF]
    return check


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
