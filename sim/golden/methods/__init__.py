"""Each method has a golden model here."""

from typing import Any

from tachometry.sim.golden.methods import m, mt, rairan, s, t, track

# By the name of the method.
MODELS: dict[str, Any] = {
    "s": s.Model,
    "m": m.Model,
    "t": t.Model,
    "mt": mt.Model,
    "rairan": rairan.Model,
    "track": track.Model,
}
