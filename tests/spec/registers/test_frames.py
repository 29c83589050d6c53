"""Frames of the serial lines: what is made of them, and what is refused."""

import re

import pytest
from support import docs
from support.serial import encode_answer, spi_write

from tachometry.spec.language.option import ParameterError
from tachometry.spec.registers import frames
from tachometry.spec.registers.buses import BUSES, bus_of
from tachometry.spec.registers.frames import Answer, FrameError, Request, Type

READ = frames.read_request(4, 2, 9)
WRITE = frames.write_request(2, 0x01020304, 3)


def test_the_check_is_that_of_the_catalogue() -> None:
    """CRC-16/MCRF4XX: check 0x6f91 of the digits 1 to 9, residue 0."""
    assert frames.crc(b"123456789") == 0x6F91
    assert frames.crc(READ) == frames.crc(WRITE) == 0


def test_requests() -> None:
    assert READ[:-2] == bytes([0x09, 4, 2])
    assert WRITE[:-2] == bytes([0x13, 2, 4, 3, 2, 1])
    assert frames.decode_request(READ) == Request(Type.READ, 9, 4, 2)
    assert frames.decode_request(WRITE) == Request(Type.WRITE, 3, 2, 0x01020304)
    assert [frames.answer_length(request) for request in (READ, WRITE)] == [12, 4]


def test_answers() -> None:
    answer = Answer((0x01020304, 0x05060708), error=True)
    frame = encode_answer(frames.decode_request(READ), answer)
    assert frame[:-2] == bytes([0x89, 4, 3, 2, 1, 8, 7, 6, 5, 1])
    assert frames.decode_answer(READ, frame) == answer
    written = encode_answer(frames.decode_request(WRITE), Answer((), error=False))
    assert frames.decode_answer(WRITE, written) == Answer((), error=False)


def test_telemetry() -> None:
    body = bytes([0xA7, 4, 3, 2, 1, 8, 7, 6, 5, 0])
    assert frames.decode_telemetry(frames.with_check(body)) == (7, (0x01020304, 0x05060708))
    assert frames.telemetry_length(2) == len(body) + 2
    for wrong in (body[:-1], body[:-1] + b"\1", b"\x97" + body[1:]):
        with pytest.raises(FrameError, match=r"^telemetry must "):
            frames.decode_telemetry(frames.with_check(wrong))


def test_the_examples_of_the_page() -> None:
    page = docs.page("guides/serial.md")
    write = frames.write_request(2, 1, 3)
    answer = encode_answer(frames.decode_request(write), Answer((), error=False))
    for frame in (frames.read_request(4, 5, 7), write, answer, spi_write(2, 1)):
        assert f"`{frame.hex(' ')}`" in page


def test_every_flipped_bit_is_found() -> None:
    for bit in range(8 * len(WRITE)):
        frame = (int.from_bytes(WRITE, "big") ^ 1 << bit).to_bytes(len(WRITE), "big")
        with pytest.raises(FrameError, match=r"^the check of a frame must be right$"):
            frames.decode_request(frame)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (bytes([0x20, 0, 0]), "a request must begin with its type"),
        (b"", "a request must begin with its type"),
        (bytes([0x00, 0, 0, 0]), "a request must be as long as its type says, not 6 bytes"),
        (bytes([0x10, 0, 0]), "a request must be as long as its type says, not 5 bytes"),
    ],
)
def test_what_is_no_request(body: bytes, message: str) -> None:
    with pytest.raises(FrameError, match=f"^{message}$"):
        frames.decode_request(frames.with_check(body))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (bytes([0x93, 0, 0]), "the answer must have 4 bytes, not 5"),
        (bytes([0x94, 0]), "the answer must be that to request 0x13, not begin with 0x94"),
        (bytes([0x93, 2]), "the status of an answer must be 0 or 1, not 2"),
    ],
)
def test_what_is_no_answer(body: bytes, message: str) -> None:
    with pytest.raises(FrameError, match=f"^{message}$"):
        frames.decode_answer(WRITE, frames.with_check(body))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: frames.read_request(256), "address must be from 0 to 255, not 256"),
        (lambda: frames.read_request(0, 256), "n_words must be from 0 to 255, not 256"),
        (lambda: frames.write_request(0, 1 << 32), "data must be from 0 to 4294967295, not 4294967296"),
        (lambda: frames.write_request(0, 0, -1), "sequence must be from 0 to 15, not -1"),
    ],
)
def test_numbers_out_of_range(make: object, message: str) -> None:
    assert callable(make)
    with pytest.raises(ValueError, match=f"^{message}$"):
        make()


def test_a_baud_rate_that_the_clock_makes() -> None:
    uart = BUSES["uart"]
    assert [uart.bit_cycles(clock) for clock in (8_000_000, 12_000_000, 48_000_000)] == [8, 12, 48]
    assert [uart.bit_cycles(clock) for clock in (7_840_000, 8_160_000, 8_820_000, 9_180_000)] == [8, 8, 9, 9]
    bus = bus_of("uart", 115_200)
    assert bus is not None
    assert bus.bit_cycles(25_000_000) == 217
    assert bus_of("none") is None


@pytest.mark.parametrize(
    ("bus", "baud", "clock", "message"),
    [
        ("uart", 3_000_000, 10_000_000, "8 clocks, such as 1250000, not 3000000"),
        ("uart", 1_000_000, 7_830_000, "8 clocks, such as 978750, not 1000000"),
        ("uart", 1_000_000, 8_500_000, "8 clocks, such as 944444, not 1000000"),
        ("uart", 0, 10_000_000, "baud must be at least 1, not 0"),
        ("spi", 9600, 10_000_000, "baud must be given together with a bus that has it, uart, not spi"),
        ("none", 9600, 10_000_000, "baud must be given together with a bus that has it, uart, not none"),
    ],
)
def test_a_baud_rate_that_is_refused(bus: str, baud: int, clock: int, message: str) -> None:
    with pytest.raises(ParameterError, match=f"{re.escape(message)}$"):  # noqa: PT012
        found = bus_of(bus, baud)
        assert found is not None
        found.bit_cycles(clock)
