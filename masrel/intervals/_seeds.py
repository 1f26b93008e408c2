"""Where random numbers come from, and the seed that repeats them."""

import numpy as np

from masrel.errors import ParameterError


def recorded_generator(
    rng: np.random.Generator | int | None,
) -> tuple[np.random.Generator, int | None]:
    """Return a generator and the seed that repeats it."""
    check_rng(rng)
    if isinstance(rng, np.random.Generator):
        return rng, None  # its owner knows where it began
    if rng is None:
        rng = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)
    return np.random.default_rng(int(rng)), int(rng)


def check_rng(rng: object) -> None:
    """Check that random numbers can come from something."""
    if rng is None or isinstance(rng, np.random.Generator):
        return
    if isinstance(rng, bool) or not isinstance(rng, int | np.integer) or rng < 0:
        raise ParameterError(
            f"rng: needs a numpy Generator or an integer of at least 0, got {rng!r}"
        )
