"""Print what is in a waveform, for `read_fst`: pywellen ends the process where a file is damaged."""

import contextlib
import faulthandler
import json
import sys
from collections import defaultdict

import pywellen


def main(path: str, most: str, *chosen: str) -> None:
    """Print, as JSON, the unit of the times as a factor and a power of ten of seconds, and name and size of all
    variables that have bits; or, of the variables with these numbers, a line for each change: time, number, value.

    It ends with status 3 rather than print more than `most` characters at once.
    """

    def show(text: str) -> None:
        if len(text) > int(most):
            sys.exit(3)
        sys.stdout.write(text)

    file = pywellen.WaveformStream(path, multi_threaded=False)
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


if __name__ == "__main__":
    sys.stdin.read()  # it ends when the limits of this process are set
    _, seconds, *words = sys.argv
    if sys.platform != "linux":  # where there are none
        faulthandler.dump_traceback_later(float(seconds), exit=True)
    with contextlib.suppress(BrokenPipeError):
        main(*words)
