"""Which of what an arm may have makes a fit better: cross-validation over trials."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from masrel.errors import MasrelError, RecordingWarning, SmallSampleWarning
from masrel.lab.elbow.identification._identify import fit
from masrel.lab.elbow.identification._reading import Movement, read_movement
from masrel.lab.elbow.identification._results import ElbowFit

TERMS = ("gravity", "arm_inertia", "drift", "lag", "rise")
"""Options of `fit` that are tried, each alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedFit:
    """One fit of a comparison.

    Attributes
    ----------
    fitted : tuple of str
        What is fitted of the arm.
    fit : ElbowFit or None
        The fit; None if there is none.
    reason : str or None
        Why there is none.
    error : float
        Root mean square distance of a trial's torque from what the parameters of all
        other trials give, N·m.
    worse : float
        Mean over trials of the squared distance less that of the best fit, (N·m)².
    worse_se : float
        Standard error of that, over trials; 0 for the best.
    is_chosen : bool
        Whether no fit with less of an arm is within one standard error of the best.
    """

    fitted: tuple[str, ...]
    fit: ElbowFit | None
    reason: str | None
    error: float
    worse: float
    worse_se: float
    is_chosen: bool


def compare_fits(
    recordings: Sequence[Movement | Path | str], **options: Any
) -> tuple[ComparedFit, ...]:
    """Fit with each thing that an arm may have, and predict each trial from the others.

    Parameters
    ----------
    recordings : sequence of Movement or path
        Slow and fast stretches, as for `fit`.
    **options
        Those of `fit`. What is fitted or fixed there is so in every fit.

    Returns
    -------
    tuple of ComparedFit
        The fit with these options first, then with one thing more of the arm each.
        A trial left out keeps its own constant, peak, residual and travel; what the
        others say of it is reckoned as linear as the equations are at the fit. The
        number of trials that all fits use is what is compared.

    Raises
    ------
    ParameterError
        If an option is outside its range.
    RecordingError
        If the first fit is refused.
    """
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    fits: list[tuple[tuple[str, ...], ElbowFit | None, str | None]] = [
        ((), fit(movements, **options), None)
    ]
    with warnings.catch_warnings():  # the first fit said them
        warnings.simplefilter("ignore", RecordingWarning)
        warnings.simplefilter("ignore", SmallSampleWarning)
        for term in TERMS:
            if options.get(term, "off") == "off":
                fits.append(_with(term, movements, options))
    return _compared(fits)


def _with(
    term: str, movements: Sequence[Movement], options: dict[str, Any]
) -> tuple[tuple[str, ...], ElbowFit | None, str | None]:
    try:
        return (term,), fit(movements, **{**options, term: "fitted"}), None
    except MasrelError as error:
        return (term,), None, str(error)


def _compared(
    fits: Sequence[tuple[tuple[str, ...], ElbowFit | None, str | None]],
) -> tuple[ComparedFit, ...]:
    squares = [_by_trial(made) if made is not None else {} for _, made, _ in fits]
    common = set.intersection(*(set(each) for each in squares if each))
    order = sorted(common)
    table = [np.array([each.get(name, math.nan) for name in order]) for each in squares]
    means = [float(row.mean()) if row.size else math.nan for row in table]
    best = int(np.nanargmin(means)) if np.isfinite(means).any() else 0
    compared, is_open = [], True
    for (terms, made, reason), row, mean in zip(fits, table, means, strict=True):
        more = row - table[best]
        se = math.nan
        if more.size > 1:
            se = float(more.std(ddof=1)) / math.sqrt(more.size)
        worse = mean - means[best]
        # fits with fewer terms come first
        chosen = is_open and bool(worse <= se)
        is_open &= not chosen
        compared.append(
            ComparedFit(
                fitted=terms,
                fit=made,
                reason=reason,
                error=math.sqrt(mean) if mean >= 0.0 else math.nan,
                worse=worse,
                worse_se=se,
                is_chosen=chosen,
            )
        )
    return tuple(compared)


def _by_trial(made: ElbowFit) -> dict[str, float]:
    names = [trial.name for trial in made.trials]
    pairs = zip(names, made.cross_validation.tolist(), strict=True)
    return {name: value for name, value in pairs if math.isfinite(value)}
