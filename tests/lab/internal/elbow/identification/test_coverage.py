"""Intervals hold what they say: recordings are made anew and the truth is looked for.

Everything here is simulated: an encoder in steps of 0.09 degrees, torque noise of
0.1 N·m a sample, hands that are never twice the same, with and without joints that
vary from trial to trial.
"""

import math

import pytest

from masrel.lab.elbow import STANDARD_MODELS, ElbowParameters, fit
from masrel.lab.elbow.identification._quantities import QUANTITIES
from tests.lab.elbow.identification.synthesis import Scatter, study

HM2, HM3 = STANDARD_MODELS["HM2"], STANDARD_MODELS["HM3"]
SCATTERED = Scatter(
    catch_angle=math.radians(2.0), catch_torque=0.1, catch_travel=math.radians(2.0)
)
NAMES = [name for name in QUANTITIES if name != "inertia"]


def covered(
    scatter: Scatter | None,
    seeds: range,
    joint: ElbowParameters = HM3,
    fast: tuple[float, float] = (60.0, 120.0),
) -> dict[str, int]:
    """How often each parameter's 95 % interval holds the truth."""
    counts = dict.fromkeys(NAMES, 0)
    for seed in seeds:
        made = fit(study(joint, seed=seed, scatter=scatter, fast=fast))
        for name in NAMES:
            counts[name] += made[name].covers(getattr(joint, name))
    return counts


def test_few_intervals_miss() -> None:
    # 5 studies of 8 parameters: at 95 % coverage 2 of 40 miss on average. Were they
    # independent, 8 or more would miss once in 1000 times; the seeds are fixed.
    counts = covered(SCATTERED, range(5))
    assert 40 - sum(counts.values()) <= 7
    assert min(counts.values()) >= 2


# 200 studies: an interval of true coverage 95 % is within 180 to 196 but once in 200
# times; 20 studies: at least 16 but once in 3000. Seeds are fixed, so that this is a
# statement about the method.
N_STUDIES = [
    pytest.param(20, 16, 20, marks=pytest.mark.slow),
    pytest.param(200, 180, 196, marks=pytest.mark.long),
]


# A hand that wobbles above the threshold now and then makes a slow stretch one whose
# catch is not seen; the fit leaves it out and says so.
@pytest.mark.filterwarnings("ignore:slow .* no catch that stands out")
@pytest.mark.parametrize(("n", "fewest", "most"), N_STUDIES)
@pytest.mark.parametrize("scatter", [None, SCATTERED], ids=["exact", "scattered"])
def test_every_interval_covers_as_often_as_it_says(
    scatter: Scatter | None, n: int, fewest: int, most: int
) -> None:
    counts = covered(scatter, range(1000, 1000 + n))
    assert all(fewest <= count <= most for count in counts.values()), counts


# In one of the studies a single catch ends: no interval of D and k_post, a miss.
@pytest.mark.filterwarnings("ignore:catch_travel, post_catch_stiffness. too few trials")
@pytest.mark.filterwarnings("ignore:slow .* no catch that stands out")
@pytest.mark.parametrize(("n", "fewest", "most"), N_STUDIES)
def test_intervals_cover_where_two_thirds_of_the_catches_outlast_their_stretch(
    n: int, fewest: int, most: int
) -> None:
    # as above; leaving those catches out, D covers 89 %, and travels are too short
    counts = covered(SCATTERED, range(1000, 1000 + n), HM2, (70.0, 130.0))
    assert all(fewest <= count <= most for count in counts.values()), counts
