"""What can be fitted, and how it is written in files and tables."""

import math
from dataclasses import dataclass

__all__ = ["DEGREES", "QUANTITIES", "Quantity"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """How a parameter is written in files and tables.

    Attributes
    ----------
    symbol : str
        Its symbol in the paper.
    key : str
        Its key in a model or protocol file, with the unit.
    unit : str
        That unit, in words for tables.
    factor : float
        What a value in SI units is multiplied by to be in it.
    """

    symbol: str
    key: str
    unit: str
    factor: float = 1.0


DEGREES = 180.0 / math.pi
"""Of a radian."""

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
"""What can be fitted, by the name it has in `ElbowParameters`."""
