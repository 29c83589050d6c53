"""Figures are measured in a lab: a virtual encoder, golden models, and the hardware beside them."""

from tachometry.sim import golden
from tachometry.sim.encoder.motion import Motion, Vibration, parse_motion
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import TachometerSpec


class Lab:
    """Runs cores for a figure.

    - `hdl`: Whether the hardware is simulated where a figure asks for it; else its golden model alone.
    - `whole`: Whether control loops are run with six seeds and all gains; else with one seed and a few gains.

    - `mismatches`: Values in which hardware and golden model differed.
    - `first`: The first of them in each signal.
    - `seeds`: Of runs of control loops.
    """

    def __init__(self, hdl: bool = True, whole: bool = True) -> None:
        self._hdl = hdl
        self.whole = whole
        self.seeds = range(6 if whole else 1)
        self.mismatches = 0
        self.first: list[str] = []

    def turn(
        self,
        spec: TachometerSpec,
        motion: str | Motion,
        *,
        vibration: str | None = None,
        nonuniformity: float = 0.0,
        jitter: float = 0.0,
        start_angle_rad: float = 0.0,
        seed: int = 1,
    ) -> Encoding:
        """Return what the virtual encoder of a spec records."""
        encoder = VirtualEncoder(
            spec.encoder.pulses_per_rev,
            vibration=None if vibration is None else Vibration.parse(vibration),
            nonuniformity=nonuniformity,
            jitter=jitter,
            start_angle_rad=start_angle_rad,
            seed=seed,
        )
        return encoder.record(parse_motion(motion) if isinstance(motion, str) else motion)

    def golden(self, spec: TachometerSpec, encoding: Encoding) -> Run:
        """Return what the core shows, by its golden model."""
        return golden.run(spec, PinTrace.of(encoding.recording, spec))

    def lockstep(self, spec: TachometerSpec, encoding: Encoding) -> Run:
        """Return the result of `golden`, compared with the hardware in Amaranth's simulator."""
        if not self._hdl:
            return self.golden(spec, encoding)
        found = lockstep(spec, PinTrace.of(encoding.recording, spec), PySim())
        self.mismatches += found.n_mismatches
        self.first += [f"{spec.method} method: {mismatch}" for mismatch in found.first]
        return found.expected
