"""Estimates that were computed before, by their data and all that is asked of them."""

import dataclasses
import json
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from masrel import errors
from masrel.errors import MasrelWarning
from masrel.estimates import Distribution, Estimate, Interval
from masrel.lab._cache import Cache, installed

_cache: ContextVar[Cache] = ContextVar("_cache")
_SAMPLERS = ("emcee", "arviz-stats")


@contextmanager
def estimates_known(cache: Cache) -> Iterator[None]:
    """Within it, no estimate is computed that a cache has."""
    token = _cache.set(cache)
    try:
        yield
    finally:
        _cache.reset(token)


def known_estimate(compute: Callable[[], Estimate], *read: object) -> Estimate:
    """Return what `compute` makes of all that it reads, with its warnings."""
    cache = _cache.get(None)
    if cache is None:
        return compute()
    samplers = [installed().get(name) for name in _SAMPLERS]
    key = cache.key("estimate", *read, samplers, libraries=("numpy", "scipy"))
    parts = cache.read(key)
    if parts is not None:
        estimate, messages = _of_parts(parts)
        for category, message in messages:
            warnings.warn(message, getattr(errors, category), stacklevel=2)
        return estimate
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        estimate = compute()
        _ = estimate.standard_error  # it is kept, too
    for each in caught:
        warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)
    if all(_is_ours(each.category) for each in caught):
        messages = [(each.category.__name__, str(each.message)) for each in caught]
        cache.write(key, _parts(estimate, messages))
    return estimate


def _is_ours(category: type[Warning]) -> bool:
    is_masrels = issubclass(category, MasrelWarning)
    return is_masrels and getattr(errors, category.__name__, None) is category


def _parts(estimate: Estimate, messages: list[tuple[str, str]]) -> Mapping[str, bytes]:
    # JSON has every digit of a float, and nan; arrays are as they are
    fields, arrays = _fields(estimate), {}
    if estimate.interval is not None:
        fields["interval"] = _fields(estimate.interval)
        distribution = estimate.interval.distribution
        if distribution is not None:
            words = (distribution.continuous, distribution.words)
            fields["interval"]["distribution"] = words
            for name in ("values", "weights"):
                arrays[name] = getattr(distribution, name).astype("<f8").tobytes()
    text = json.dumps({"estimate": fields, "messages": messages}, default=_plain)
    return {"estimate": text.encode(), **arrays}


def _plain(number: Any) -> object:
    return number.item()  # of numpy


def _fields(of: Estimate | Interval) -> dict[str, Any]:
    return {field.name: getattr(of, field.name) for field in dataclasses.fields(of)}


def _of_parts(parts: Mapping[str, bytes]) -> tuple[Estimate, list[tuple[str, str]]]:
    import numpy as np

    document = json.loads(parts["estimate"])
    fields, interval = document["estimate"], document["estimate"]["interval"]
    if interval is not None:
        if interval["distribution"] is not None:
            continuous, words = interval["distribution"]
            values, weights = (
                np.frombuffer(parts[name], dtype="<f8")
                for name in ("values", "weights")
            )
            interval["distribution"] = Distribution(
                values=values, weights=weights, continuous=continuous, words=words
            )
        interval["notes"] = tuple(interval["notes"])
        if interval["monte_carlo_error"] is not None:
            interval["monte_carlo_error"] = tuple(interval["monte_carlo_error"])
        fields["interval"] = Interval(**interval)
    return Estimate(**fields), document["messages"]
