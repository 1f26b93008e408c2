"""The analytic Jacobian of the last fit against differences, and its parts by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from masrel.elbow.identification.censored import beyond
from masrel.elbow.identification.equations import Equations
from masrel.elbow.identification.horizon import Horizon
from masrel.elbow.identification.law import PreCatchLaw
from masrel.elbow.identification.quantities import QUANTITIES
from masrel.elbow.identification.samples import even_samples
from masrel.elbow.identification.scatter import Known, Spreads
from masrel.elbow.identification.stretches import find_stretches
from masrel.elbow.identification.trials import Trial, fast_trial
from masrel.elbow.parameters import STANDARD_MODELS, ElbowParameters
from tests.elbow.identification.synthesis import recording

NAMES = tuple(QUANTITIES)
SPREADS = Spreads(torque=0.1, peak=0.3, residual=0.2, catch_angle=0.02, travel=0.03)


def caught(joint: ElbowParameters, speed: float, seed: int = 1) -> Trial:
    movement, _ = recording(
        joint,
        start=0.5,
        end=joint.range_end,
        mean_speed=math.radians(speed),
        rng=np.random.default_rng(seed),
    )
    (stretch,) = find_stretches(
        even_samples(movement), window=0.06, slow_below=math.radians(20.0)
    )
    law = PreCatchLaw(
        damping=joint.damping, stiffness=joint.stiffness, inertia=joint.inertia
    )
    return fast_trial(stretch, "trial", joint, law, 0.06)


@pytest.mark.parametrize(
    ("model", "speed", "own"),
    [
        ("HM3", 80.0, 3),  # peak, residual, travel
        ("HM1", 80.0, 2),  # the stretch ends within the catch
        ("HM4", 110.0, 2),  # the catch ends within its peak: travel is what was seen
    ],
)
@pytest.mark.parametrize("post_catch", ["continuous", "additive"])
def test_derivatives_are_those_of_the_residuals(
    model: str, speed: float, own: int, post_catch: str
) -> None:
    joint = replace(STANDARD_MODELS[model], post_catch=post_catch, inertia=0.05)
    known = Known(names=NAMES, constants=joint, spreads=SPREADS, on_line=True)
    equations = Equations(caught(joint, speed), known)
    additive_end = post_catch == "additive" and model == "HM3"
    assert equations.n_own == own - additive_end
    shared = np.array([getattr(joint, name) for name in NAMES])
    mine = equations.start(dict(zip(NAMES, shared.tolist(), strict=True)))
    whole = np.concatenate([shared, mine])
    n = shared.size
    _, by_shared, by_own = equations.at(shared, mine)
    jacobian = np.concatenate([by_shared, by_own], axis=1)
    for place in range(whole.size):
        step = 1e-6 * max(abs(whole[place]), 0.1)
        ahead, behind = whole.copy(), whole.copy()
        ahead[place] += step
        behind[place] -= step
        slope = equations.at(ahead[:n], ahead[n:])[0]
        slope = (slope - equations.at(behind[:n], behind[n:])[0]) / (2.0 * step)
        # a sample within one step of the kink has both slopes: none is that near
        scale = np.abs(jacobian[:, place]).max() + 1.0
        np.testing.assert_allclose(jacobian[:, place], slope, atol=1e-5 * scale)


def test_compressing_the_samples_leaves_the_sum_of_squares_as_it_is() -> None:
    # residuals of all samples, each over its spread, and the trial's best constant
    joint = STANDARD_MODELS["HM3"]
    trial = caught(joint, 85.0)
    known = Known(names=NAMES, constants=joint, spreads=SPREADS, on_line=False)
    equations = Equations(trial, known)
    for factor in (1.0, 1.2):
        shared = np.array([factor * getattr(joint, name) for name in NAMES])
        mine = equations.start(dict(zip(NAMES, shared.tolist(), strict=True)))
        law = equations.torque(shared, mine)
        assert trial.after is not None
        measured = np.concatenate([trial.pre_catch.torque, trial.after.torque])
        squares = float(((law - measured) ** 2).sum()) / SPREADS.torque**2
        found = equations.at(shared, mine)[0][:-3]  # without peak, residual, travel
        assert float(found @ found) == pytest.approx(squares, rel=1e-9)


def test_the_law_is_evaluated_on_few_rows_before_the_residual_torque() -> None:
    # counted: slow trials and the rest before the peak's end are a handful of rows
    joint = STANDARD_MODELS["HM1"]
    trial = caught(joint, 85.0)
    assert trial.after is not None
    known = Known(names=NAMES, constants=joint, spreads=SPREADS, on_line=True)
    equations = Equations(trial, known)
    shared = np.array([getattr(joint, name) for name in NAMES])
    mine = equations.start(dict(zip(NAMES, shared.tolist(), strict=True)))
    rows = equations.at(shared, mine)[0].size
    held = int((trial.after.time >= trial.catch.time + joint.peak_duration).sum())  # type: ignore[union-attr]
    assert rows <= held + 6 + 3
    assert trial.pre_catch.time.size > 300


def test_a_censored_travel_adds_one_row_of_d_alone() -> None:
    joint = STANDARD_MODELS["HM1"]
    behind = Horizon(travel=joint.catch_travel - 0.02, softness=0.004)
    plain, censored = (
        Equations(
            caught(joint, 85.0),
            Known(
                names=NAMES,
                constants=joint,
                spreads=SPREADS,
                on_line=True,
                horizon=each,
            ),
        )
        for each in (None, behind)
    )
    shared = np.array([getattr(joint, name) for name in NAMES])
    mine = plain.start(dict(zip(NAMES, shared.tolist(), strict=True)))
    residuals, by_shared, by_own = censored.at(shared, mine)
    np.testing.assert_array_equal(residuals[:-1], plain.at(shared, mine)[0])
    left, slope, root = beyond(joint.catch_travel, behind, SPREADS.travel)
    place = NAMES.index("catch_travel")
    expected = np.zeros(len(NAMES))
    expected[place] = slope
    assert residuals[-1] == left
    np.testing.assert_array_equal(by_shared[-1], expected)
    assert not by_own[-1].any()
    # linear rows: the same score, and as much information as the likelihood is curved
    row = censored.rows(shared, mine)
    assert row.design[-1, place] ** 2 == pytest.approx(root**2, rel=1e-12)
    score = row.design[-1, place] * row.target[-1]
    assert score == pytest.approx(-left * slope, rel=1e-12)
