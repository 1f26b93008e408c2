"""Every resample there is, each once with its probability."""

import math

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats

__all__ = ["compositions", "n_compositions"]


def n_compositions(n: int, n_members: int) -> int:
    """Count the distinct resamples of n draws."""
    return math.comb(n + n_members - 1, n_members - 1)


def compositions(n: int, shares: Floats) -> tuple[NDArray[np.int32], Floats]:
    """Enumerate the distinct resamples of n draws."""
    # shares (n_members,) -> (n_resamples, n_members), (n_resamples,)
    # In logs, so that no n over- or underflows: Σ t log share - log t!.
    steps = np.log(np.maximum(np.arange(n + 1), 1))
    factorials = np.cumsum(steps, dtype=np.longdouble).astype(np.float64)
    left = np.array([n], dtype=np.int32)
    logs = np.array([factorials[n]])
    columns: list[NDArray[np.int32]] = []
    for share in shares[:-1]:
        ways = left + 1
        parent = np.repeat(np.arange(left.size), ways)
        first = np.cumsum(ways) - ways
        taken = (np.arange(parent.size) - first[parent]).astype(np.int32)
        columns = [column[parent] for column in columns] + [taken]
        left = left[parent] - taken
        logs = logs[parent] + (taken * math.log(share) - factorials[taken])
    logs = logs + (left * math.log(shares[-1]) - factorials[left])
    return np.column_stack([*columns, left]), np.exp(logs)
