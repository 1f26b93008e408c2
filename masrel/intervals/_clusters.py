"""Items that come in clusters, such as sites of a patient: what leaves is a cluster."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._engine import Floats, standard_error
from masrel.agreement._labels import is_missing, is_row
from masrel.errors import ParameterError
from masrel.intervals._problem import Integers, IntervalProblem, blocks


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterSums:
    """The features of items added up over each cluster."""

    sums: Floats = field(compare=False, repr=False)  # (n_clusters, n_features)
    # those that the coefficient knows of, (n_clusters,)
    known: NDArray[np.bool_] = field(compare=False, repr=False)
    n_paired: int  # clusters with a pair of ratings of an item

    @classmethod
    def of(cls, problem: IntervalProblem, codes: Integers) -> "ClusterSums":
        """Add up items whose clusters are numbers from 0."""
        # Takes codes (n_items,)
        n_clusters = int(codes.max(initial=-1)) + 1
        sums = np.zeros((n_clusters, len(problem.sums)))
        paired = np.zeros(n_clusters, dtype=bool)
        known = np.zeros(n_clusters, dtype=bool)
        for block in blocks(len(codes)):
            part = replace(problem.used, codes=problem.used.codes[block])
            features = problem.features(part)
            np.add.at(sums, codes[block], features)
            matters = features.any(axis=1)
            known[codes[block][matters]] = True
            matters &= (part.codes >= 0).sum(axis=1) > 1
            paired[codes[block][matters]] = True
        return cls(sums=sums, known=known, n_paired=int(paired.sum()))

    def values_without(self, problem: IntervalProblem) -> Floats:
        """Return the coefficient without each cluster that it knows of."""
        return problem.values(problem.sums - self.sums[self.known])


def clusters_of(problem: IntervalProblem, clusters: object) -> Integers:
    """Return the cluster of every item, where a question may have clusters."""
    if problem.target != "items":
        raise ParameterError(
            "clusters: what is left out, or drawn anew, is a cluster of items, so "
            f'target "items"; got "{problem.target}"'
        )
    return cluster_codes(clusters, len(problem.coded.codes))


def clustered_error(problem: IntervalProblem, codes: Integers) -> float:
    """Return the delta-method standard error with clusters as the sample."""
    # √[n/(n - 1) Σ_c s_c²], s_c the sum of the influences of a cluster's items:
    # Vanbelle, S. (2017). Comparing dependent kappa coefficients obtained on multilevel
    # data. Biometrical Journal, 59(5), 1016-1034. https://doi.org/10.1002/bimj.201600093
    features = problem.formula.features(problem.used.codes, problem.v)
    of_items = features.dot(problem.slopes(problem.sums))
    moves = np.bincount(codes, weights=of_items).astype(np.float64)
    known = np.unique(codes[features.matters])
    return standard_error(moves[known], np.ones(len(known), dtype=np.int64), None)


def cluster_codes(clusters: object, n_items: int) -> Integers:
    """Return which cluster every item belongs to, as numbers from 0."""
    # -> (n_items,)
    if not is_row(clusters):
        raise ParameterError(
            f"clusters: needs one label an item, got {type(clusters).__name__}"
        )
    labels: Sequence[object] = (
        clusters.tolist() if isinstance(clusters, np.ndarray) else list(clusters)
    )
    if len(labels) != n_items:
        raise ParameterError(
            f"clusters: needs one label an item, {n_items}, got {len(labels)}"
        )
    numbers: dict[Hashable, int] = {}
    codes = np.empty(n_items, dtype=np.int64)
    for item, label in enumerate(labels):
        if is_missing(label) or not isinstance(label, Hashable) or label == "":
            raise ParameterError(
                f"clusters: item {item} needs the label of its cluster, got {label!r}"
            )
        codes[item] = numbers.setdefault(label, len(numbers))
    return codes
