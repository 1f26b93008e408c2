"""From the degrees of a recording back to the radians that were read."""

from math import pi

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from masrel.lab.hess._replay import recorded_angles
from masrel.lab.hess._signals import VelocityEstimate


@given(
    st.lists(st.floats(0.0, pi), min_size=1, max_size=30),
    st.lists(st.integers(500_000, 3_000_000), min_size=30, max_size=30),
)
def test_angles_come_back_to_the_last_bit_or_to_the_same_speeds(
    angles: list[float], steps_ns: list[int]
) -> None:
    times = [sum(steps_ns[:n]) * 1e-9 for n in range(len(angles))]
    estimate = VelocityEstimate()
    speeds = [
        float(np.degrees(estimate.update(time, angle)))
        for time, angle in zip(times, angles, strict=True)
    ]
    degrees = [float(np.degrees(angle)) for angle in angles]
    found, is_exact = recorded_angles(times, degrees, speeds)
    assert is_exact
    # Not always the same floats: several may have these degrees and these speeds.
    assert [float(np.degrees(angle)) for angle in found] == degrees
    assert np.max(np.abs(np.array(found) - angles)) <= 2 * np.spacing(pi)
    again = VelocityEstimate()
    assert [
        float(np.degrees(again.update(time, angle)))
        for time, angle in zip(times, found, strict=True)
    ] == speeds
