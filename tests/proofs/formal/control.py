"""These proofs are about the control loop."""

from dataclasses import replace
from functools import partial

from proofs.formal.prove import Proof
from support.control import Beside

from tachometry.spec import Encoder, STachometer
from tachometry.spec.control.form import GUARD_BITS, Coefficients, ControlForm, Term
from tachometry.spec.language.units import signed_width

_SPEC = STachometer(encoder=Encoder(1))
# Numbers as small as a solver can look at; the coefficients are of no real motor.
_FORM = ControlForm(
    velocity_width=2,
    velocity_limit=1,
    extra_bits=1,
    factor_bits=2,
    terms={
        Term.FILTER: Coefficients((1, 2, 3), 0),
        Term.OBSERVER: Coefficients((1, 2, 3), 0),
        Term.CURRENT: Coefficients((2, 1, 1), 0),
        Term.POSITION: Coefficients((3,), 4),
        Term.VELOCITY: Coefficients((3,), 2),
        Term.ACCELERATION: Coefficients((2,), 3),
        Term.DISTURBANCE: Coefficients((3,), 1),
    },
    current_limit=2,
    position_width=2,
    command_bits=1,
    acceleration_width=2,
    synchronised=True,
    position_bits=1,
)
_PROBES = {
    "core_due": "window.due",
    "core_n": "window.n",
    "core_sum": "window.current_sum",
    "core_held": "window.held",
    **{f"core_{name}": f"controller.{name}" for name in ("again", "subtract", "start", "finish", "limit")},
    **{f"core_{name}": f"controller.{name}" for name in ("velocity", "acceleration", "enabled")},
    "core_is_due": "controller.due",
    **{f"core_{name}": f"controller.{name}" for name in ("term", "word", "total")},
    **{f"core_{name}": f"controller.product.{name}" for name in ("started", "multiplied", "done")},
}


def _packed(term: Term) -> int:
    """Return a byte for each n from 1 on, or the one."""
    values = _FORM.terms[term].values
    return values[0] if len(values) == 1 else sum(value << 8 * n for n, value in enumerate(values, 1))


def _control(name: str, checker: str, form: ControlForm) -> Proof:
    """Return PC: no state and no sum wraps, and what is computed is what the equations say."""
    parameters = {
        "VELOCITY_WIDTH": form.velocity_width,
        "V": form.velocity_limit,
        "EXTRA": form.extra_bits,
        "P": form.factor_bits,
        "LONGEST": form.longest,
        "N_WIDTH": form.longest.bit_length(),
        "LIMIT": form.current_limit,
        "GUARD": GUARD_BITS,
        "POSITION_WIDTH": form.position_width,
        "FRACTION": form.position_bits,
        "COMMAND_WIDTH": form.command_width,
        "COMMAND_BITS": form.command_bits,
        "ACCELERATION_WIDTH": form.acceleration_width,
        "Y_WIDTH": signed_width(form.most_y),
        "W_WIDTH": signed_width(form.most_w),
        "CURRENT_WIDTH": signed_width(form.current_limit),
        "SUM_WIDTH": signed_width(form.most_sum),
        "WORD_WIDTH": form.word_width,
        "TOTAL_WIDTH": form.total_width,
        "MOST_Y": form.most_y,
        "MOST_Z": form.most_y + form.most_lead,
        "MOST_ERROR": form.most_error,
        **{f"{term.name}S".replace("TYS", "TIES"): _packed(term) for term in Term},
        "GAIN_WIDTH": max(form.gain_bits, 1),
        "GAIN_SHIFT": form.gain_shift,
        "LIMIT_WIDTH": form.current_limit.bit_length(),
        **{f"S_{term.name}": form.terms[term].shift for term in Term if term >= Term.CURRENT},
    }
    made = partial(Beside, form, "parallel")
    probes = _PROBES | ({"core_most": "controller.most"} if form.gain_bits else {})
    return Proof(name, _SPEC, checker, parameters, probes, depth=7, box=made)


CONTROL = [
    _control("control loop", "control", _FORM),
    _control("control loop, any gains", "control_gains", replace(_FORM, gain_bits=2)),
]
