"""Many traces in one array: row by row the bits of one trace."""

from dataclasses import replace
from math import inf, isnan

import numpy as np
import pytest

from masrel.elbow import STANDARD_MODELS, MinimumJerk, torque_traces, trace
from masrel.elbow.scenes import traces
from masrel.errors import ParameterError
from tests.elbow.scenes import KINDS, random_scene
from tests.elbow.stretches import constant, counted, minimum_jerk, table_v

HM3 = STANDARD_MODELS["HM3"]


def check(joints, motions, rate_hz: float) -> None:
    made = torque_traces(joints, motions, rate_hz=rate_hz)
    for row, joint, motion in zip(made, joints, motions, strict=True):
        one = trace(joint, motion, rate_hz=rate_hz).torque
        assert row[: one.size].tolist() == one.tolist()
        assert np.isnan(row[one.size :]).all()
    assert not np.isnan(made).all(axis=0).any()  # no longer than the longest


@pytest.mark.parametrize("rate_hz", [77.0, 1000.0])
@pytest.mark.parametrize("kind", KINDS)
def test_every_row_has_the_bits_of_one_trace(kind: str, rate_hz: float) -> None:
    n = 120 if kind in ("constant", "minimum jerk") else 6
    scenes = [
        random_scene(np.random.default_rng([seed, 13]), kind, wide=False)
        for seed in range(2 * n)
    ]
    # at most 5 s, to be quick
    scenes = [s for s in scenes if s[1].start < s[0].range_end and s[1].duration < 5.0]
    joints, motions = zip(*scenes[:n], strict=True)
    check(joints, motions, rate_hz)


# From catches at once to none, from slow to fast, and ends that cut every phase
@pytest.mark.parametrize("kind", [constant, minimum_jerk])
def test_a_grid_of_stretches_has_the_bits(kind) -> None:
    scenes = [
        (joint, kind(speed, start_deg=start, end_deg=end))
        for joint in STANDARD_MODELS.values()
        for speed in (11.0, 20.0, 21.0, 60.0, 93.0, 142.9, 200.0, 900.0)
        for start, end in ((30.0, 146.0), (0.0, 175.0), (95.0, 120.0), (30.0, 80.0))
    ]
    joints, motions = zip(*scenes, strict=True)
    check(joints, motions, 250.0)


def test_plain_stretches_are_not_stepped_through_alone() -> None:
    rows = table_v()
    joints = [STANDARD_MODELS[row.model] for row in rows]
    for kind in (constant, minimum_jerk):
        with counted(traces, "trace") as n_traces:
            torque_traces(joints, [kind(row.speed_deg_s) for row in rows])
            assert n_traces == [0]
    additive = replace(HM3, post_catch="additive")
    with counted(traces, "trace") as n_traces:
        torque_traces([HM3, additive], constant(92.0))
        assert n_traces == [1]  # the counter does count


def test_mixed_motions_keep_their_rows() -> None:
    motions = [minimum_jerk(92.0), constant(92.0), minimum_jerk(46.0), constant(46.0)]
    assert isinstance(motions[0], MinimumJerk)
    check([HM3] * 4, motions, 100.0)
    made = torque_traces(HM3, motions, rate_hz=100.0)
    assert isnan(made[0, -1])
    assert not isnan(made[2, -1])


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, inf])
def test_rates_that_give_no_samples_are_refused(rate_hz: float) -> None:
    with pytest.raises(ParameterError, match=r"^rate_hz: needs more than 0"):
        torque_traces(HM3, constant(92.0), rate_hz=rate_hz)


def test_a_stretch_beyond_the_range_is_refused_with_its_number() -> None:
    beyond = constant(92.0, start_deg=150.0, end_deg=160.0)
    with pytest.raises(ParameterError, match=r"^motions\[1\]\.start: needs less"):
        torque_traces(HM3, [constant(92.0), beyond])
