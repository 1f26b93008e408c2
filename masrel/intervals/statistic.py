"""Coefficients as interval methods take them: by name, function or kernel."""

from collections.abc import Callable

from masrel.agreement import Coefficient, coefficient
from masrel.agreement._kernel import Kernel
from masrel.errors import ParameterError
from masrel.estimates import Estimate

__all__ = ["Statistic", "find_entry", "kernel_of"]

Statistic = str | Callable[..., Estimate] | Coefficient


def find_entry(statistic: Statistic) -> Coefficient:
    """Find a coefficient in the register."""
    if isinstance(statistic, Coefficient):
        return statistic
    if isinstance(statistic, str):
        return coefficient(statistic)
    return coefficient(getattr(statistic, "__name__", repr(statistic)))


def kernel_of(entry: Coefficient) -> Kernel:
    """Return a coefficient as a function of sums over items."""
    if entry.kernel is None:
        raise ParameterError(
            f"coefficient: {entry.title} is no function of sums over items: there is "
            "no such interval of it"
        )
    return entry.kernel
