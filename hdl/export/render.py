"""Fills the holes of the templates in `templates/`; each is named as the file that is made of it."""

import json
import re
import textwrap
from collections.abc import Iterable

from jinja2 import Environment, PackageLoader, StrictUndefined

from tachometry.spec.language.port import Port
from tachometry.spec.language.provenance import notice, version

_COLUMNS = 118
_SENTENCE = re.compile(r"(?<=[.;])(?<!Sec\.)(?<!eqs\.)(?<!eq\.)(?<!Fig\.)(?<!p\.)\s")


def render(template: str, /, **holes: object) -> str:
    """Return the text of a template with its holes filled: `@{name}`, `{% if … %}`, `{% for … %}`."""
    return _TEMPLATES.get_template(f"{template}.j2").render(holes)


def render_files(templates: Iterable[str], name: str, **holes: object) -> dict[str, str]:
    """Return texts by file name; NAME in the name of a template stands for the name of the module."""
    return {file.replace("NAME", name): render(file, name=name, **holes) for file in templates}


def comment(text: str, mark: str = "//") -> str:
    """Return a text as lines of a comment."""
    return "\n".join(f"{mark} {line}" for line in textwrap.wrap(text, 110, break_on_hyphens=False))


def span(width: int) -> str:
    """Return the range of a declaration in Verilog, with a blank behind it; empty for one bit."""
    return f"[{width - 1}:0] " if width > 1 else ""


_PLAIN = "<- floor( ) - <= >= * ^2 x .. - pi -> +- u u sqrt inf".split()
_ASCII = {ord(letter): plain for letter, plain in zip("←⌊⌋−≤≥·²×…–π→±μµ√∞", _PLAIN, strict=True)}


def ascii_of(text: str) -> str:
    """Return a text in the letters that every reader of Verilog and VHDL takes."""
    return text.translate(_ASCII).encode("ascii", "replace").decode()


def wrapped(line: str) -> list[str]:
    """Break a long line of Verilog, but no comment, and not before a comparison."""
    if len(line) <= _COLUMNS or "//" in line:
        return [line]
    pad = " " * (len(line) - len(line.lstrip()) + 4)
    bound = re.sub(r" ([=!<>?]=?) ", "~~\\1 ", re.sub(r" ([=!<>]=) ", "~~\\1~~", line))
    made = textwrap.wrap(bound, _COLUMNS, subsequent_indent=pad, break_long_words=False, break_on_hyphens=False)
    return [part.replace("~~", " ") for part in made]


def first_sentence(text: str) -> str:
    """Return the first sentence of a text."""
    first = _SENTENCE.split(" ".join(text.split()))[0]
    return ascii_of(first.rstrip(".;") + "." if first else "")


def port_comment(port: Port) -> str:
    """Return the comment of a port of the top: its first sentence, sign, unit and strobe."""
    unit = "; signed" * port.signed + (f"; in {port.unit}" if port.unit else "")
    free = "between ticks" in port.help  # it has its own time
    strobe = f"; read with {port.held_by}" if not free and port.held_by not in ("", port.name) else ""
    return first_sentence(port.help).rstrip(".") + ascii_of(unit) + strobe


def _vhdl_name(name: str) -> str:
    """Return a name of Verilog in VHDL, where underscores stand only between other letters of a plain one."""
    return name if "_" not in (name[0], name[-1]) and "__" not in name else f"\\{name}\\"


def _vhdl_type(port: Port) -> str:
    kind = "signed" if port.signed else "unsigned"
    return "std_logic" if port.width == 1 else f"{kind}({port.width - 1} downto 0)"


# Doubled braces stand in Verilog and Python as they are, so a hole has other marks than Jinja's own.
_TEMPLATES = Environment(
    loader=PackageLoader("tachometry.hdl.export"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
    variable_start_string="@{",
    variable_end_string="}",
)
_TEMPLATES.globals |= {"notice": lambda mark: notice(mark).rstrip("\n"), "version": version}
_TEMPLATES.filters.update(
    ascii=ascii_of,
    comment=comment,
    literal=lambda value: json.dumps(value, ensure_ascii=False),  # as Python writes it, too
    shape=lambda port: "signed " * port.signed + span(port.width),  # between the kind of a signal and its name
    vhdl_name=_vhdl_name,
    vhdl_type=_vhdl_type,
)
