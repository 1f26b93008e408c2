"""Whether a sample is too small for an interval to cover as it says."""

import warnings

from masrel.errors import SmallSampleWarning

__all__ = ["warn_small"]


def warn_small(count: int, least: int, what: str) -> tuple[str, ...]:
    """Warn below a number of items or raters, and return the note of it."""
    if count >= least:
        return ()
    note = f"{count} {what}: below {least} the interval may cover less than it says"
    # called by what a method calls: the warning points to who called the method
    warnings.warn(note, SmallSampleWarning, stacklevel=4)
    return (note,)
