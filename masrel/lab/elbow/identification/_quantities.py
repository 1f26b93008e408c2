"""What can be fitted, and how it is written in files and tables."""

import math
from dataclasses import dataclass

DEGREES = 180.0 / math.pi  # of a radian


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A symbol, a key with the unit for files, that unit in words, and its size.

    A value in SI units times `factor` is in the unit.
    """

    symbol: str
    key: str
    unit: str
    factor: float = 1.0


QUANTITIES: dict[str, Quantity] = {
    "damping": Quantity(symbol="b", key="damping_nms_rad", unit="N·m·s/rad"),
    "stiffness": Quantity(symbol="k", key="stiffness_nm_rad", unit="N·m/rad"),
    "inertia": Quantity(symbol="m", key="inertia_kg_m2", unit="kg·m²"),
    "catch_angle_constant": Quantity(
        symbol="L", key="catch_angle_constant_deg", unit="deg", factor=DEGREES
    ),
    "catch_slope": Quantity(symbol="α", key="catch_slope_s", unit="s"),
    "catch_torque_constant": Quantity(
        symbol="H", key="catch_torque_nms_rad", unit="N·m·s/rad"
    ),
    "residual_ratio": Quantity(symbol="Q", key="residual_ratio", unit="1"),
    "catch_travel": Quantity(
        symbol="D", key="catch_travel_deg", unit="deg", factor=DEGREES
    ),
    "post_catch_stiffness": Quantity(
        symbol="k_post", key="post_catch_stiffness_nm_rad", unit="N·m/rad"
    ),
}
"""The law's parameters, by the names they have in `ElbowParameters`."""

ARM_QUANTITIES: dict[str, Quantity] = {
    "gravity": Quantity(symbol="G", key="gravity_nm", unit="N·m"),
    "arm_inertia": Quantity(symbol="J", key="arm_inertia_kg_m2", unit="kg·m²"),
    "lag": Quantity(symbol="T", key="lag_s", unit="s"),
    "catch_rise": Quantity(symbol="rise", key="catch_rise_s", unit="s"),
}
"""What an arm and a sensor have beside the law."""

ALL_QUANTITIES = QUANTITIES | ARM_QUANTITIES
