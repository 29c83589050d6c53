"""Telemetry as a board sends it, and what a bad line makes of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.boards.host.registers import HostRegisters
from tachometry.spec.registers.frames import CRC_POLYNOMIAL, CRC_START, SEQUENCES, TELEMETRY_HEADER

FRAME_CLOCKS = 12_000


@dataclass(frozen=True)
class Sent:
    """Holds the frames that were sent, and those that arrive.

    Parameters
    ----------
    words : array of int
        Of the frames that arrive as they were sent, in order.
    lost : int
        Frames between the first and the last of them that do not.
    data : bytes
        What arrives.
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
