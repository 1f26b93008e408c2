"""A loop that is away: how many ticks it has missed, and for how long it was silent."""

from masrel.errors import LimitExceededError
from masrel.hess.limits import DeviceLimits

__all__ = ["check_overrun"]


def check_overrun(limits: DeviceLimits, n_missed: int, gap_s: float) -> None:
    """Check how many ticks have been missed so far, and how many at once."""
    if gap_s >= limits.watchdog_time:
        raise LimitExceededError(
            f"silence: needs a command every {limits.watchdog_time * 1e3:g} ms, "
            f"the loop sent none for {gap_s * 1e3:.1f} ms",
            "overrun",
        )
    if n_missed > limits.missed_ticks:
        raise LimitExceededError(
            f"missed ticks: needs at most {limits.missed_ticks} in a presentation, "
            f"the loop missed {n_missed}",
            "overrun",
        )
