"""The fits that the source made one after the other, each on its own.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6), Figs. 3 to 5.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow.identification._catches import (
    SLOW_WINDOW,
    Arm,
    Catch,
    CatchLevels,
    PreCatchLaw,
    Trial,
)
from masrel.lab.elbow.identification._clusters import (
    ClusteredFit,
    Rows,
    partial_out,
    solve,
)
from masrel.lab.elbow.identification._equations import line_row
from masrel.lab.elbow.identification._results import (
    FittedParameter,
    Step,
    fitted,
)
from masrel.lab.elbow.identification._travels import (
    CensoredTravels,
    DetectionLimit,
    fit_censored,
)
from masrel.lab.elbow.parameters import ElbowParameters

_Floats = NDArray[np.float64]

# Mean speeds must span this, rad/s: less is one speed, which has no slope.
_MIN_SPAN = math.radians(5.0)

_ITERATIONS = 20  # of Gauss and Newton's method for a line that is nearly straight


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowFit:
    """What slow trials say: b, k and m, and the paper's relative error (Fig. 3)."""

    trials: tuple[Trial, ...]
    step: Step
    law: PreCatchLaw
    gravity: float
    relative_error: float
    errors: Mapping[str, float]  # standard errors, of one trial those of its samples


def fit_slow(
    trials: Sequence[Trial],
    fitted_names: Sequence[str],
    arm: Arm,
    *,
    offset: float | None,
    rest_angle: float | None,
    level: float,
) -> SlowFit:
    """Fit b, k, and of m, weight and drift what is fitted, to slow trials: step 1.

    Each trial has a constant of its own, -k·θ_rest of (1) and the sensor's zero, unless
    the offset is fixed.
    """
    names = ["damping", "stiffness"]
    names += [name for name in ("inertia", "gravity") if name in fitted_names]
    tables, owns = [], []
    for trial in trials:
        part = trial.pre_catch
        rest = trial.rest_angle if rest_angle is None else rest_angle
        columns = {
            "damping": part.velocity,
            "stiffness": part.angle - (0.0 if offset is None else rest),
            "inertia": part.acceleration,
            "gravity": np.sin(part.angle - arm.gravity_angle),
        }
        local = [np.ones(part.time.size)] if offset is None else []
        local += [part.time - part.time.mean()] if "drift" in fitted_names else []
        target = part.torque - arm.torque(part, trial.name) - (offset or 0.0)
        tables.append(np.column_stack([*local, *(columns[n] for n in names), target]))
        owns.append(len(local))
    left = [partial_out(table, n) for table, n in zip(tables, owns, strict=True)]
    fit = solve([Rows(design=r[:, :-1], target=r[:, -1]) for r in left])
    far, squares, size, count = _distance(trials, tables, owns, fit.values)
    step = Step(
        name="slow trials: b, k of (1)",
        estimates=fitted(names, fit, level),
        residual_sd=math.sqrt(squares / count),
    )
    return SlowFit(
        trials=tuple(trials),
        step=step,
        law=PreCatchLaw(
            damping=step["damping"].value,
            stiffness=step["stiffness"].value,
            inertia=step["inertia"].value if "inertia" in names else 0.0,
        ),
        gravity=step["gravity"].value if "gravity" in names else arm.gravity,
        relative_error=far / size if size > 0.0 else math.nan,
        errors=_errors(step, left, trials),
    )


def _errors(
    step: Step, rows: Sequence[_Floats], trials: Sequence[Trial]
) -> dict[str, float]:
    errors = {e.name: e.standard_error for e in step.estimates}
    if len(trials) > 1 or math.isnan(step["damping"].value + step["stiffness"].value):
        return errors
    # samples of one trial, of which the filter leaves one in so many independent
    time, (table,) = trials[0].pre_catch.time, rows
    period = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    inverse = np.linalg.pinv(table[:, :-1].T @ table[:, :-1], hermitian=True)
    values = inverse @ (table[:, :-1].T @ table[:, -1])
    squares = float(((table[:, -1] - table[:, :-1] @ values) ** 2).sum())
    n_alike = max(SLOW_WINDOW / period, 1.0)
    df = max(time.size / n_alike - table.shape[1], 1.0)
    variances = squares / df * np.diag(inverse)
    return dict(zip(errors, np.sqrt(variances).tolist(), strict=True))


def _distance(
    trials: Sequence[Trial],
    tables: Sequence[_Floats],
    owns: Sequence[int],
    values: _Floats,
) -> tuple[float, float, float, int]:
    # measured torque from the law: sums of |distance|, of its square and of |torque|,
    # and the number of samples
    far, squares, size, count = 0.0, 0.0, 0.0, 0
    for trial, table, n in zip(trials, tables, owns, strict=True):
        left = table[:, -1] - (table[:, n:-1] * values).sum(axis=1)
        if n:
            left = left - left.mean()
        if n == 2:
            left = left - table[:, 1] * (table[:, 1] @ left) / (
                table[:, 1] @ table[:, 1]
            )
        part = trial.pre_catch
        error = part.measured - (part.torque - left)
        far += float(np.abs(error).sum())
        squares += float((error**2).sum())
        size += float(np.abs(part.measured).sum())
        count += part.measured.size
    return far, squares, size, count


