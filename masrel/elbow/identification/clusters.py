"""Linear least squares whose errors belong together trial by trial.

The covariance is the bias-reduced cluster-robust one (CR2) of Bell and McCaffrey,
with their degrees of freedom; what is a trial's own is taken out of it first.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["ClusteredFit", "Rows", "solve", "without_own"]

Floats = NDArray[np.float64]

RANK_TOLERANCE = 1e-10
"""Relative to the largest singular value of columns of length 1: below it, a column
is a combination of the others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """The equations of one trial.

    Attributes
    ----------
    design : ndarray, shape (n_rows, n_parameters)
        What multiplies the shared parameters.
    target : ndarray, shape (n_rows,)
        What they are to give.
    """

    design: Floats = field(compare=False, repr=False)
    target: Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusteredFit:
    """Least-squares values with their clustered covariance.

    Attributes
    ----------
    values : ndarray, shape (n_parameters,)
        The values; ``nan`` where the rows do not determine them.
    covariance : ndarray, shape (n_parameters, n_parameters)
        CR2; ``nan`` for what is not determined, and with one trial.
    freedom : ndarray, shape (n_parameters,)
        Degrees of freedom of each value's t.
    residual_sd : float
        Root of the residual sum of squares over its degrees of freedom.
    n_trials : ndarray of int, shape (n_parameters,)
        Trials that say something of each parameter.
    """

    values: Floats = field(compare=False, repr=False)
    covariance: Floats = field(compare=False, repr=False)
    freedom: Floats = field(compare=False, repr=False)
    residual_sd: float
    n_trials: NDArray[np.int64] = field(compare=False, repr=False)


def without_own(own: Floats, design: Floats, target: Floats) -> Rows:
    """Take out of a trial's rows what its own parameters explain.

    Parameters
    ----------
    own : ndarray, shape (n_rows, n_own)
        What multiplies the parameters of this trial alone.
    design : ndarray, shape (n_rows, n_parameters)
        What multiplies the shared ones.
    target : ndarray, shape (n_rows,)
        What they are to give.

    Returns
    -------
    Rows
        What is left of design and target at right angles to `own`.
    """
    basis, triangle = np.linalg.qr(own)
    scale = np.linalg.norm(own, axis=0)
    basis = basis[:, np.abs(np.diag(triangle)) > RANK_TOLERANCE * scale]
    left = design - basis @ (basis.T @ design)
    # What is left of a column that they explain whole is rounding, and no witness.
    size = np.linalg.norm(design, axis=0)
    left[:, np.linalg.norm(left, axis=0) <= RANK_TOLERANCE * size] = 0.0
    return Rows(design=left, target=target - basis @ (basis.T @ target))


def solve(trials: Sequence[Rows], *, n_own: int = 0) -> ClusteredFit:
    """Fit the shared parameters by least squares.

    Parameters
    ----------
    trials : sequence of Rows
        The rows of every trial.
    n_own : int, optional
        How many parameters were taken out of all trials together.

    Returns
    -------
    ClusteredFit
        Values, covariance and degrees of freedom.

    References
    ----------
    .. [1] Bell, R. M., McCaffrey, D. F. (2002). Bias reduction in standard errors
       for linear regression with multi-stage samples. Survey Methodology, 28(2),
       169-181.
    .. [2] Pustejovsky, J. E., Tipton, E. (2018). Small-sample methods for
       cluster-robust variance estimation. Journal of Business & Economic
       Statistics, 36(4), 672-683. https://doi.org/10.1080/07350015.2016.1247004

    Examples
    --------
    A mean of three trials, one row each: s²/n with n - 1 degrees of freedom.

    >>> one = np.ones((1, 1))
    >>> rows = [Rows(design=one, target=np.array([y])) for y in (1.0, 2.0, 6.0)]
    >>> fit = solve(rows)
    >>> [round(float(x), 12) for x in (fit.values[0], fit.freedom[0])]
    [3.0, 2.0]
    >>> bool(abs(fit.covariance[0, 0] - 7.0 / 3.0) < 1e-12)
    True
    """
    triangles, shares, left_over = _reduced(trials)
    gram = sum((r.T @ r for r in triangles), np.zeros((triangles[0].shape[1],) * 2))
    keep = _determined(gram)
    n_parameters = gram.shape[0]
    values = np.full(n_parameters, np.nan)
    covariance = np.full((n_parameters, n_parameters), np.nan)
    freedom = np.full(n_parameters, np.nan)
    used = [triangle[:, keep] for triangle in triangles]
    inverse = np.asarray(np.linalg.inv(gram[np.ix_(keep, keep)]), dtype=np.float64)
    moment = sum(
        (r.T @ s for r, s in zip(used, shares, strict=True)), np.zeros(keep.sum())
    )
    values[keep] = inverse @ moment
    errors = [s - r @ values[keep] for r, s in zip(used, shares, strict=True)]
    if len(trials) > 1:
        block, degrees = _robust(used, errors, inverse)
        covariance[np.ix_(keep, keep)], freedom[keep] = block, degrees
    squares = left_over + sum(float(e @ e) for e in errors)
    n_rows = sum(rows.target.size for rows in trials)
    spare = n_rows - n_own - int(keep.sum())
    return ClusteredFit(
        values=values,
        covariance=covariance,
        freedom=freedom,
        residual_sd=math.sqrt(squares / spare) if spare > 0 else math.nan,
        n_trials=_informed(triangles, gram),
    )


