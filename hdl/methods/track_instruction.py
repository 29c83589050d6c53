"""An instruction of the tracking machine in the memory of its program."""

from collections.abc import Sequence

from amaranth.lib import data

from tachometry.spec.formats.tracking_code import ADDRESS_BITS, FIRST_INPUT, HOW_BITS, INPUTS, OUTPUTS, Program
from tachometry.spec.formats.tracking_instruction import Instruction, Jump, Left
from tachometry.spec.formats.tracking_units import Start


def layout_of(program: Program) -> data.StructLayout:
    """Return an instruction. A jump has its target where others have how, and where the sum goes."""
    target = len(program.code.instructions).bit_length()
    store = max(ADDRESS_BITS, target - HOW_BITS)
    return data.StructLayout(
        {
            "left": Left,
            "from_unit": 1,
            "word": ADDRESS_BITS,
            **({"first": ADDRESS_BITS} if program.times.ports > 1 else {}),
            "subtract": 1,
            "by_sign": 1,
            "keep": 1,
            "writes": 1,
            "start": Start,
            "output": 3,
            "jump": Jump,
            "how": HOW_BITS,
            "store": store,
        }
    )


def encoded(program: Program, one: Instruction, layout: data.StructLayout, at: Sequence[int]) -> int:
    """Return an instruction as the program memory holds it; `at` is where each one stands."""
    where, nothing = program.addresses, FIRST_INPUT + len(INPUTS)
    inputs = {f"${name}": FIRST_INPUT + number for number, name in enumerate(INPUTS)}
    first, word = ({**where, **inputs, "": nothing, "~": nothing}[name] for name in (one.first, one.word))
    if one.first and program.times.ports == 1:
        word = first
    how, store = program.number(one), where[one.store]
    if one.target:
        target = at[program.code.labels[one.target]]
        how, store = target & ((1 << HOW_BITS) - 1), target >> HOW_BITS
    values = {
        "left": one.left,
        "from_unit": one.word == "~",
        "word": word,
        "first": first,
        "subtract": one.subtract,
        "by_sign": one.by_sign,
        "keep": one.keep,
        "writes": bool(one.store),
        "start": one.start,
        "output": OUTPUTS.index(one.output),
        "jump": one.jump,
        "how": how,
        "store": store,
    }
    return sum(values[name] << field.offset for name, field in layout)  # `layout.const` takes a hundred times as long
