"""Whatever a recording holds, a fit ends in numbers with their caution or one sentence.

Everything here is simulated, and most of it nonsense on purpose.
"""

import warnings

import numpy as np
import pytest

from masrel.errors import MasrelError, MasrelWarning
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.elbow.identification import ElbowFit, Movement, fit
from tests.lab.elbow.identification.synthesis import study

HM3 = STANDARD_MODELS["HM3"]
VERDICTS = ("fits", "does not fit", "no evidence either way", "undecided")
TERMS = ("gravity", "arm_inertia", "drift", "lag", "rise", "offset")


def spoiled(
    kind: int, movement: Movement, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time, angle, torque = movement.time, movement.angle, movement.torque
    if kind == 4:  # few samples, unevenly
        n = max(60, time.size // 15)
        keep = np.sort(rng.choice(time.size, size=n, replace=False))
        return time[keep], angle[keep], torque[keep]
    if kind == 7:  # flexion only
        return time, angle[::-1].copy(), torque
    noise = rng.standard_normal(time.size)
    jump = 30.0 * rng.standard_normal()
    made = {
        0: 0.5 * noise,
        1: np.full(time.size, float(rng.integers(2))),
        2: 5.0 * np.sin(20.0 * time),  # a clonus
        3: 10.0 * np.maximum(angle - 1.5, 0.0),  # a wall
        5: np.round(torque),
        6: torque + np.where(time > time.mean(), jump, 0.0),
        8: 3.0 * angle + 1e-9 * noise,
    }
    return time, angle, made[kind]


def outcome(seed: int) -> ElbowFit | str:
    """The fit of one spoiled study, or the sentence that refuses it."""
    rng = np.random.default_rng(seed)
    n_slow, n_fast = int(rng.integers(1, 5)), int(rng.integers(0, 7))
    options: dict[str, object] = {
        term: ("fitted", "off")[int(rng.integers(2))]
        for term in TERMS
        if rng.random() < 0.15
    }
    if rng.random() < 0.2:
        options["inertia"] = "fitted"
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # numpy's and scipy's
        warnings.simplefilter("ignore", MasrelWarning)
        try:
            movements = []
            for made in study(HM3, seed=seed, n_slow=n_slow, n_fast=n_fast):
                time, angle, torque = spoiled(seed % 9, made, rng)
                movements.append(
                    Movement(name=made.name, time=time, angle=angle, torque=torque)
                )
            return fit(movements, **options)  # type: ignore[arg-type]
        except MasrelError as error:
            return str(error)


@pytest.mark.parametrize(
    "seeds",
    [range(9), pytest.param(range(9, 27), marks=pytest.mark.slow)],
    ids=["few", "more"],
)
def test_nonsense_ends_in_numbers_with_their_caution_or_in_one_sentence(
    seeds: range,
) -> None:
    ends = [outcome(seed) for seed in seeds]
    for end in ends:
        if isinstance(end, str):
            assert end
            assert "\n" not in end
        else:
            assert end.lack_of_fit.verdict in VERDICTS
            assert end.lack_of_fit.sentence
    assert {type(end) for end in ends} == {str, ElbowFit}
