"""The papers' equations, one function each, vectorised over numpy arrays.

Both papers number their equations from (1); names say which is meant.
"""

from tachometry.sim.theory.tsuji import (
    tsuji_eq03_velocity,
    tsuji_eq04_resolution,
    tsuji_eq05_measurement_time,
    tsuji_eq06_velocity,
    tsuji_eq07_resolution,
    tsuji_eq08_measurement_time,
    tsuji_eq09_velocity,
    tsuji_eq10_resolution,
    tsuji_eq11_measurement_time,
    tsuji_eq12_interval,
    tsuji_eq13_velocity,
    tsuji_eq14_resolution,
    tsuji_eq15_measurement_time,
    tsuji_eq16_interval,
    tsuji_eq17_velocity,
    tsuji_eq18_resolution,
    tsuji_eq19_measurement_time,
    tsuji_eq20_interval,
    tsuji_eq21_velocity,
    tsuji_eq22_low_pass,
    unit_velocity,
)

__all__ = [
    "tsuji_eq03_velocity",
    "tsuji_eq04_resolution",
    "tsuji_eq05_measurement_time",
    "tsuji_eq06_velocity",
    "tsuji_eq07_resolution",
    "tsuji_eq08_measurement_time",
    "tsuji_eq09_velocity",
    "tsuji_eq10_resolution",
    "tsuji_eq11_measurement_time",
    "tsuji_eq12_interval",
    "tsuji_eq13_velocity",
    "tsuji_eq14_resolution",
    "tsuji_eq15_measurement_time",
    "tsuji_eq16_interval",
    "tsuji_eq17_velocity",
    "tsuji_eq18_resolution",
    "tsuji_eq19_measurement_time",
    "tsuji_eq20_interval",
    "tsuji_eq21_velocity",
    "tsuji_eq22_low_pass",
    "unit_velocity",
]