def _reduced(trials: Sequence[Rows]) -> tuple[list[Floats], list[Floats], float]:
    # X = QR: all that the fit sees of a trial is R and Q'y, and what is left of y
    triangles, shares, left_over = [], [], 0.0
    for rows in trials:
        basis, triangle = np.linalg.qr(rows.design)
        share = basis.T @ rows.target
        triangles.append(triangle)
        shares.append(share)
        rest = rows.target - basis @ share
        left_over += float(rest @ rest)
    return triangles, shares, left_over


def _determined(gram: Floats) -> NDArray[np.bool_]:
    # parameters that no direction without information touches
    scale = np.sqrt(np.diag(gram))
    keep = scale > 0.0
    scaled = gram[np.ix_(keep, keep)] / np.outer(scale[keep], scale[keep])
    sizes, directions = np.linalg.eigh(scaled)
    # squared: the Gram matrix has the squares of the singular values
    lost = directions[:, sizes <= RANK_TOLERANCE * sizes.max(initial=0.0)]
    keep[np.flatnonzero(keep)[(np.abs(lost) > 1e-6).any(axis=1)]] = False
    return keep


def _informed(triangles: Sequence[Floats], gram: Floats) -> NDArray[np.int64]:
    total = np.diag(gram)
    own = np.array([(r**2).sum(axis=0) for r in triangles])
    return np.asarray((own > 1e-9 * total).sum(axis=0), dtype=np.int64)


def _robust(
    triangles: Sequence[Floats], errors: Sequence[Floats], inverse: Floats
) -> tuple[Floats, Floats]:
    # CR2 of [1]: V = M (Σ X'A e e' A X) M with A = (I - H_gg)^(-1/2), all of which
    # acts within the span of Q, where H_gg is R M R'
    adjusted = [_adjustment(r, inverse) for r in triangles]  # R'(I - RMR')^(-1/2)
    scores = np.array([a @ e for a, e in zip(adjusted, errors, strict=True)])
    covariance = inverse @ (scores.T @ scores) @ inverse
    freedom = np.empty(inverse.shape[0])
    for place in range(inverse.shape[0]):
        # V = Σ (u_g'e)² with u_g = Q w_g; under e ~ N(0, I) its moments are those of
        # G = U'(I - H)U, matched to a χ² of (tr G)²/tr(G²) degrees
        weights = [a.T @ inverse[:, place] for a in adjusted]  # w_g
        sides = np.array([r.T @ w for r, w in zip(triangles, weights, strict=True)])
        matrix = np.diag([float(w @ w) for w in weights])
        matrix = matrix - sides @ inverse @ sides.T
        squares = float((matrix**2).sum())
        # as many trials as parameters fit exactly: nothing is left to differ
        freedom[place] = np.trace(matrix) ** 2 / squares if squares else math.nan
    return covariance, freedom


def _adjustment(triangle: Floats, inverse: Floats) -> Floats:
    inside = np.eye(triangle.shape[0]) - triangle @ inverse @ triangle.T
    sizes, directions = np.linalg.eigh(0.5 * (inside + inside.T))
    # A trial that alone determines a direction has no error along it: generalized
    # inverse, as [2] has it.
    safe = sizes > 1e-10
    roots = np.where(safe, 1.0 / np.sqrt(np.where(safe, sizes, 1.0)), 0.0)
    return np.asarray(triangle.T @ (directions * roots) @ directions.T)
