"""How a torque is taken away softly."""

import math


def raised_cosine(duration_s: float, rate_hz: float) -> tuple[float, ...]:
    """Return which share of a torque is left in each tick of its end, 0 in the last.

    The steepest fall from one tick to the next is π/2 over the number of ticks.
    """
    n_ticks = math.ceil(duration_s * rate_hz - 1e-9)
    return tuple(
        0.5 * (1.0 + math.cos(math.pi * tick / n_ticks))
        for tick in range(1, n_ticks + 1)
    )
