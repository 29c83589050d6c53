"""The manifest that lies beside the Verilog."""

import re
from typing import Any

from tachometry.spec.control import AnySpec
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Port

_OF_PORTS = ("name", "direction", "width", "signed")
KEYWORDS = frozenset(
    """
    always and assign automatic begin buf bufif0 bufif1 case casex casez cell cmos config deassign default defparam
    design disable edge else end endcase endconfig endfunction endgenerate endmodule endprimitive endspecify endtable
    endtask event for force forever fork function generate genvar highz0 highz1 if ifnone incdir include initial inout
    input instance integer join large liblist library localparam macromodule medium module nand negedge nmos nor
    noshowcancelled not notif0 notif1 or output parameter pmos posedge primitive pull0 pull1 pulldown pullup
    pulsestyle_ondetect pulsestyle_onevent rcmos real realtime reg release repeat rnmos rpmos rtran rtranif0 rtranif1
    scalared showcancelled signed small specify specparam strong0 strong1 supply0 supply1 table task time tran tranif0
    tranif1 tri tri0 tri1 triand trior trireg unsigned use vectored wait wand weak0 weak1 while wire wor xnor xor

    accept_on alias always_comb always_ff always_latch assert assume before bind bins binsof bit break byte chandle
    checker class clocking const constraint context continue cover covergroup coverpoint cross dist do endchecker
    endclass endclocking endgroup endinterface endpackage endprogram endproperty endsequence enum eventually expect
    export extends extern final first_match foreach forkjoin global iff ignore_bins illegal_bins implements implies
    import inside int interconnect interface intersect join_any join_none let local logic longint matches modport
    nettype new nexttime null package packed priority program property protected pure rand randc randcase randsequence
    ref reject_on restrict return s_always s_eventually s_nexttime s_until s_until_with sequence shortint shortreal
    soft solve static string strong struct super sync_accept_on sync_reject_on tagged this throughout timeprecision
    timeunit type typedef union unique unique0 until until_with untyped uwire var virtual void wait_order weak wildcard
    with within
    """.split()
)
# Also those of VHDL, which a module may be an entity of, its first library, and the devices of Windows; in any case.
_OF_OTHERS = frozenset(
    """
    abs access after all architecture array attribute block body buffer bus component configuration context default
    disconnect downto elsif entity exit file generic group guarded impure in is label library linkage literal loop map
    mod new next nor of on open others out parameter port postponed procedure process pure range record register reject
    rem report return rol ror select severity shared signal sla sll sra srl subtype then to transport type unaffected
    units until use variable vmode vprop vunit wait when work xnor xor
    std con prn aux nul
    """.split()
) | {f"{port}{number}" for port in ("com", "lpt") for number in range(1, 10)}


def check_module_name(name: str) -> str:
    """Return `name`, if it can be the name of a Verilog module, of an entity of VHDL, and of files.

    It raises ValueError if it is no plain identifier, or a keyword of Verilog or of SystemVerilog, in which the smoke
    test is written.
    """
    if name in KEYWORDS:
        raise ParameterError("name", f"must not be a Verilog keyword, which {name!r} is")
    if name.casefold() in _OF_OTHERS:
        raise ParameterError("name", f"must not be a word of VHDL or a device of Windows, which {name!r} is")
    if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,63}", name) is None:
        raise ParameterError("name", f"must be a letter or _ and up to 63 letters, digits or _, not {name!r}")
    return name


def described_port(port: Port) -> dict[str, Any]:
    """Return what the manifest says of a port."""
    return {key: getattr(port, key) for key in _OF_PORTS}


def manifest(spec: AnySpec, name: str = "tachometer") -> dict[str, Any]:
    """Return all that a program or a driver must know of the exported core.

    It raises ValueError if `name` cannot be the name of a module.
    """
    if name in {port.name for port in spec.ports}:
        raise ParameterError("name", f"must not be the name of a port: {name!r}")
    return {
        "module": check_module_name(name),
        **spec.entries,
        "ports": [described_port(port) for port in spec.ports],
        "parameters": spec.parameters,
        "options": spec.options,
    }
