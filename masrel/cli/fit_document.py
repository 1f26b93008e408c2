"""A fit as one JSON document: units in the keys, ``nan`` as null."""

import math
from typing import TYPE_CHECKING

from masrel.elbow.identification.friction import FrictionFit
from masrel.elbow.identification.quantities import QUANTITIES, Quantity
from masrel.report.fit_table import FRICTION

if TYPE_CHECKING:
    from masrel.elbow.identification import ElbowFit, FittedParameter
    from masrel.elbow.identification.trials import Trial

__all__ = ["fit_document"]


def fit_document(fit: "ElbowFit | FrictionFit") -> dict[str, object]:
    """Turn a fit into plain values, units in the keys."""
    if isinstance(fit, FrictionFit):
        return _device(fit)
    return {
        "simulated": fit.simulated,
        "level": fit.level,
        "relative_error": _known(fit.relative_error),
        "torque_sd_nm": fit.torque_sd,
        "estimates": [_estimate(e, QUANTITIES[e.name]) for e in fit.estimates],
        "correlation": _matrix(fit.correlation.tolist()),
        "steps": [
            {
                "name": step.name,
                "estimates": [_estimate(e, QUANTITIES[e.name]) for e in step.estimates],
            }
            for step in fit.steps
        ],
        "trials": [_trial(trial) for trial in fit.trials],
        "recordings": [
            {"name": name, "sha256": sha256} for name, sha256 in fit.sources.items()
        ],
        "remarks": list(fit.remarks),
    }


def _device(fit: FrictionFit) -> dict[str, object]:
    return {
        "simulated": fit.simulated,
        "level": fit.level,
        "n_strokes": len(fit.strokes),
        "relative_error": _known(fit.relative_error),
        "torque_sd_nm": fit.torque_sd,
        "estimates": [_estimate(e, FRICTION[e.name]) for e in fit.estimates],
        "correlation": _matrix(fit.correlation.tolist()),
    }


def _estimate(estimate: "FittedParameter", quantity: Quantity) -> dict[str, object]:
    factor = quantity.factor
    return {
        "key": quantity.key,
        "value": _known(estimate.value * factor),
        "standard_error": _known(estimate.standard_error * factor),
        "degrees_of_freedom": _known(estimate.freedom),
        "low": _known(estimate.low * factor),
        "high": _known(estimate.high * factor),
        "n_trials": estimate.n_trials,
        "reason": estimate.reason,
    }


def _trial(trial: "Trial") -> dict[str, object]:
    made: dict[str, object] = {
        "name": trial.name,
        "pace": trial.pace,
        "start_s": trial.start,
        "duration_s": trial.duration,
        "peak_speed_deg_s": math.degrees(trial.peak_speed),
        "remark": trial.remark,
    }
    catch = trial.catch
    if catch is not None:
        made |= {
            "catch_s": catch.time,
            "catch_angle_deg": math.degrees(catch.angle),
            "catch_speed_deg_s": math.degrees(catch.speed),
            "mean_speed_deg_s": math.degrees(catch.mean_speed),
            "catch_end_s": catch.end,
            "catch_travel_deg": math.degrees(catch.travel),
        }
    return made


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _matrix(rows: list[list[float]]) -> list[list[float | None]]:
    return [[_known(value) for value in row] for row in rows]
