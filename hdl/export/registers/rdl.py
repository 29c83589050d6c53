"""How SystemRDL 2.0 (Accellera, 2018) writes names, texts, and what software and hardware may do with a field."""

import textwrap

# Properties of a field by its access; a field of a constant register is never written.
ACCESS = {
    "ro": "sw = r; hw = w;",
    "rw": "sw = rw; hw = r;",
    "wo": "sw = w; hw = r; singlepulse;",
    "constant": "sw = r; hw = na;",
}
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


def identifier(name: str) -> str:
    """Return a name as the language takes it."""
    return f"\\{name}" if name in _KEYWORDS else name


def described(text: str) -> str:
    """Return the property `desc`, whose text may go over several lines."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return textwrap.fill(
        f'desc = "{escaped}";', 108, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )
