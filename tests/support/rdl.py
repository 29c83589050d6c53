"""Texts in SystemRDL, as their compiler reads them."""

import io
from contextlib import redirect_stderr
from pathlib import Path

from systemrdl import RDLCompiler
from systemrdl.node import AddrmapNode


def read_rdl(text: str, folder: Path) -> AddrmapNode:
    """Return the address map of a text; anything that the compiler says is a failure."""
    file = folder / "core.rdl"
    file.write_text(text, encoding="utf-8")
    said = io.StringIO()
    with redirect_stderr(said):
        compiler = RDLCompiler()
        compiler.compile_file(str(file))
        (top,) = compiler.elaborate().children()
    assert said.getvalue() == ""
    assert isinstance(top, AddrmapNode)
    return top
