"""From counts to velocity: a datapath for each method, and the boxes that it is made of."""

from typing import Any

from tachometry.hdl.methods import m, mt, rairan, s, t

# By the name of the method.
DATAPATHS: dict[str, Any] = {
    "s": s.Datapath,
    "m": m.Datapath,
    "t": t.Datapath,
    "mt": mt.Datapath,
    "rairan": rairan.Datapath,
}
