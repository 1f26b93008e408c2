"""Two-sided quantiles of Student's t and the normal, scipy loaded when one is asked."""

__all__ = ["normal", "student_t"]


def student_t(level: float, df: float) -> float:
    """Return the two-sided quantile of Student's t."""
    from scipy.special import stdtrit  # loaded only when an interval is asked for

    return float(stdtrit(df, 0.5 + 0.5 * level))


def normal(level: float) -> float:
    """Return the two-sided quantile of the standard normal."""
    from scipy.special import ndtri

    return float(ndtri(0.5 + 0.5 * level))
