"""The registers in SystemRDL 2.0 (Accellera, 2018)."""

import textwrap

from tachometry.hdl.export.registers.values import is_whole, sentences
from tachometry.spec.language.provenance import notice
from tachometry.spec.registers.map import WORD, Field, Register, RegisterMap

# A field by its access: what software and what hardware may do.
_ACCESS = {"ro": ["sw = r;", "hw = w;"], "rw": ["sw = rw;", "hw = r;"], "wo": ["sw = w;", "hw = r;", "singlepulse;"]}
_CONSTANT = ["sw = r;", "hw = na;"]
# Words that are no names unless a backslash stands before them: those of tables 3 and 4 of the standard.
_KEYWORDS = frozenset(
    """
    abstract accesstype addressingtype addrmap alias all bit boolean bothedge byte compact component componentwidth
    constraint default encode enum external false field fullalign hw inside int integer internal level longint mem na
    negedge nonsticky number onreadtype onwritetype posedge precedencetype property r rclr real ref reg regalign regfile
    rset ruser rw rw1 shortint signal signed string struct sw this true type unsigned w w1 wclr woclr woset wot wr wset
    wuser wzc wzs wzt alternate shortreal time with within
    """.split()
)


def rdl(registers: RegisterMap, name: str) -> str:
    """The text of `NAME.rdl`: an address map of this name.

    Parameters
    ----------
    registers : RegisterMap
    name : str
        Of the Verilog module.
    """
    lines = [
        f"// Registers of {name} in SystemRDL 2.0; offsets are in bytes.",
        *notice("//").splitlines(),
        "",
        f"addrmap {_identifier(name)} {{",
        f'  name = "{name}";',
        f'  desc = "Registers of a tachometer, method {registers.spec.method}.";',
        f"  default regwidth = {WORD};",
        f"  default accesswidth = {WORD};",
        "  littleendian;",
        "  lsb0;",
    ]
    for register in registers:
        lines += ["", *_register(register)]
    return "\n".join([*lines, "};"]) + "\n"


def _register(register: Register) -> list[str]:
    lines = ["reg {", f'  name = "{register.name}";', *_text("  desc = ", sentences(register))]
    for field in register.fields:
        lines += [f"  {line}" for line in _field(field, "" if is_whole(register) else field.help, register.constant)]
    lines.append(f"}} {_identifier(register.name)} @ 0x{register.offset:02x};")
    return [f"  {line}" for line in lines]


def _field(field: Field, told: str, constant: bool) -> list[str]:
    return [
        "field {",
        *(_text("  desc = ", told) if told else ()),
        f"  {' '.join(_CONSTANT if constant else _ACCESS[field.access])}",
        f"}} {_identifier(field.name)}[{field.low + field.width - 1}:{field.low}] = 0x{field.reset:x};",
    ]


def _text(what: str, text: str) -> list[str]:
    """A property whose value is a string, which may go over several lines."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return textwrap.wrap(
        f'{what}"{escaped}";', 110, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )


def _identifier(name: str) -> str:
    return f"\\{name}" if name in _KEYWORDS else name