def on_the_line(
    catches: Sequence[Catch], constants: ElbowParameters
) -> NDArray[np.bool_]:
    """Return which catches are on the line of (2), not where θ_L of (6) holds."""
    speeds = np.array([catch.mean_speed for catch in catches])
    speeds = np.maximum(speeds, constants.slowest_mean_speed)
    angles = np.array([catch.angle for catch in catches])
    design = np.stack([np.ones_like(speeds), -speeds], axis=1)
    on = np.ones(speeds.size, dtype=np.bool_)
    for _ in range(speeds.size):
        line = np.linalg.lstsq(design[on], angles[on], rcond=None)[0]
        now = design @ line >= constants.smallest_catch_angle
        if (now == on).all() or not now.any():
            break
        on = now
    return on


def fit_catch_line(
    catches: Sequence[Catch], constants: ElbowParameters, *, level: float
) -> Step:
    """Fit L and α to catch angles: (2) within the clamps of (6)."""
    names = ("catch_angle_constant", "catch_slope")
    title, slowest = "catch angles: L, α of (2)", constants.slowest_mean_speed
    on = on_the_line(catches, constants)
    used = [catch for catch, lies in zip(catches, on.tolist(), strict=True) if lies]
    speeds = np.maximum([catch.mean_speed for catch in used], slowest)
    if np.ptp(speeds) < _MIN_SPAN:
        reason = (
            f"needs catches at mean speeds that differ by {math.degrees(_MIN_SPAN):g} "
            f"deg/s or more above {math.degrees(slowest):g} deg/s"
        )
        estimates = tuple(
            FittedParameter(name=name, level=level, n_trials=len(used), reason=reason)
            for name in names
        )
        return Step(name=title, estimates=estimates, residual_sd=math.nan)
    design = np.stack([np.ones_like(speeds), -speeds], axis=1)
    angles = np.array([catch.angle for catch in used])
    values = np.linalg.lstsq(design, angles, rcond=None)[0]
    for _ in range(_ITERATIONS):
        rows = _line_rows(used, values, slowest)
        jacobian = np.concatenate([row.design for row in rows])
        left = np.concatenate([row.target for row in rows])
        values = values + np.linalg.lstsq(jacobian, left, rcond=None)[0]
    fit: ClusteredFit = replace(solve(_line_rows(used, values, slowest)), values=values)
    return Step(
        name=title, estimates=fitted(names, fit, level), residual_sd=fit.residual_sd
    )


def _line_rows(catches: Sequence[Catch], values: _Floats, slowest: float) -> list[Rows]:
    rows = []
    for catch in catches:
        left, by_line, by_slope = line_row(catch, values[0], values[1], slowest)
        design = np.array([[by_line, by_slope]])
        rows.append(Rows(design=design, target=np.array([-left])))
    return rows


def fit_catch_torque(
    catches: Sequence[Catch], levels: Sequence[CatchLevels], *, level: float
) -> tuple[Step, Step]:
    """Fit H to peaks against speed, and Q to residuals against peaks: (3)."""
    peaks = [
        (catch.speed, read.peak)
        for catch, read in zip(catches, levels, strict=True)
        if not math.isnan(read.peak)
    ]
    ratios = [
        (read.peak, read.residual)
        for read in levels
        if not math.isnan(read.residual + read.peak)
    ]
    reason = {"residual_ratio": "no torque was recorded after a peak"}
    return (
        _one("catch torque: H of (3)", "catch_torque_constant", _rows(peaks), level),
        _one(
            "residual torque: Q of (3)", "residual_ratio", _rows(ratios), level, reason
        ),
    )


def _rows(pairs: Sequence[tuple[float, float]]) -> list[Rows]:
    return [Rows(design=np.array([[x]]), target=np.array([y])) for x, y in pairs]


def fit_catch_travel(
    catches: Sequence[Catch], limits: Sequence[DetectionLimit], *, level: float
) -> Step:
    """Average the angle travelled during the catch, ΔT_c·v̄_c of (4): D.

    The mean if all catches end, otherwise where the likelihood of all travels is
    largest, those behind a limit censored there.
    """
    title, name = "catch travel: D of (4)", "catch_travel"
    seen = [catch.travel for catch in catches if catch.end is not None]
    if limits and can_be_censored(seen):
        fit = fit_censored(CensoredTravels.of(seen, limits), level=level)
        estimate = FittedParameter(
            name=name,
            value=fit.mean,
            standard_error=fit.standard_error,
            df=fit.df,
            low=fit.low,
            high=fit.high,
            level=level,
            n_trials=len(seen) + len(limits),
        )
        return Step(name=title, estimates=(estimate,), residual_sd=fit.sd)
    longest = max((catch.travel for catch in catches), default=0.0)
    reason = "no catch ends within its stretch"
    if catches:
        reason += f"; D is more than {math.degrees(longest):.4g} deg"
    return _one(title, name, _rows([(1.0, x) for x in seen]), level, {name: reason})


def can_be_censored(seen: Sequence[float]) -> bool:
    """Return whether the travels that were seen tell how much travels differ."""
    return len(set(seen)) > 1


def fit_post_catch(levels: Sequence[CatchLevels], *, level: float) -> Step:
    """Fit k_post to the torque after the catch: (5)."""
    rows = [read.climb for read in levels if read.climb.design.any()]
    reason = {"post_catch_stiffness": "no stretch goes on after its catch"}
    title = "post-catch: k_post of (5)"
    return _one(title, "post_catch_stiffness", rows, level, reason)


def _one(
    title: str,
    name: str,
    rows: list[Rows],
    level: float,
    reasons: Mapping[str, str] | None = None,
) -> Step:
    if not rows:  # nothing to fit: a value that no row determines
        rows = [Rows(design=np.zeros((1, 1)), target=np.zeros(1))]
    fit = solve(rows)
    return Step(
        name=title,
        estimates=fitted((name,), fit, level, reasons),
        residual_sd=fit.residual_sd,
    )
