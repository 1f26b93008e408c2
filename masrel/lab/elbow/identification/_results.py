"""What a fit says: parameters with their uncertainty, step by step and together."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from masrel.errors import ParameterError
from masrel.lab.elbow.identification._clusters import ClusteredFit
from masrel.lab.elbow.parameters import ElbowParameters

if TYPE_CHECKING:
    from masrel.lab.elbow.identification._catches import Trial
    from masrel.lab.elbow.identification._lack_of_fit import LackOfFit

_Floats = NDArray[np.float64]


UNDETERMINED = "these trials do not determine it"


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedParameter:
    """One parameter with its confidence interval.

    Attributes
    ----------
    name : str
        Its name in `ElbowParameters`, among what an arm has, or in the friction law.
    value : float
        SI units; ``nan`` when these trials do not determine it.
    standard_error : float
        Clustered by trial; ``nan`` when undefined.
    df : float
        Degrees of freedom of its t.
    low, high : float
        Confidence interval; ``nan`` when undefined.
    level : float
        Its level.
    n_trials : int
        Trials that say something of it.
    reason : str or None
        Why the value or its interval is undefined, or None.
    """

    name: str
    value: float = math.nan
    standard_error: float = math.nan
    df: float = math.nan
    low: float = math.nan
    high: float = math.nan
    level: float
    n_trials: int = 0
    reason: str | None = None

    def covers(self, truth: float) -> bool:
        """Say whether the interval holds a value.

        Parameters
        ----------
        truth : float
            A value, SI units.

        Returns
        -------
        bool
            False when the interval is undefined.
        """
        return self.low <= truth <= self.high


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One of the fits that the source made, on its own.

    Attributes
    ----------
    name : str
        What was fitted.
    estimates : tuple of FittedParameter
        Its parameters.
    residual_sd : float
        Standard deviation of its residuals, in the unit of what was fitted.
    """

    name: str
    estimates: tuple[FittedParameter, ...]
    residual_sd: float

    def __getitem__(self, name: str) -> FittedParameter:
        return next(e for e in self.estimates if e.name == name)


@dataclass(frozen=True, slots=True, kw_only=True)
class ElbowFit:
    """A joint identified from recordings.

    Attributes
    ----------
    estimates : tuple of FittedParameter
        Every parameter, from all trials together: those of the law, in the order of
        the source's equations, and what else of an arm was fitted.
    correlation : ndarray, shape (n_estimates, n_estimates)
        Of the estimates' errors; ``nan`` where one is undefined.
    steps : tuple of Step
        The fits before the last, in their order.
    relative_error : float
        Of slow trials: mean distance of torque from the law of step 1 over mean
        torque, both absolute.
    torque_sd : float
        Standard deviation of torque about the law in all trials, N·m.
    lack_of_fit : LackOfFit
        Whether the law is that of these recordings.
    cross_validation : ndarray, shape (n_trials,)
        Per trial, the mean square distance of its torque from what the other trials'
        parameters give, (N·m)²; ``nan`` where they do not determine one.
    trials : tuple of Trial
        What was used.
    fitted_torque : tuple of ndarray
        Per trial the law's torque at the samples of `pre_catch` and then `after`.
    constants : ElbowParameters
        What was held: ν_th, ν_L, θ_L, ΔT_peak, end of range, reading of (5).
    arm : mapping of str to float or str
        What the arm and the sensor have beside the law: "off", "fitted" or the fixed
        value, SI units.
    offsets, drifts : tuple of float
        Per trial its constant torque (N·m) and what that gains a second (N·m/s).
    n_evaluations : int
        How often the last fit evaluated the law.
    level : float
        Level of the intervals.
    simulated : bool
        Whether any recording is.
    sources : mapping of str to str or None
        Recording to its checksum.
    remarks : tuple of str
        What a reader must know before relying on it.
    """

    estimates: tuple[FittedParameter, ...]
    correlation: _Floats = field(compare=False, repr=False)
    steps: tuple[Step, ...]
    relative_error: float
    torque_sd: float
    lack_of_fit: "LackOfFit"
    cross_validation: _Floats = field(compare=False, repr=False)
    trials: "tuple[Trial, ...]" = field(repr=False)
    fitted_torque: tuple[_Floats, ...] = field(compare=False, repr=False)
    constants: ElbowParameters
    arm: Mapping[str, float | str]
    offsets: tuple[float, ...] = field(repr=False)
    drifts: tuple[float, ...] = field(repr=False)
    n_evaluations: int
    level: float
    simulated: bool
    sources: Mapping[str, str | None]
    remarks: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> FittedParameter:
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        known = ", ".join(e.name for e in self.estimates)
        raise ParameterError(f"name: needs one of {known}, got {name!r}")

    def joint(self, *, missing: ElbowParameters | None = None) -> ElbowParameters:
        """Make the joint of the fitted values.

        Parameters
        ----------
        missing : ElbowParameters, optional
            Where to take what these trials do not determine.

        Returns
        -------
        ElbowParameters
            The fitted values, with `constants` for all that was held. The weight and
            the inertia of the arm and the lag of the sensor are no part of a joint.

        Raises
        ------
        ParameterError
            If a parameter is undetermined and `missing` is not given, or a value is
            none that a joint can have.
        """
        of_joint = {each.name for each in fields(ElbowParameters)}
        values: dict[str, Any] = {}
        rise = self.arm["catch_rise"]
        if not isinstance(rise, str):
            values["catch_rise"] = rise
        for estimate in self.estimates:
            if estimate.name not in of_joint:
                continue
            if not math.isnan(estimate.value):
                values[estimate.name] = estimate.value
            elif missing is not None:
                values[estimate.name] = getattr(missing, estimate.name)
            elif estimate.name not in ("inertia", "catch_rise"):
                raise ParameterError(f"{estimate.name}: {estimate.reason}")
        return replace(self.constants, **values)


def fitted(
    names: Sequence[str],
    fit: ClusteredFit,
    level: float,
    reasons: Mapping[str, str] | None = None,
) -> tuple[FittedParameter, ...]:
    """Return the values of a clustered fit with intervals from t."""
    estimates = []
    for place, name in enumerate(names):
        value = float(fit.values[place])
        error = math.sqrt(max(fit.covariance[place, place], 0.0))
        df = float(fit.df[place])
        half = float(stdtrit(df, 0.5 + 0.5 * level)) * error
        reason = None
        if math.isnan(value):
            reason = (reasons or {}).get(name, UNDETERMINED)
        elif fit.n_trials[place] < 2 or not half > 0.0:
            error = half = df = math.nan
            reason = "an interval by trial needs two trials that differ"
            if fit.n_trials[place] >= 2:
                reason = "these trials fit exactly: an interval needs more that differ"
        estimates.append(
            FittedParameter(
                name=name,
                value=value,
                standard_error=error,
                df=df,
                low=value - half,
                high=value + half,
                level=level,
                n_trials=int(fit.n_trials[place]),
                reason=reason,
            )
        )
    return tuple(estimates)
