"""Print what is in a waveform, for `read_fst`: pywellen ends the process where a file is damaged."""

import contextlib
import faulthandler
import itertools
import json
import struct
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pywellen

_CHANGES = (1, 5, 8)  # types of the blocks of a file that have changes


def pieces(path: Path, folder: Path) -> Iterator[Path]:
    """Yield files that have one block of changes each, in turn, as pywellen takes some 20 bytes for each of a file."""
    blocks, end, size = list[tuple[int, int, int]](), 0, path.stat().st_size
    with path.open("rb") as file:
        while end < size and len(head := file.read(9)) == 9:
            kind, length = struct.unpack(">BQ", head)
            if length < 8:
                break  # the length counts itself
            blocks.append((kind, end, end + 1 + length))
            end += 1 + length
            file.seek(min(end, size))
        changes = [block for block in blocks if block[0] in _CHANGES]
        if end != size or len(changes) < 2:
            yield path
            return
        piece = folder / "piece.fst"
        for chosen in changes:
            with piece.open("wb") as beside:
                for kind, first, after in blocks:
                    if kind not in _CHANGES or first == chosen[1]:
                        file.seek(first)
                        beside.write(file.read(after - first))
            yield piece


def main(path: str, folder: str, most: str, *chosen: str) -> None:
    """Print, as JSON, the unit of the times as a factor and a power of ten of seconds, and name and size of all
    variables that have bits; or, of the variables with these numbers, a line for each change: time, number, value.

    It ends with status 3 rather than print more than `most` characters at once.
    """

    def show(text: str) -> None:
        if len(text) > int(most):
            sys.exit(3)
        sys.stdout.write(text)

    def read(piece: Path) -> None:
        file = pywellen.WaveformStream(str(piece), multi_threaded=False)
        variables = [variable for variable in file.all_vars() if variable.bitwidth]
        if not chosen:
            unit = file.timescale
            named = [(variable.full_name, variable.bitwidth) for variable in variables]
            show(json.dumps({"unit": unit and (unit.factor, unit.unit.to_exponent()), "variables": named}))
            return
        numbers = defaultdict[str, list[str]](list)  # of variables, several of which may be one signal
        for number in chosen:
            numbers[str(variables[int(number)].signal_id)].append(number)

        def change(time: int, signal: object, value: object) -> None:
            text = f"{value:b}" if isinstance(value, int) else str(value)
            for number in numbers[str(signal)]:
                show(f"{time} {number} {text}\n")

        file.stream_changes(change, [variables[int(number)] for number in chosen])

    for piece in itertools.islice(pieces(Path(path), Path(folder)), None if chosen else 1):
        read(piece)


if __name__ == "__main__":
    sys.stdin.read()  # it ends when the limits of this process are set
    _, seconds, *words = sys.argv
    if sys.platform != "linux":  # where there are none
        faulthandler.dump_traceback_later(float(seconds), exit=True)
    with contextlib.suppress(BrokenPipeError):
        main(*words)
