"""Presentations for an hour, simulated: memory flat, recordings complete."""

import gc
import resource
from math import radians

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)

from .rig import END, START

WARM_UP = 50  # presentations in which caches and pools fill
MAX_GROWTH_KB = 4096  # in an hour a leak of one recording in ten would be 17 MB


def resident_kb() -> int:
    """The largest this process has ever been."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


# In six minutes the same bound sees a leak of a recording in four.
@pytest.mark.parametrize(
    ("simulated_minutes", "min_presentations"),
    [
        pytest.param(6, 200, marks=pytest.mark.slow),
        pytest.param(60, 2000, marks=pytest.mark.long),
    ],
)
def test_for_an_hour_memory_is_flat_and_every_tick_is_there(
    simulated_minutes: int, min_presentations: int
) -> None:
    models = sorted(STANDARD_MODELS)
    simulated_s, n_presentations, before_kb = 0.0, 0, 0
    sizes: dict[str, set[int]] = {model: set() for model in models}
    while simulated_s < 60.0 * simulated_minutes:
        model = models[n_presentations % len(models)]
        clock = SimulatedClock()
        hand = SimulatedHand(start=START, end=END, mean_speed=radians(80.0))
        controller = Controller(STANDARD_MODELS[model], start_angle=START)
        with open_device("simulated", clock=clock, hand=hand) as device:
            presented = run_presentation(
                device, controller, clock=clock, limits=DeviceLimits(), end_angle=END
            )
        assert presented.fault is None
        time_s = presented.recording.columns["time_s"]
        np.testing.assert_allclose(time_s, np.arange(time_s.size) * 1e-3, atol=1e-9)
        sizes[model].add(time_s.size)
        simulated_s += float(time_s[-1])
        n_presentations += 1
        if n_presentations == WARM_UP:
            gc.collect()
            before_kb = resident_kb()
    assert n_presentations > min_presentations
    assert all(len(each) == 1 for each in sizes.values())  # the same each time
    assert resident_kb() - before_kb < MAX_GROWTH_KB
