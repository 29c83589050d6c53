"""Print what is in a waveform as JSON, for `read_fst`: pywellen ends the process where a file is damaged."""

import contextlib
import itertools
import json
import sys

import pywellen


def contents(path: str, most: str, *chosen: str) -> dict[str, object]:
    """Return the unit of the times as a factor and a power of ten of seconds, and name and size of all variables that
    have bits; or, of the variables with these numbers, their times and values, of each at most so many.
    """
    file = pywellen.Waveform(path, multi_threaded=False)
    variables = [variable for variable in file.all_vars() if variable.bitwidth]
    if chosen:
        rows = (itertools.islice(variables[int(number)].tv, int(most)) for number in chosen)
        return {"changes": [[(time, _bits(value)) for time, value in of] for of in rows]}
    unit = file.timescale
    named = [(variable.full_name, variable.bitwidth) for variable in variables]
    return {"unit": unit and (unit.factor, unit.unit.to_exponent()), "variables": named}


def _bits(value: object) -> str:
    return f"{value:b}" if isinstance(value, int) else str(value)


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):
        json.dump(contents(*sys.argv[1:]), sys.stdout)
