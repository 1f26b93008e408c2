"""Linear least squares whose errors belong together trial by trial.

The covariance is the bias-reduced cluster-robust one (CR2) of Bell and McCaffrey, with
their degrees of freedom. Matrices are cut into blocks so small that linear algebra
starts no threads, which cost more here than they bring.

References: Bell, R. M., McCaffrey, D. F. (2002). Survey Methodology, 28(2), 169-181.
Pustejovsky, J. E., Tipton, E. (2018). Journal of Business & Economic Statistics,
36(4), 672-683. https://doi.org/10.1080/07350015.2016.1247004
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

# Relative to columns of length 1: below it, a column is a combination of the others.
_RANK_TOLERANCE = 1e-10

_BLOCK = 256  # rows of a block


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """The equations of one trial: design (n_rows, n_parameters), target (n_rows,)."""

    design: _Floats = field(compare=False, repr=False)
    target: _Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusteredFit:
    """Least-squares values, their CR2 covariance, and what each rests on.

    Values that the rows do not determine are ``nan``; `residual_sd` is the root of the
    sum of squares over its degrees of freedom, `n_trials` the trials that say something
    of each parameter.
    """

    values: _Floats = field(compare=False, repr=False)
    covariance: _Floats = field(compare=False, repr=False)
    df: _Floats = field(compare=False, repr=False)
    residual_sd: float
    n_trials: NDArray[np.int64] = field(compare=False, repr=False)


def triangle(table: _Floats) -> _Floats:
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


def partial_out(table: _Floats, n_local: int) -> _Floats:
    """Return rows of a table without what its first `n_own` columns explain.

    Shape (n_columns - n_determined, n_columns - n_own): all that least squares see of a
    trial once its own parameters are eliminated.
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

    `n_own` counts the parameters that were taken out of all trials together.

    A mean of three trials, one row each: s²/n with n - 1 degrees of freedom.

    >>> one = np.ones((1, 1))
    >>> rows = [Rows(design=one, target=np.array([y])) for y in (1.0, 2.0, 6.0)]
    >>> fit = solve(rows)
    >>> [round(float(x), 12) for x in (fit.values[0], fit.df[0])]
    [3.0, 2.0]
    >>> bool(abs(fit.covariance[0, 0] - 7.0 / 3.0) < 1e-12)
    True
    """
    n_rows = sum(t.target.size for t in trials)
    n_parameters = trials[0].design.shape[1]
    trials = [_reduced(t) for t in trials]
    gram = sum((t.design.T @ t.design for t in trials), np.zeros((n_parameters,) * 2))
    keep = _determined(gram)
    values = np.full(n_parameters, np.nan)
    covariance = np.full((n_parameters, n_parameters), np.nan)
    df = np.full(n_parameters, np.nan)
    used = [t.design[:, keep] for t in trials]
    scale = np.sqrt(np.diag(gram)[keep])
    scaled = gram[np.ix_(keep, keep)] / np.outer(scale, scale)
    inverse = np.asarray(np.linalg.inv(scaled)) / np.outer(scale, scale)
    moment = sum(
        (d.T @ t.target for d, t in zip(used, trials, strict=True)),
        np.zeros(int(keep.sum())),
    )
    values[keep] = inverse @ moment
    errors = [t.target - d @ values[keep] for d, t in zip(used, trials, strict=True)]
    if len(trials) > 1:
        block, degrees = _robust(used, errors, inverse)
        covariance[np.ix_(keep, keep)], df[keep] = block, degrees
    squares = sum(float(e @ e) for e in errors)
    spare = n_rows - n_local - int(keep.sum())
    return ClusteredFit(
        values=values,
        covariance=covariance,
        df=df,
        residual_sd=math.sqrt(squares / spare) if spare > 0 else math.nan,
        n_trials=_informed(trials, gram),
    )


def _reduced(rows: Rows) -> Rows:
    # as few equations that say the same
    if rows.target.size <= rows.design.shape[1] + 1:
        return rows
    r = triangle(np.column_stack([rows.design, rows.target]))
    return Rows(design=r[:, :-1], target=r[:, -1])


def _determined(gram: _Floats) -> NDArray[np.bool_]:
    # parameters that no direction without information touches
    scale = np.sqrt(np.diag(gram))
    keep = scale > 0.0
    scaled = gram[np.ix_(keep, keep)] / np.outer(scale[keep], scale[keep])
    sizes, directions = np.linalg.eigh(scaled)
    lost = directions[:, sizes <= _RANK_TOLERANCE * sizes.max(initial=0.0)]
    keep[np.flatnonzero(keep)[(np.abs(lost) > 1e-6).any(axis=1)]] = False
    return np.asarray(keep)


def _informed(trials: Sequence[Rows], gram: _Floats) -> NDArray[np.int64]:
    total = np.diag(gram)
    share = np.array([(t.design**2).sum(axis=0) for t in trials])
    return np.asarray((share > 1e-9 * total).sum(axis=0), dtype=np.int64)


def _robust(
    designs: Sequence[_Floats], errors: Sequence[_Floats], inverse: _Floats
) -> tuple[_Floats, _Floats]:
    # CR2: V = M (Σ X'A e e' A X) M with M = (X'X)⁻¹ and A = (I - H_gg)^(-1/2)
    adjusted = [_adjustment(x, inverse) for x in designs]  # X'(I - XMX')^(-1/2)
    scores = np.array([a @ e for a, e in zip(adjusted, errors, strict=True)])
    covariance = inverse @ (scores.T @ scores) @ inverse
    df = np.empty(inverse.shape[0])
    for place in range(inverse.shape[0]):
        # V = Σ (w_g'e)²; under e ~ N(0, I) its moments are those of G = W'(I - H)W,
        # matched to a χ² of (tr G)²/tr(G²) degrees
        weights = [a.T @ inverse[:, place] for a in adjusted]
        sides = np.array([x.T @ w for x, w in zip(designs, weights, strict=True)])
        matrix = np.diag([float(w @ w) for w in weights])
        matrix = matrix - sides @ inverse @ sides.T
        squares = float((matrix**2).sum())
        # as many trials as parameters fit exactly: nothing is left to differ
        df[place] = np.trace(matrix) ** 2 / squares if squares else math.nan
    return covariance, df


def _adjustment(design: _Floats, inverse: _Floats) -> _Floats:
    inside = np.eye(design.shape[0]) - design @ inverse @ design.T
    sizes, directions = np.linalg.eigh(0.5 * (inside + inside.T))
    # A trial that alone determines a direction has no error along it: generalized
    # inverse, as Pustejovsky and Tipton have it.
    safe = sizes > 1e-10
    roots = np.where(safe, 1.0 / np.sqrt(np.where(safe, sizes, 1.0)), 0.0)
    return np.asarray(design.T @ (directions * roots) @ directions.T)


def left_out_steps(trials: Sequence[Rows]) -> list[_Floats]:
    """Return per trial what its rows move the fit by, were they left out.

    The fit of all trials is at 0: -(X'X)⁻¹X_g'(I - H_gg)⁻¹e_g; ``nan`` of a trial that
    alone determines something.
    """
    n_parameters = trials[0].design.shape[1]
    gram = sum((t.design.T @ t.design for t in trials), np.zeros((n_parameters,) * 2))
    inverse = np.linalg.pinv(gram, rcond=1e-13, hermitian=True)
    steps = []
    for rows in trials:
        inside = np.eye(rows.target.size) - rows.design @ inverse @ rows.design.T
        step = np.full(n_parameters, np.nan)
        if np.linalg.eigvalsh(0.5 * (inside + inside.T)).min() > 1e-10:
            errors = np.linalg.solve(inside, rows.target)
            step = -(inverse @ (rows.design.T @ errors))
        steps.append(step)
    return steps
