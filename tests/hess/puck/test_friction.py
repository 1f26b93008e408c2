"""Steady runs of a free arm, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.hess.puck.friction import SteadyRun, fit_friction

speeds = st.lists(st.floats(0.1, 3.0), min_size=2, max_size=6, unique=True)


def runs_of(
    viscous: float, coulomb: float, offset: float, speeds: list[float]
) -> list[SteadyRun]:
    return [
        SteadyRun(speed=v, torque=viscous * v + math.copysign(coulomb, v) + offset)
        for speed in speeds
        for v in (speed, -speed)
    ]


@given(
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(-0.5, 0.5),
    speeds.filter(lambda values: max(values) - min(values) > 0.1),
)
def test_a_fit_without_noise_gives_the_truth(
    viscous: float, coulomb: float, offset: float, speeds: list[float]
) -> None:
    found = fit_friction(runs_of(viscous, coulomb, offset, speeds))
    assert found.viscous == pytest.approx(viscous, abs=1e-10)
    assert found.coulomb == pytest.approx(coulomb, abs=1e-10)
    assert found.offset == pytest.approx(offset, abs=1e-10)
    assert found.viscous_error < 1e-9


def test_errors_are_those_of_least_squares() -> None:
    # Over 400 draws B ± 1.96 errors (11 degrees of freedom: t = 2.2) holds the truth
    # in 95 % of them; below 91 % or above 98 % has a chance of 1e-3 or less.
    rng = np.random.default_rng(5)
    clean = runs_of(0.168, 0.189, 0.0, [0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4])
    inside = 0
    for _ in range(400):
        noisy = [replace(r, torque=r.torque + rng.normal(0.0, 0.01)) for r in clean]
        found = fit_friction(noisy)
        inside += abs(found.viscous - 0.168) <= 2.201 * found.viscous_error
    assert 364 <= inside <= 392


@pytest.mark.parametrize(
    "runs",
    [
        [],
        runs_of(0.1, 0.1, 0.0, [1.0]),
        [SteadyRun(speed=v, torque=v) for v in (1.0, 2.0, 3.0, 4.0)],
        runs_of(0.1, 0.1, 0.0, [1.0]) * 2,
    ],
)
def test_runs_that_cannot_tell_are_refused(runs: list[SteadyRun]) -> None:
    with pytest.raises(ParameterError, match="at two speeds and in both directions"):
        fit_friction(runs)
