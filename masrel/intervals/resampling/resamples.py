"""Values of a statistic over resamples, however they were come by."""

from dataclasses import dataclass, field

from masrel.agreement._kernel import Floats
from masrel.estimates import Distribution
from masrel.intervals.resampling.drawn import Drawn
from masrel.intervals.resampling.enumerated import Enumerated

__all__ = ["Resamples"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Resamples:
    """Values of a statistic over resamples."""

    source: Enumerated | Drawn = field(compare=False, repr=False)  # the defined values
    n_resamples: int | None  # how many were drawn; None if these are all
    n_undefined: int  # how many are undefined, of those drawn or of the distinct ones
    words: str  # what they are
    notes: tuple[str, ...] = ()  # what the reader must know of them

    @property
    def ascending(self) -> Floats:
        """The defined values, ascending."""
        if isinstance(self.source, Drawn):
            return self.source.ordered
        return self.source.values

    @property
    def has_spread(self) -> bool:
        """Whether there are two different values."""
        values = self.ascending
        return bool(values.size) and bool(values[0] < values[-1])

    @property
    def distribution(self) -> Distribution:
        """The defined values with their probabilities."""
        values, weights = self.ascending, self.source.weights
        for array in (values, weights):
            array.flags.writeable = False
        return Distribution(
            values=values, weights=weights, continuous=False, words=self.words
        )
