"""A motor is declared once, for cores with a control loop and for loops that are simulated."""

from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.language.option import option
from tachometry.spec.language.units import PLAIN, TORQUE_CONSTANT, Quantity

_TORQUE_CONSTANT = "Torque constant K_t of the motor, in Nm/A or mNm/A."


@dataclass(frozen=True, kw_only=True)
class Motor:
    """Describes the motor as its controller knows it."""

    _group = "Loop"
    inertia: Fraction = option(  # noqa: RUF009
        None, "Inertia J of motor and load, in kg m².", text="0.003", metavar="J", parse=Quantity(PLAIN)
    )
    torque_constant: Fraction = option(  # noqa: RUF009
        None, _TORQUE_CONSTANT, text="60.3mNm/A", metavar="KT", parse=Quantity(TORQUE_CONSTANT)
    )
