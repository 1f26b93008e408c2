"""The analytic Jacobian of the last fit against differences, and its parts by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from masrel.lab.elbow.identification._catches import (
    Law,
    Trial,
    fast_trial,
    find_stretches,
)
from masrel.lab.elbow.identification._equations import (
    DetectionLimit,
    Equations,
    Known,
    beyond,
)
from masrel.lab.elbow.identification._model_file import QUANTITIES
from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters
from tests.lab.elbow.identification.synthesis import recording

NAMES = tuple(QUANTITIES)
SPREADS = {
    "torque": 0.1,
    "peak": 0.3,
    "residual": 0.2,
    "catch angle": 0.02,
    "travel": 0.03,
}


def caught(
    joint: ElbowParameters, speed: float, seed: int = 1, arm: Law | None = None
) -> Trial:
    movement = recording(
        joint,
        start=0.5,
        end=joint.range_end,
        mean_speed=math.radians(speed),
        rng=np.random.default_rng(seed),
    )
    (stretch,), _ = find_stretches(movement, window=0.06, slow_below=math.radians(20.0))
    law = replace(
        arm or Law(),
        damping=joint.damping,
        stiffness=joint.stiffness,
        inertia=joint.inertia,
    )
    return fast_trial(stretch, "trial", joint, law, 0.06)


def jacobian_holds(equations: Equations, shared: np.ndarray, own: np.ndarray) -> None:
    """Columns of the table are the derivatives of its last one."""
    n, names = shared.size, (*equations.local, *equations.known.names)
    table = equations.table(shared, own)
    whole = np.concatenate([own, shared])
    for place, name in enumerate(names):
        step = 1e-6 * max(abs(whole[place]), 0.1)
        sides = []
        for signed in (step, -step):
            moved = whole.copy()
            moved[place] += signed
            near = equations.table(moved[-n:], moved[:-n])
            sides.append(near[:, -1])
        slope = (sides[0] - sides[1]) / (2.0 * step)
        # a sample within one step of a kink has both slopes: none is that near, but
        # where a lag begins, over a tenth of a millisecond
        off = np.abs(table[:, place] - slope) / (np.abs(table[:, place]).max() + 1.0)
        assert (off > 1e-4).sum() <= 2 * (name in ("lag", "catch_rise", "shift")), name


@pytest.mark.parametrize(
    ("model", "speed", "own"),
    [
        ("HM3", 80.0, 4),  # offset, peak, residual, travel
        ("HM1", 80.0, 3),  # the stretch ends within the catch
        ("HM4", 110.0, 3),  # the catch ends within its peak: travel is what was seen
    ],
)
@pytest.mark.parametrize("post_catch", ["continuous", "additive"])
def test_derivatives_are_those_of_the_residuals(
    model: str, speed: float, own: int, post_catch: str
) -> None:
    joint = replace(STANDARD_MODELS[model], post_catch=post_catch, inertia=0.05)
    known = Known(
        names=NAMES, constants=joint, spreads=SPREADS, law=Law(), on_line=True
    )
    equations = Equations(caught(joint, speed), known)
    additive_end = post_catch == "additive" and model == "HM3"
    assert len(equations.local) == own - additive_end
    shared = np.array([getattr(joint, name) for name in NAMES])
    mine = equations.start(dict(zip(NAMES, shared.tolist(), strict=True)))
    jacobian_holds(equations, shared, mine)


@pytest.mark.parametrize("curved", [("lag",), ("catch_rise",), ("lag", "catch_rise")])
@pytest.mark.parametrize("offset", [None, 0.2])
def test_derivatives_hold_with_all_that_an_arm_has(
    curved: tuple[str, ...], offset: float | None
) -> None:
    joint = STANDARD_MODELS["HM3"]
    names = (*NAMES, "gravity", "arm_inertia", *curved)
    arm = Law(gravity=0.5, gravity_angle=0.3, lag=0.01, catch_rise=0.05)
    trial = caught(joint, 80.0, arm=arm)
    known = Known(
        names=names,
        constants=joint,
        spreads=SPREADS,
        law=arm,
        offset=offset,
        drifts=True,
        on_line=True,
    )
    equations = Equations(trial, known)
    values = {name: getattr(joint, name) for name in NAMES}
    values |= {"gravity": 0.5, "arm_inertia": 0.05, "lag": 0.01, "catch_rise": 0.05}
    shared = np.array([values[name] for name in names])
    jacobian_holds(equations, shared, equations.start(values))


def test_a_censored_travel_adds_one_row_of_d_alone() -> None:
    joint = STANDARD_MODELS["HM1"]
    behind = DetectionLimit(travel=joint.catch_travel - 0.02, sd=0.004)
    plain, censored = (
        Equations(
            caught(joint, 85.0),
            Known(
                names=NAMES,
                constants=joint,
                spreads=SPREADS,
                law=Law(),
                on_line=True,
                limit=each,
            ),
        )
        for each in (None, behind)
    )
    shared = np.array([getattr(joint, name) for name in NAMES])
    mine = plain.start(dict(zip(NAMES, shared.tolist(), strict=True)))
    table = censored.table(shared, mine)
    np.testing.assert_array_equal(table[:-1], plain.table(shared, mine))
    left, slope, root = beyond(joint.catch_travel, behind, SPREADS["travel"])
    place = NAMES.index("catch_travel")
    expected = np.zeros(len(censored.local) + len(NAMES) + 1)
    expected[len(censored.local) + place] = slope
    expected[-1] = left
    np.testing.assert_array_equal(table[-1], expected)
    # linear rows: the same score, and as much information as the likelihood is curved
    gram = [e.rows(shared, t) for e, t in ((plain, table[:-1]), (censored, table))]
    more = [float((r.design[:, place] ** 2).sum()) for r in gram]
    assert more[1] - more[0] == pytest.approx(root**2, rel=1e-9)
    score = [float(r.design[:, place] @ r.target) for r in gram]
    assert score[1] - score[0] == pytest.approx(-left * slope, rel=1e-9)
