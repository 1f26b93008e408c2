"""Models between others: the dummies that hide a study's standards."""

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ParameterError

__all__ = ["intermediate_models"]


def intermediate_models(
    models: Mapping[str, ElbowParameters], n_models: int
) -> dict[str, ElbowParameters]:
    """Put models at even steps between neighbours.

    Parameters
    ----------
    models : mapping of str to ElbowParameters
        Two or more, mildest first: their order says who is whose neighbour.
    n_models : int
        How many to make; the same number in every gap.

    Returns
    -------
    dict of str to ElbowParameters
        ``D01``, ``D02`` and so on. Of n in a gap, the i-th is i/(n + 1) of the way,
        every number interpolated linearly: L, H, Q and D, and what else differs.

    Raises
    ------
    ParameterError
        If there are less than two models, `n_models` does not divide evenly among
        the gaps, or neighbours read (5) differently.

    Examples
    --------
    The paper's design, four standards and twelve dummies, 4 in each of 3 gaps:

    >>> from masrel.elbow import STANDARD_MODELS
    >>> made = intermediate_models(STANDARD_MODELS, 12)
    >>> len(made), round(made["D01"].catch_torque_constant, 6)  # 1.4 + 0.6/5
    (12, 1.52)
    """
    gaps = len(models) - 1
    if gaps < 1:
        raise ParameterError(f"models: need two or more, got {len(models)}")
    if n_models < gaps or n_models % gaps:
        raise ParameterError(
            f"n_models: needs a multiple of {gaps}, one or more in each gap, "
            f"got {n_models}"
        )
    each = n_models // gaps
    names = list(models)
    made = []
    for first, second in pairwise(names):
        _check_alike(first, models[first], second, models[second])
        for i in range(1, each + 1):
            made.append(_between(models[first], models[second], i, each + 1))
    digits = max(2, int(math.log10(n_models)) + 1)
    return {f"D{i:0{digits}}": model for i, model in enumerate(made, start=1)}


def _between(
    one: ElbowParameters, two: ElbowParameters, part: int, whole: int
) -> ElbowParameters:
    values: dict[str, Any] = {}
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if isinstance(a, float) and isinstance(b, float) and a != b:
            values[field.name] = ((whole - part) * a + part * b) / whole
    return replace(one, **values)


def _check_alike(
    name: str, one: ElbowParameters, other: str, two: ElbowParameters
) -> None:
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if a != b and not (isinstance(a, float) and isinstance(b, float)):
            raise ParameterError(
                f"models: {name} and {other} need one {field.name}, got {a!r} and {b!r}"
            )
