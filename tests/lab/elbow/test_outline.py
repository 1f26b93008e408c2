"""Lines to draw: few points whatever the duration, and jumps as jumps."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import STANDARD_MODELS, Hold, Joined, MinimumJerk, outline, torque
from masrel.lab.recording import PHASES
from tests.lab.elbow.stretches import CountedMotion, constant, minimum_jerk

HM3 = STANDARD_MODELS["HM3"]


@pytest.mark.parametrize("motion", [constant(92.0), minimum_jerk(92.0)])
def test_points_are_of_the_torque_on_both_sides_of_a_jump(motion) -> None:
    made = outline(HM3, motion, n_points=200)
    jumps = np.flatnonzero(np.diff(made.time) == 0.0)
    catch = made.events.catch
    (at,) = [i for i in jumps if made.time[i] == catch]
    rise = 2.8 * made.events.catch_speed  # H·v_c
    assert made.torque[at + 1] - made.torque[at] == pytest.approx(rise, rel=1e-12)
    inside = np.diff(made.time, append=9.0) > 0.0
    inside[1:] &= np.diff(made.time) > 0.0
    expected = torque(HM3, motion, made.time[inside])
    assert made.torque[inside] == pytest.approx(expected, abs=1e-12)
    spans = made.events.phases
    codes = made.phase[np.append(True, np.diff(made.phase) != 0)]
    assert [PHASES[code] for code in codes] == [span.name for span in spans]


def test_a_day_of_rest_takes_no_more_points_than_a_second() -> None:
    # At 1 kHz it would be 86 million samples; 800 pixels need a thousand.
    day = Hold(start=radians(30.0), duration=86_400.0)
    motion = CountedMotion(Joined([day, minimum_jerk(92.0)]))
    made = outline(HM3, motion, n_points=800)
    assert made.time.size < 820
    assert motion.largest < 820
    assert made.events.catch > 86_400.0


def test_a_slow_stretch_is_one_line() -> None:
    made = outline(HM3, constant(10.0), n_points=2)
    assert made.time.size == 3
    assert set(made.phase.tolist()) == {0}


def test_the_line_is_cut_at_the_end_of_range() -> None:
    joint = replace(HM3, range_end=radians(60.0))
    made = outline(joint, minimum_jerk(92.0))
    assert made.angle.max() == pytest.approx(radians(60.0), abs=1e-12)
    assert isinstance(minimum_jerk(92.0), MinimumJerk)


def test_one_point_is_no_line() -> None:
    with pytest.raises(ParameterError, match="n_points: needs 2 or more, got 1"):
        outline(HM3, constant(92.0), n_points=1)
