"""Events of minimum-jerk stretches, against their conditions in 40 digits.

Each condition is evaluated 1e-11 s before and after the event: it changes its sign.
"""

import decimal
from collections.abc import Callable
from decimal import Decimal
from math import radians

import numpy as np
import pytest

from masrel.lab.elbow import MinimumJerk
from masrel.lab.elbow.tone import (
    ClaspKnife,
    Contracture,
    LeadPipe,
    ThresholdReflex,
    ToneModel,
)

BAR = Decimal("1e-11")  # s

reflex, knife, end, pipe = ThresholdReflex(), ClaspKnife(), Contracture(), LeadPipe()

Condition = Callable[[Decimal, Decimal, Decimal], Decimal]  # of θ, ω and the start
CONDITIONS: list[tuple[ToneModel, str, Condition]] = [
    (
        reflex,
        "threshold",
        lambda a, w, _: (
            a + Decimal(reflex.threshold_slope) * w - Decimal(reflex.threshold)
        ),
    ),
    (
        knife,
        "fire",
        lambda a, w, _: min(
            Decimal(knife.reflex_stiffness)
            * (a - Decimal(knife.threshold) + Decimal(knife.threshold_slope) * w)
            - Decimal(knife.firing_torque),
            a - Decimal(knife.arming_angle),
        ),
    ),
    (end, "end", lambda a, _, __: a - Decimal(end.end_angle)),
    (pipe, "slip", lambda a, _, start: a - start - Decimal(pipe.bristle_travel)),
]


def state(stretch: MinimumJerk, time: Decimal) -> tuple[Decimal, Decimal]:
    """Angle and velocity by Flash and Hogan's polynomial."""
    start, way = Decimal(stretch.start), Decimal(stretch.end) - Decimal(stretch.start)
    length = way / Decimal(stretch.mean_speed)
    x = time / length
    angle = start + way * (10 * x**3 - 15 * x**4 + 6 * x**5)
    return angle, way / length * 30 * (x * (1 - x)) ** 2


@pytest.mark.parametrize(
    ("model", "name", "condition"), CONDITIONS, ids=[c[1] for c in CONDITIONS]
)
def test_an_event_is_where_its_condition_is_first_met(
    model: ToneModel, name: str, condition: Condition
) -> None:
    rng = np.random.default_rng(11)
    n_events = 0
    with decimal.localcontext(decimal.Context(prec=40)):
        for _ in range(100):
            low, high, speed = rng.uniform((5, 90, 20), (32, 145, 150))
            stretch = MinimumJerk(
                start=radians(low), end=radians(high), mean_speed=radians(speed)
            )
            events = [e for e in model.events(stretch) if e.name == name]
            for event in events[:1]:
                at = Decimal(event.time)
                before, after = (
                    condition(*state(stretch, at + side), Decimal(stretch.start))
                    for side in (-BAR, BAR)
                )
                assert before < 0 < after
                n_events += 1
    assert n_events > 40
