"""What resamples are drawn from: items, clusters of items, or raters."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.errors import ParameterError
from masrel.intervals._problem import IntervalProblem, blocks
from masrel.intervals.resampling.lattice import Lattice, lattice_of
from masrel.intervals.resampling.numerators import Integers

__all__ = ["Pool", "cluster_pool", "item_pool", "rater_pool"]

_FEW = 2_000  # rows that are sorted column by column


@dataclass(frozen=True, kw_only=True)
class Pool:
    """Distinct members, of which as many are drawn as there are."""

    # (n_members,): how often each is there
    times: Integers = field(compare=False, repr=False)
    # (n_members, n_features): features of each, where a resample is a sum of them; None
    # for raters
    rows: Floats | None = field(compare=False, repr=False)
    # how often each is drawn, (..., n_members), to sums (..., n_features)
    sums: Callable[[Floats], Floats]
    # sums (..., n_features) to the coefficient (...), ``nan`` where undefined
    values: Callable[[Floats], Floats]

    @cached_property
    def n(self) -> int:
        """How many are drawn."""
        return int(self.times.sum())

    @cached_property
    def lattice(self) -> Lattice | None:
        """The rows as points of a lattice; None where they are none."""
        if self.rows is None:
            return None
        return lattice_of(self.rows, self.shares, self.n)

    @cached_property
    def directions(self) -> tuple[Floats, Floats]:
        """An orthogonal basis of the rows less their mean, and the rows in it."""
        # Shapes (n_directions, n_features) and (n_directions, n_members).
        if self.rows is None:
            raise TypeError("raters have no features")
        centred = self.rows - self.shares @ self.rows
        many = centred.shape[0] > centred.shape[1]
        root = np.linalg.qr(centred, mode="r") if many else centred
        _, sizes, basis = np.linalg.svd(root, full_matrices=False)
        basis = basis[sizes > 1e-10 * max(float(sizes[0]), 1.0)]
        return basis, np.asarray(basis @ centred.T)

    @cached_property
    def shares(self) -> Floats:
        """Probability of each at a draw, (n_members,)."""
        return np.asarray(self.times / self.n)

    def of_counts(self, counts: Floats) -> Floats:
        """Return the coefficient of resamples."""
        # counts (n_resamples, n_members) -> (n_resamples,)
        return self.values(self.sums(counts))

    def without(self) -> Floats:
        """Return the coefficient with one of each member left out, (n_members,)."""
        if self.rows is not None:
            return self.values(self.times @ self.rows - self.rows)
        return self.of_counts(self.times - np.eye(self.times.size))


def item_pool(problem: IntervalProblem) -> Pool:
    """Return the items, those with equal features together."""
    return _pool(problem, problem.rows, problem.freq)


def cluster_pool(
    problem: IntervalProblem, clusters: Sequence[object] | NDArray[Any]
) -> Pool:
    """Return clusters of items, those with equal sums of features together."""
    # Takes clusters (n_items,)
    of, n_clusters = _numbered(problem, clusters)
    codes = problem.coded.codes
    sums = np.zeros((n_clusters, problem.rows.shape[1]))
    for items in blocks(len(codes)):
        rated = np.any(codes[items] >= 0, axis=1)
        block = replace(problem.coded, codes=codes[items][rated])
        np.add.at(sums, of[items][rated], problem.kernel.features(block, problem.v))
    return _pool(problem, sums, np.ones(n_clusters, dtype=np.int64))


def _numbered(
    problem: IntervalProblem, clusters: Sequence[object] | NDArray[Any]
) -> tuple[Integers, int]:
    # number of each item's cluster, -1 without ratings, (n_items,); how many there are
    labels = list(clusters)
    n_items = problem.coded.codes.shape[0]
    if len(labels) != n_items:
        raise ParameterError(
            f"clusters: needs one label for each of {n_items} items, got {len(labels)}"
        )
    rated = np.any(problem.coded.codes >= 0, axis=1).tolist()
    number: dict[object, int] = {}
    try:
        of = np.fromiter(
            (
                number.setdefault(label, len(number)) if is_rated else -1
                for label, is_rated in zip(labels, rated, strict=True)
            ),
            dtype=np.int64,
            count=n_items,
        )
    except TypeError as error:
        raise ParameterError(f"clusters: needs plain labels, {error}") from error
    if any(label is None or label != label for label in number):
        raise ParameterError("clusters: every item needs a label, got a missing one")
    return of, len(number)


def rater_pool(problem: IntervalProblem) -> Pool:
    """Return the raters, of whom none is paired with a copy of itself."""
    fewest, most = problem.entry.n_raters
    if problem.kernel.rater_sums is None or most == fewest:
        raise ParameterError(
            f"target: raters of {problem.entry.title} cannot be resampled without "
            "pairing a rater with a copy of itself"
        )
    return Pool(
        times=np.ones(problem.patterns.codes.shape[1], dtype=np.int64),
        rows=None,
        sums=problem.kernel.rater_sums(problem.patterns, problem.freq, problem.v),
        values=problem.values,
    )


def _pool(problem: IntervalProblem, rows: Floats, times: Integers) -> Pool:
    rows, kind = _distinct(rows)
    return Pool(
        times=np.bincount(kind, weights=times).astype(np.int64),
        rows=rows,
        sums=lambda taken: taken @ rows,
        values=problem.values,
    )


def _distinct(rows: Floats) -> tuple[Floats, Integers]:
    # distinct rows, and which of them each row is
    if len(rows) <= _FEW:
        found, kind = np.unique(rows, axis=0, return_inverse=True)
        return found, kind.ravel()
    # Equal rows have equal polynomials at any place; should different rows too, all
    # are compared column by column.
    key = np.zeros(len(rows))
    for column in rows.T:
        key = key * 0.7390851332151607 + column
    _, first, kind = np.unique(key, return_index=True, return_inverse=True)
    found = rows[first]
    if not all(
        np.array_equal(found[kind[some]], rows[some]) for some in blocks(len(rows))
    ):
        found, kind = np.unique(rows, axis=0, return_inverse=True)
    return found, kind.ravel()
