"""What the catches of a joint have in common: what their own values scatter about.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2)-(4).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.catch_line import line_row
from masrel.elbow.identification.censored import beyond
from masrel.elbow.identification.horizon import Horizon
from masrel.elbow.parameters import ElbowParameters

__all__ = ["Known", "Row", "Spreads", "catch_rows"]

Row = tuple[float, dict[str, float]]
"""A residual over its spread, and its derivatives by the parameters it has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spreads:
    """What a residual of each kind is divided by.

    Attributes
    ----------
    torque, peak, residual : float
        N·m.
    catch_angle, travel : float
        rad.
    """

    torque: float
    peak: float
    residual: float
    catch_angle: float
    travel: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What the equations of a trial do not change.

    Attributes
    ----------
    names : tuple of str
        The shared parameters, in the order of the vector.
    constants : ElbowParameters
        ΔT_peak, ν_L and the reading of (5).
    spreads : Spreads
        What residuals are divided by.
    on_line : bool
        Whether the trial's catch lies on the line of (2).
    horizon : Horizon or None
        Behind which its catch ends, if it does not end before.
    """

    names: tuple[str, ...]
    constants: ElbowParameters
    spreads: Spreads
    on_line: bool
    horizon: Horizon | None = None


def catch_rows(
    known: Known,
    catches: tuple[Catch | None, Catch | None],
    shared: Mapping[str, float],
    own: Mapping[str, float],
) -> list[Row]:
    """Say how far a trial's own values are from what they scatter about.

    Parameters
    ----------
    known : Known
        What does not change.
    catches : tuple of two Catch or None
        The trial's catch if it lies on the line of (2), and if its torque is used.
    shared, own : mapping of str to float
        Parameters of all trials, and of this one.

    Returns
    -------
    list of Row
        As many as the trial has something to say of.
    """
    on_line, used = catches
    rows = []
    if on_line is not None and "catch_slope" in shared:
        rows.append(_line(known, on_line, shared))
    if used is None:
        return rows
    if "peak" in own and "catch_torque_constant" in shared:
        size = known.spreads.peak
        left = shared["catch_torque_constant"] * used.speed - own["peak"]  # (3)
        slopes = {"catch_torque_constant": used.speed / size, "peak": -1.0 / size}
        rows.append((left / size, slopes))
    if "residual" in own and "peak" in own and "residual_ratio" in shared:
        size, ratio, peak = (
            known.spreads.residual,
            shared["residual_ratio"],
            own["peak"],
        )
        slopes = {"residual_ratio": peak / size, "peak": ratio / size}
        slopes["residual"] = -1.0 / size
        rows.append(((ratio * peak - own["residual"]) / size, slopes))  # (3)
    if "catch_travel" in shared:
        rows += _travel(known, used, shared, own)
    return rows


def _line(known: Known, catch: Catch, shared: Mapping[str, float]) -> Row:
    slowest, size = known.constants.slowest_mean_speed, known.spreads.catch_angle
    line, slope = shared["catch_angle_constant"], shared["catch_slope"]
    left, by_line, by_slope = line_row(catch, line, slope, slowest)  # (2)
    slopes = {"catch_angle_constant": by_line, "catch_slope": by_slope}
    return left / size, {name: value / size for name, value in slopes.items()}


def _travel(
    known: Known, catch: Catch, shared: Mapping[str, float], own: Mapping[str, float]
) -> list[Row]:
    size = known.spreads.travel
    if catch.end is not None:
        travel = own.get("travel", catch.travel)
        slopes = {"catch_travel": 1.0 / size, "travel": -1.0 / size}
        return [((shared["catch_travel"] - travel) / size, slopes)]  # (4)
    if known.horizon is None:
        return []
    left, slope, _ = beyond(shared["catch_travel"], known.horizon, size)
    return [(left, {"catch_travel": slope})]
