"""Words for a core: what commands, figures and plans say of it."""

from tachometry.spec.core.follows import Follows, S
from tachometry.spec.language.units import SpeedUnit, plural


class Words(Follows[S]):
    """Says of a core what commands, figures and plans show."""

    @property
    def description(self) -> str:
        """How it measures, in the words of its paper."""
        return self.spec.facts.summary

    @property
    def heading(self) -> str:
        """The name that figures give it."""
        return f"{self.spec.facts.title} method"

    @property
    def method(self) -> str:
        """The method, and why it was taken where none was named."""
        return ", ".join(filter(None, (self.spec.method, self.spec.chosen)))

    @property
    def on_ramps(self) -> str:
        """How it follows a constant acceleration without delay; empty: it lags by half of its measurement."""
        return ""

    @property
    def remark(self) -> str:
        """A remark below the plan of the method; empty: none."""
        return ""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what of the core is not as its options say."""
        spec, most = self.spec, self.spec.widths.max_velocity
        if spec.max_speed is None:
            return ()
        if spec.max_speed.counts(spec.encoder.counts_per_rev, spec.timing.tick_seconds) <= most:
            return ()
        unit = SpeedUnit(spec.max_speed.unit)
        greatest = unit.of(most * spec.scale.unit_velocity)
        many = plural(most, "count")
        return (f"greatest speed cut from {spec.max_speed} to {greatest:.6g}{unit.name}: {many} per tick is the most",)

    @property
    def memory(self) -> tuple[str, int, int] | None:
        """The memory of the reciprocal: its kind, entries, bits of an entry. None: there is no such memory."""
        return None

    @property
    def division(self) -> str:
        """How the reciprocal is found where it is divided; empty: it is not."""
        return ""
