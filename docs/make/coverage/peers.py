"""Intervals that other packages print for Fleiss' kappa, many studies at once."""

import numpy as np

from docs.make.coverage.bounds import Bounds
from docs.make.coverage.case import Case
from docs.make.coverage.studies import Floats

_NORMAL = 1.959963984540054


def irrcac(case: Case) -> Bounds:
    """irrCAC: Gwet's standard error and t(n - 1), cut at 1; a single point at error 0.

    ``nan`` where kappa is 0/0.
    """
    half = case.t_items * np.maximum(case.spread.error, 1e-15)
    return Bounds(low=case.value - half, high=np.minimum(case.value + half, 1.0))


def null_error(case: Case) -> Bounds:
    """The error under kappa = 0, and the normal.

    R's irr prints the z of that error; whoever makes an interval of it gets this.
    """
    half = _NORMAL * null_standard_error(case)
    return Bounds(low=case.value - half, high=case.value + half)


def null_standard_error(case: Case) -> Floats:
    """Fleiss, Nee and Landis (1979): ratings are drawn at random from the shares."""
    n, r = case.n, case.r
    p = case.studies.counts.sum(axis=1) / (n * r)  # (s, k)
    q = 1.0 - p
    pq = (p * q).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = 2.0 * (pq**2 - (p * q * (q - p)).sum(axis=1))
        return np.asarray(np.sqrt(variance / (n * r * (r - 1) * pq**2)))
