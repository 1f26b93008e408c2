"""An estimate that is looked up is the one that was computed, to the last bit."""

import dataclasses
import math
import os
import shutil
import struct
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import masrel
from masrel import intervals
from masrel.agreement import fleiss_kappa
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Distribution, Estimate, Interval
from masrel.lab._cache import Cache
from masrel.lab.analysis._known_estimates import estimates_known, known_estimate

RATINGS = [["1", "1", "2"], ["2", "2", "2"], ["3", "1", "3"], ["1", "1", "1"]]


def bits(value: object) -> object:
    """A value in which floats are their bytes: nan is itself, and 0.0 not -0.0."""
    if isinstance(value, Estimate | Interval | Distribution):
        fields = dataclasses.fields(value)
        return [bits(getattr(value, field.name)) for field in fields]
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, float):
        return struct.pack("d", value)
    if isinstance(value, tuple):
        return tuple(map(bits, value))
    return value


@pytest.mark.parametrize(
    ("method", "target"),
    [("jackknife", "items"), ("bootstrap", "raters"), ("auto", "raters")],
)
def test_every_field_comes_back(tmp_path: Path, method: str, target: str) -> None:
    calls = []

    def compute() -> Estimate:
        calls.append(method)
        return intervals.estimate(
            "fleiss_kappa",
            RATINGS,
            target=target,  # type: ignore[arg-type]
            method=method,  # type: ignore[arg-type]
            n_resamples=200,
            rng=7,
        )

    with warnings.catch_warnings(), estimates_known(Cache(tmp_path / "cache")):
        warnings.simplefilter("ignore")
        first = known_estimate(compute, method)
        again = known_estimate(compute, method)
    assert bits(again) == bits(first)
    assert calls == [method]


def test_a_warning_comes_back(tmp_path: Path) -> None:
    def compute() -> Estimate:
        return fleiss_kappa([["1", "1"], ["1", "1"]], categories=["1", "2"])

    with estimates_known(Cache(tmp_path / "cache")):
        for _ in range(2):
            with pytest.warns(UndefinedStatisticWarning, match="one category"):
                estimate = known_estimate(compute, "any")
            assert math.isnan(estimate.value)
            assert estimate.reason is not None


def test_without_a_cache_it_is_computed() -> None:
    estimate = known_estimate(lambda: fleiss_kappa(RATINGS), "any")
    assert bits(estimate) == bits(fleiss_kappa(RATINGS))


def test_what_is_kept_is_of_the_code_of_the_statistics_too(tmp_path: Path) -> None:
    package = tmp_path / "masrel"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(masrel.__file__).parent, package, ignore=ignored)
    code = "from masrel.lab._cache import code_hash; print(code_hash())"

    def hashed() -> bytes:
        path = {**os.environ, "PYTHONPATH": str(tmp_path)}
        call = [sys.executable, "-B", "-c", code]
        return subprocess.run(
            call, cwd=tmp_path, env=path, capture_output=True, check=True
        ).stdout

    before = hashed()
    assert hashed() == before
    with (package / "agreement" / "kappas.py").open("a", encoding="utf-8") as file:
        file.write("# other code\n")
    assert hashed() != before
