"""What a fit comes to: every estimate, how their errors go together, what to know."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.horizon import Horizon
from masrel.elbow.identification.quantities import QUANTITIES
from masrel.elbow.identification.results import FittedParameter, Step, fitted
from masrel.elbow.identification.together import Together
from masrel.elbow.identification.trials import Trial

__all__ = ["all_estimates", "correlation", "remarks", "unfound"]

Floats = NDArray[np.float64]

_FIRST = ("damping", "stiffness", "inertia")


def unfound(steps: Sequence[Step], fast: Sequence[Trial]) -> dict[str, str]:
    """Say of what the steps did not find why they did not.

    Parameters
    ----------
    steps : sequence of Step
        The steps.
    fast : sequence of Trial
        Fast trials, with a catch or without.

    Returns
    -------
    dict of str to str
        Parameter to reason.
    """
    if all(trial.catch is None for trial in fast):
        why = "there are only slow stretches, in which nothing catches"
        if fast:
            why = "no fast stretch has a catch that can be used"
        return {name: why for name in QUANTITIES if name not in _FIRST}
    return {
        estimate.name: estimate.reason
        for step in steps
        for estimate in step.estimates
        if estimate.reason is not None
    }


def all_estimates(
    last: Together,
    steps: Sequence[Step],
    horizons: Sequence[Horizon | None],
    reasons: Mapping[str, str],
    level: float,
) -> tuple[FittedParameter, ...]:
    """Give every parameter its interval, or the reason why it has none.

    Parameters
    ----------
    last : Together
        The last fit.
    steps : sequence of Step
        The fits before it.
    horizons : sequence of Horizon or None
        Behind which of its trials' catches end that do not end before.
    reasons : mapping of str to str
        Why a parameter is not in it.
    level : float
        Level of the intervals.

    Returns
    -------
    tuple of FittedParameter
        In the order of `QUANTITIES`; inertia only if it was fitted.

    Notes
    -----
    Where travels are censored, D is that of its step. Least squares hold the spread
    of travels and know less than they say; and they draw each end towards D, by which
    that spread would come out too small.
    """
    found = {e.name: e for e in fitted(last.names, last.fit, level, reasons)}
    if any(each is not None for each in horizons):
        whole = {e.name: e for step in steps for e in step.estimates}
        found["catch_travel"] = whole["catch_travel"]
    return tuple(
        found[name] if name in found else _undetermined(name, reasons.get(name), level)
        for name in QUANTITIES
        if name in found or name != "inertia"
    )


def _undetermined(name: str, reason: str | None, level: float) -> FittedParameter:
    nan = math.nan
    return FittedParameter(
        name=name,
        value=nan,
        standard_error=nan,
        freedom=nan,
        low=nan,
        high=nan,
        level=level,
        n_trials=0,
        reason=reason or "these trials do not determine it",
    )


def correlation(last: Together, estimates: Sequence[FittedParameter]) -> Floats:
    """Correlate the errors of estimates.

    Parameters
    ----------
    last : Together
        The last fit.
    estimates : sequence of FittedParameter
        What is to be correlated, in order.

    Returns
    -------
    ndarray, shape (n_estimates, n_estimates)
        From the clustered covariance; ``nan`` where one is undefined.
    """
    places = [
        last.names.index(e.name) if e.name in last.names else -1 for e in estimates
    ]
    sd = np.sqrt(np.diag(last.fit.covariance))
    whole = np.full((len(sd) + 1, len(sd) + 1), np.nan)
    with np.errstate(invalid="ignore"):
        whole[:-1, :-1] = last.fit.covariance / np.outer(sd, sd)
    return whole[np.ix_(places, places)]


def remarks(
    estimates: Sequence[FittedParameter],
    catches: Sequence[Catch],
    horizons: Sequence[Horizon | None],
    fast: Sequence[Trial],
) -> tuple[str, ...]:
    """Say what a reader must know before relying on a fit.

    Parameters
    ----------
    estimates : sequence of FittedParameter
        Its estimates.
    catches : sequence of Catch
        All catches.
    horizons : sequence of Horizon or None
        Behind which of them catches end that do not end before.
    fast : sequence of Trial
        All fast trials.

    Returns
    -------
    tuple of str
        One sentence a matter.
    """
    said = [
        f"{QUANTITIES[e.name].symbol}: {e.reason}"
        for e in estimates
        if e.reason is not None
    ]
    unended = sum(catch.end is None for catch in catches)
    if 0 < unended < len(catches):
        behind = sum(each is not None for each in horizons)
        said += _unended(unended, behind, len(catches))
    unused = sum(trial.catch is None for trial in fast)
    if unused:
        said.append(f"{unused} of {len(fast)} fast stretches are not used")
    return tuple(said)


def _unended(unended: int, behind: int, n_catches: int) -> list[str]:
    said = []
    if behind:
        said.append(
            f"{behind} of {n_catches} catches do not end within their stretch: D "
            "counts each as longer than what could be seen of it (censored), and "
            "takes travels to be normal"
        )
    if behind < unended:
        said.append(
            f"{unended - behind} of {n_catches} catches do not end within their "
            "stretch and say nothing of D: if D differs between trials, those with a "
            "short one are left, and D is underestimated"
        )
    return said
