"""Linear least squares whose errors belong together trial by trial.

The covariance is the bias-reduced cluster-robust one (CR2) of Bell and McCaffrey, with
their degrees of freedom. Matrices are cut into blocks so small that linear algebra
starts no threads, which cost more here than they bring.

References: Bell, R. M., McCaffrey, D. F. (2002). Survey Methodology, 28(2), 169-181.
Pustejovsky, J. E., Tipton, E. (2018). Journal of Business & Economic Statistics,
36(4), 672-683. https://doi.org/10.1080/07350015.2016.1247004
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from masrel.lab.elbow.motions import Floats

# Relative to columns of length 1: below it, a column is a combination of the others.
_RANK_TOLERANCE = 1e-10

_BLOCK = 256  # rows of a block


class Rows(NamedTuple):
    """The equations of one trial: design (n_rows, n_parameters), target (n_rows,)."""

    design: Floats
    target: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusteredFit:
    """Least-squares values, their CR2 covariance, and what each rests on.

    Values that the rows do not determine are ``nan``; `residual_sd` is the root of the
    sum of squares over its degrees of freedom, `n_trials` the trials that say something
    of each parameter.
    """

    values: Floats = field(compare=False, repr=False)
    covariance: Floats = field(compare=False, repr=False)
    df: Floats = field(compare=False, repr=False)
    residual_sd: float
    n_trials: NDArray[np.int64] = field(compare=False, repr=False)


def triangle(table: Floats) -> Floats:
    """Return R of a tall table's QR, shape (n_columns, n_columns) or less.

    It is found block by block: R of the blocks' R's is that of the table.
    """
    while table.shape[0] > _BLOCK:
        n_blocks = -(-table.shape[0] // _BLOCK)
        padded = np.zeros((n_blocks * _BLOCK, table.shape[1]))
        padded[: table.shape[0]] = table
        blocks = padded.reshape(n_blocks, _BLOCK, table.shape[1])
        stacked = np.asarray(np.linalg.qr(blocks, mode="r"), dtype=np.float64)
        table = stacked.reshape(-1, table.shape[1])
    return np.asarray(np.linalg.qr(table, mode="r"), dtype=np.float64)


def partial_out(table: Floats, n_local: int) -> Floats:
    """Return rows of a table without what its first `n_local` columns explain.

    Shape (n_columns - n_determined, n_columns - n_local): all that least squares see of
    a trial once its own parameters are eliminated.
    """
    size = np.linalg.norm(table, axis=0)
    r = triangle(table)
    if r.shape[0] < r.shape[1]:  # fewer rows than columns
        r = np.concatenate([r, np.zeros((r.shape[1] - r.shape[0], r.shape[1]))])
    explained = np.zeros(r.shape[0], dtype=np.bool_)
    local = np.abs(np.diag(r)[:n_local]) > _RANK_TOLERANCE * size[:n_local]
    explained[:n_local] = local
    rest = r[~explained, n_local:]
    # What is left of a column that they explain whole is rounding, and no witness.
    left = np.linalg.norm(rest, axis=0)
    rest[:, left <= _RANK_TOLERANCE * size[n_local:]] = 0.0
    return np.asarray(rest)


def solve(trials: Sequence[Rows], *, n_local: int = 0) -> ClusteredFit:
    """Fit the shared parameters by least squares.

    `n_local` counts the parameters that were taken out of all trials together.

    A mean of three trials, one row each: s²/n with n - 1 degrees of freedom.

    >>> one = np.ones((1, 1))
    >>> rows = [Rows(one, np.array([y])) for y in (1.0, 2.0, 6.0)]
    >>> fit = solve(rows)
    >>> [round(float(x), 12) for x in (fit.values[0], fit.df[0])]
    [3.0, 2.0]
    >>> bool(abs(fit.covariance[0, 0] - 7.0 / 3.0) < 1e-12)
    True
    """
    n_rows = sum(t.target.size for t in trials)
    x, y = _stacked(trials)
    gram = np.einsum("gri,grj->ij", x, x)
    keep = _determined(gram)
    values, df = np.full((2, keep.size), np.nan)
    covariance = np.full((keep.size, keep.size), np.nan)
    used, scale = x[..., keep], np.sqrt(np.diag(gram)[keep])
    scaled = gram[np.ix_(keep, keep)] / np.outer(scale, scale)
    inverse = np.linalg.inv(scaled) / np.outer(scale, scale)
    values[keep] = inverse @ np.einsum("gri,gr->i", used, y)
    errors = y - used @ values[keep]
    if len(trials) > 1:
        covariance[np.ix_(keep, keep)], df[keep] = _robust(used, errors, inverse)
    spare = n_rows - n_local - int(keep.sum())
    squares = float((errors**2).sum())
    return ClusteredFit(
        values=values,
        covariance=covariance,
        df=df,
        residual_sd=math.sqrt(squares / spare) if spare > 0 else math.nan,
        n_trials=((x**2).sum(axis=1) > 1e-9 * np.diag(gram)).sum(axis=0),
    )


def _stacked(trials: Sequence[Rows]) -> tuple[Floats, Floats]:
    # designs (n_trials, n_rows, n_parameters) and targets (n_trials, n_rows) of as few
    # rows that say the same, zeros where a trial has fewer
    n = trials[0].design.shape[1] + 1
    stacked = np.zeros((len(trials), n, n))
    for place, trial in enumerate(trials):
        r = triangle(np.column_stack([trial.design, trial.target]))
        stacked[place, : r.shape[0]] = r
    return stacked[..., :-1], stacked[..., -1]


def _determined(gram: Floats) -> NDArray[np.bool_]:
    # parameters that no direction without information touches
    scale = np.sqrt(np.diag(gram))
    keep = scale > 0.0
    scaled = gram[np.ix_(keep, keep)] / np.outer(scale[keep], scale[keep])
    sizes, directions = np.linalg.eigh(scaled)
    lost = directions[:, sizes <= _RANK_TOLERANCE * sizes.max(initial=0.0)]
    keep[np.flatnonzero(keep)[(np.abs(lost) > 1e-6).any(axis=1)]] = False
    return np.asarray(keep)


def _outside(x: Floats, inverse: Floats) -> tuple[Floats, Floats, Floats]:
    # I - H of every trial, (n_trials, n_rows, n_rows), its eigenvalues and -vectors
    matrix = np.eye(x.shape[1]) - x @ inverse @ x.transpose(0, 2, 1)
    sizes, directions = np.linalg.eigh(0.5 * (matrix + matrix.transpose(0, 2, 1)))
    return matrix, sizes, directions


def _robust(x: Floats, errors: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    # CR2: V = M (Σ X'A e e' A X) M with M = (X'X)⁻¹ and A = (I - H_gg)^(-1/2). A trial
    # that alone determines a direction has no error along it: generalized inverse, as
    # Pustejovsky and Tipton have it.
    _, sizes, directions = _outside(x, inverse)
    safe = sizes > 1e-10
    roots = np.where(safe, 1.0 / np.sqrt(np.where(safe, sizes, 1.0)), 0.0)
    # A X M: (n_trials, n_rows, n_parameters)
    weights = (
        (directions * roots[:, None]) @ directions.transpose(0, 2, 1) @ x @ inverse
    )
    scores = np.einsum("gri,gr->gi", weights, errors)
    # V = Σ (w_g'e)²; under e ~ N(0, I) its moments are those of G = W'(I - H)W, matched
    # to a χ² of (tr G)²/tr(G²) degrees
    sides = np.einsum("gri,grk->kgi", x, weights)
    matrices = -sides @ inverse @ sides.transpose(0, 2, 1)  # (n_parameters, n, n)
    trial = np.arange(len(x))
    matrices[:, trial, trial] += (weights**2).sum(axis=1).T
    squares = (matrices**2).sum(axis=(1, 2))
    traces = np.trace(matrices, axis1=1, axis2=2)
    # as many trials as parameters fit exactly: nothing is left to differ
    known = squares > 0.0
    df = np.where(known, traces**2 / np.where(known, squares, 1.0), np.nan)
    return scores.T @ scores, df


def left_out_steps(trials: Sequence[Rows]) -> Floats:
    """Return per trial what its rows move the fit by, were they left out.

    The fit of all trials is at 0: -(X'X)⁻¹X_g'(I - H_gg)⁻¹e_g; ``nan`` of a trial that
    alone determines something.
    """
    x, y = _stacked(trials)
    inverse = np.linalg.pinv(
        np.einsum("gri,grj->ij", x, x), rcond=1e-13, hermitian=True
    )
    matrix, sizes, _ = _outside(x, inverse)
    determined = sizes.min(axis=1) > 1e-10
    steps = np.full((len(trials), x.shape[2]), np.nan)
    errors = np.linalg.solve(matrix[determined], y[determined][..., None])[..., 0]
    steps[determined] = -np.einsum("gri,gr->gi", x[determined], errors) @ inverse
    return steps


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
            reason = (
                "an interval by trial needs two trials that differ"
                if fit.n_trials[place] < 2
                else "these trials fit exactly; an interval needs trials that differ"
            )
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
