"""How far events, torques and outputs are off the 50-digit reference."""

from dataclasses import dataclass
from math import ulp

import numpy as np
from mpmath import mp, mpf

from masrel.lab.elbow import ElbowParameters, Motion, events, torque
from tests.lab.elbow.reference import Caught, Reference, solved

EPS = 2.0**-52
TIMES = ("onset", "catch", "peak_end", "catch_end", "post_catch_end")
ANGLES = ("catch_angle", "catch_speed", "mean_speed")


@dataclass(frozen=True)
class Errors:
    """Largest errors of one scene.

    `time_s` of event times, absolute; `time_ulp` in units in the last place of the
    duration; `torque` of torques at random times of every phase, over the largest term
    of the law at any of them; `phases` the sequence of phases.
    """

    time_s: float
    time_ulp: float
    torque: float
    phases: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Within 1e-11 s or 1e-14 of the duration, and 1e-12 of the largest term."""
        is_timely = self.time_s <= 1e-11 or self.time_ulp * EPS <= 1e-14
        return is_timely and self.torque <= 1e-12


def errors(
    joint: ElbowParameters, motion: Motion, rng: np.random.Generator, n_times: int = 6
) -> Errors:
    """Hold one scene to the reference; differing phases are a failure at once."""
    with mp.workdps(50):
        exact = solved(joint, motion)
        found = events(joint, motion)
        seen = tuple(span.name for span in found.phases)
        assert seen == phases_of(exact), (seen, phases_of(exact))
        assert len(found.stretches) == len(exact.stretches)
        off = [abs(mpf(found.end) - exact.end)]
        for ours, theirs in zip(found.stretches, exact.stretches, strict=True):
            off += times_off(ours, theirs)
        worst = max(off)
        # some in every phase, however short
        shares = rng.uniform(0.0, 1.0, (len(found.phases), n_times))
        starts = np.array([[span.start] for span in found.phases])
        ends = np.array([[span.end] for span in found.phases])
        times = np.clip(starts + (ends - starts) * shares, starts, ends).ravel()
        terms = [exact.terms(mpf(t)) for t in times.tolist()]
        largest = max(abs(term) for of_time in terms for term in of_time)
        found_torque = torque(joint, motion, times).tolist()
        apart = max(
            abs(mpf(value) - sum(of_time)) - steep * max(worst, mpf(ulp(found.end)))
            for value, of_time, steep in zip(
                found_torque, terms, map(exact.steepness, times.tolist()), strict=True
            )
        )
    return Errors(
        time_s=float(worst),
        time_ulp=float(worst / mpf(ulp(found.end))),
        torque=max(float(apart / largest) if largest else float(apart), 0.0),
        phases=seen,
    )


def times_off(ours: object, theirs: Caught) -> list[mpf]:
    """Errors of the times of one stretch; what is None must be in both."""
    off = []
    for name in TIMES:
        value, exact = getattr(ours, name), getattr(theirs, name)
        assert (value is None) == (exact is None), name
        if value is not None:
            off.append(abs(mpf(value) - exact))
    for name in ANGLES:
        value, exact = getattr(ours, name), getattr(theirs, name)
        if value is not None:
            assert abs(mpf(value) - exact) <= mpf("1e-10") * max(abs(exact), 1), name
    return off


def phases_of(exact: Reference) -> tuple[str, ...]:
    """Names of the phases that last."""
    starts = [start for _, start, _ in exact.changes]
    ends = [*starts[1:], exact.end]
    return tuple(
        phase
        for (phase, start, _), end in zip(exact.changes, ends, strict=True)
        if end > start
    )
