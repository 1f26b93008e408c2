"""What grades can be regressed on: a model's parameters and the stretching speed."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd

from masrel.errors import ParameterError, RatingsError
from masrel.protocol import Protocol, elbow_parameters
from masrel.ratings import Ratings

__all__ = ["PREDICTORS", "independent", "ratings_with"]

PREDICTORS: dict[str, tuple[str, str]] = {
    "L": ("catch_angle_constant_deg", "deg"),
    "H": ("catch_torque_nms_rad", "N·m·s/rad"),
    "Q": ("residual_ratio", "1"),
    "D": ("catch_travel_deg", "deg"),
    "speed": ("mean_speed_deg_s", "deg/s"),
}
"""Predictor to its key of a model, or column of the ratings, and its unit."""


def ratings_with(
    protocol: Protocol,
    ratings: Ratings,
    predictors: Sequence[str],
    models: str,
    session: str | None,
) -> tuple[pd.DataFrame, int]:
    """Put every predictor beside its grade."""
    table = ratings.table
    if session is not None:
        if session not in {s.id for s in protocol.sessions}:
            known = ", ".join(s.id for s in protocol.sessions)
            raise ParameterError(f"session: needs one of {known}, got {session!r}")
        table = table[table["session"] == session]
    asked = {m.id: m for m in protocol.models if models in ("all", m.role)}
    table = table[table["model"].isin(asked)].copy()
    for name in predictors:
        key = PREDICTORS[name][0]
        if name == "speed":
            table[name] = table[key]
        elif name == "Q":  # one meaning, whichever way a model reads its Q
            shares = {m: elbow_parameters(protocol, m).residual_share for m in asked}
            table[name] = [shares[m] for m in table["model"]]
        else:
            table[name] = [float(getattr(asked[m], key)) for m in table["model"]]
    whole = table.dropna(subset=["grade", *predictors])
    return whole, len(table) - len(whole)


def independent(
    table: pd.DataFrame, predictors: Sequence[str]
) -> tuple[list[str], list[tuple[str, str]]]:
    """Keep of the predictors those that are no combination of earlier ones."""
    kept: list[str] = []
    dropped: list[tuple[str, str]] = []
    basis = np.ones((len(table), 1)) / math.sqrt(len(table))
    for name in predictors:
        column = table[name].to_numpy(dtype=np.float64)
        about = column - column.mean()
        left = column - basis @ (basis.T @ column)
        left = left - basis @ (basis.T @ left)
        size = float(np.linalg.norm(column))
        if np.linalg.norm(about) <= 1e-9 * size:
            dropped.append((name, "it is the same in all ratings"))
        elif np.linalg.norm(left) <= 1e-9 * size:
            others = ", ".join(kept)
            dropped.append((name, f"it is a combination of {others} in these ratings"))
        else:
            kept.append(name)
            basis = np.column_stack([basis, left / np.linalg.norm(left)])
    if not kept:
        raise RatingsError(f"predictors: {'; '.join(': '.join(d) for d in dropped)}")
    return kept, dropped
