"""The models of tone that the tests go through, and how they are stepped."""

from itertools import pairwise
from math import radians

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow import (
    ConstantSpeed,
    Hold,
    Joined,
    JointModel,
    MinimumJerk,
    Motion,
    Reversed,
    Trapezoid,
)
from masrel.lab.elbow.tone import (
    ClaspKnife,
    Clonus,
    Cogwheel,
    Contracture,
    Dystonia,
    LeadPipe,
    ThresholdReflex,
    ToneModel,
)

START, END = radians(30), radians(130)

JOINTS: dict[str, ToneModel] = {
    **{f"lead-pipe {score}": LeadPipe.of_updrs(score) for score in (0, 1, 3, 4)},
    "cogwheel": Cogwheel.of_updrs(3),
    "cogwheel, sharp": Cogwheel(gap_edge=0.0),
    "clasp-knife": ClaspKnife(),
    "contracture": Contracture(),
    "contracture 4": Contracture.of_severity(4),
    "dystonia": Dystonia(),
    "clonus 3": Clonus.of_tardieu(3),
    "clonus 4": Clonus.of_tardieu(4),
    "threshold, MAS 2": ThresholdReflex.of_mas("2"),
    "threshold, MAS 1+": ThresholdReflex.of_mas("1+"),
    "stiffening": ThresholdReflex.stiffening_with_speed(),
}


def m1() -> Joined:
    """30 to 130 deg at 90 deg/s, held for 0.5 s, and back at 60 deg/s."""
    there = ConstantSpeed(start=START, end=END, speed=radians(90))
    back = ConstantSpeed(start=START, end=END, speed=radians(60))
    return Joined([there, Hold(start=END, duration=0.5), Reversed(motion=back)])


def random_motion(rng: np.random.Generator, *, range_end: float = END) -> Joined:
    """Stretches of all kinds, rests and ways back, at 10 to 200 deg/s."""
    angles = [START]
    motions: list[Motion] = []
    for _ in range(4):
        angles.append(float(rng.uniform(radians(20), range_end)))
    for one, other in pairwise(angles):
        speed = radians(float(rng.uniform(10, 200)))
        low, high = min(one, other), max(one, other)
        kinds = (
            lambda a, b, v: ConstantSpeed(start=a, end=b, speed=v),
            lambda a, b, v: MinimumJerk(start=a, end=b, mean_speed=v),
            lambda a, b, v: Trapezoid(
                start=a, end=b, speed=v, acceleration_rate=2.0 * v * v / (b - a)
            ),
        )
        motion = kinds[int(rng.integers(3))](low, high, speed)
        motions.append(motion if other > one else Reversed(motion=motion))
        if rng.random() < 0.4:
            motions.append(Hold(start=other, duration=float(rng.uniform(0.1, 1.0))))
    return Joined(motions)


def stepped(
    model: JointModel, motion: Motion, rate_hz: float = 1000.0
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int8]]:
    """Times, torques and phases of the sampled law along a motion."""
    times = np.arange(int(motion.duration * rate_hz)) / rate_hz
    joint = model.stepper(motion.start)
    torque, phase = np.empty(times.size), np.empty(times.size, dtype=np.int8)
    angle, velocity = motion.angle(times).tolist(), motion.velocity(times).tolist()
    for i, sample in enumerate(zip(times.tolist(), angle, velocity, strict=True)):
        torque[i] = joint.step(*sample)
        phase[i] = joint.phase
    return times, torque, phase


def work_of_a_cycle(model: JointModel, rate_hz: float, n_samples: int = 4000) -> float:
    """Work, J, that 75 -+ 30 cos(2 pi f t) deg takes in its second cycle."""
    joint = model.stepper(radians(45))
    times = np.arange(2 * n_samples + 1) / (n_samples * rate_hz)
    turn = 2.0 * np.pi * rate_hz
    angle = radians(75) - radians(30) * np.cos(turn * times)
    velocity = radians(30) * turn * np.sin(turn * times)
    samples = zip(times.tolist(), angle.tolist(), velocity.tolist(), strict=True)
    torque = np.array([joint.step(*sample) for sample in samples])
    mean = 0.5 * (torque[n_samples + 1 :] + torque[n_samples:-1])
    return float(np.sum(mean * np.diff(angle[n_samples:])))
