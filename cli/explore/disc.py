"""The disc of a capture, as the page shows it."""

import base64
from typing import Any

from tachometry.cli.reports.calibrate import calibration_rows
from tachometry.sim.plots.disc import disc_picture
from tachometry.sim.signals.recording import Recording
from tachometry.sim.studies.calibrating.calibrate import calibrate
from tachometry.spec import TachometerSpec


def described(capture: Recording, spec: TachometerSpec) -> dict[str, Any]:
    """Return what JSON can hold: the rows, the picture in base64, the map as text, and the reasons to refuse it."""
    found = calibrate([("the capture", capture)], spec)
    picture = base64.b64encode(disc_picture(found)).decode()
    map_text = "" if found.reasons else found.disc.text
    return {"rows": calibration_rows(found, spec), "picture": picture, "map": map_text, "reasons": found.reasons}
