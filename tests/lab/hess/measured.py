"""Recordings of the simulated device with its torque sensor: stretches, backdriving."""

from dataclasses import replace
from math import radians

from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Joined,
    MinimumJerk,
    Motion,
    Reversed,
)
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    MotionHand,
    SimulatedClock,
    SimulatedOptions,
    TorqueSensor,
    open_device,
    run_presentation,
)
from masrel.lab.recording import Recording

# A joint that asks for no torque at all: the device alone
NOTHING = replace(
    STANDARD_MODELS["HM1"],
    damping=0.0,
    stiffness=0.0,
    catch_torque_constant=0.0,
    post_catch_stiffness=0.0,
)


def measured(
    joint: ElbowParameters, motion: Motion, *, compensation: float = 0.9, seed: int = 0
) -> Recording:
    """One presentation of a joint that is led along a motion."""
    clock = SimulatedClock()
    controller = Controller(joint, start_angle=motion.start, compensation=compensation)
    with open_device(
        "simulated",
        clock=clock,
        hand=MotionHand(motion),
        options=SimulatedOptions(torque_sensor=TorqueSensor(seed=seed)),
    ) as device:
        presented = run_presentation(
            device,
            controller,
            clock=clock,
            limits=DeviceLimits(),
            max_duration_s=motion.duration,
            end_angle=10.0,  # never
        )
    assert presented.fault is None
    return presented.recording


def stretch(mean_speed_deg_s: float) -> MinimumJerk:
    """A slow stretch over 30 deg, or one over the whole range."""
    end = 60.0 if mean_speed_deg_s < 20.0 else 145.0
    return MinimumJerk(
        start=radians(30.0), end=radians(end), mean_speed=radians(mean_speed_deg_s)
    )


def to_and_fro(*mean_speeds_deg_s: float) -> Joined:
    """Forth and back by minimum jerk between 35 and 135 deg, once at each speed."""
    ways = []
    for speed in mean_speeds_deg_s:
        forth = MinimumJerk(
            start=radians(35.0), end=radians(135.0), mean_speed=radians(speed)
        )
        ways += [forth, Reversed(motion=forth)]
    return Joined(ways)
