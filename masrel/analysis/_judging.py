"""Questions about the judges among the raters of a file."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Literal

from masrel._input import refuse

if TYPE_CHECKING:
    from masrel.judges import PairedTest


@dataclass(frozen=True, slots=True, kw_only=True)
class Judging:
    """Which raters are judges, and what is to be told of them.

    Parameters
    ----------
    judges, humans : tuple of str
        Raters that are judges; those who are humans, all others unless given.
    epsilon : float or None
        How much worse than a human a judge may be.
    annotators : {"expert", "skilled", "crowd"} or None
        Who the humans are, in place of `epsilon`.
    score, test, min_items
        As of `masrel.judges.alternative_annotator_test`.
    rate : str or None
        The grade whose rate is estimated.
    truth : bool
        Whether the class of each item is estimated without labels.
    order : str or None
        The column with the answer shown first; grades are the answers preferred.
    require : tuple of str
        Gates on numbers of judges and rates.

    Examples
    --------
    >>> Judging(judges=("gpt-4o",), annotators="crowd").margin
    0.1
    """

    judges: tuple[str, ...] = ()
    humans: Sequence[str] | None = None
    epsilon: float | None = None
    annotators: Literal["expert", "skilled", "crowd"] | None = None
    score: str = "accuracy"
    test: 'PairedTest | Literal["auto"]' = "auto"
    min_items: int = 30
    rate: str | None = None
    truth: bool = False
    order: str | None = None
    require: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        refuse(
            (
                self.epsilon is not None and self.annotators is not None,
                "--epsilon, --annotators: needed one of them, got both",
            ),
            (
                self.order is not None
                and (self.margin is not None or self.rate is not None or self.truth),
                "--order: is for preferences, so it cannot be combined with "
                "--epsilon, --annotators, --rate or --truth",
            ),
        )

    @property
    def margin(self) -> float | None:
        """ε; None if judges are not compared with humans."""
        if self.annotators is None:
            return self.epsilon
        from masrel.judges import EPSILONS

        return EPSILONS[self.annotators]

    def record(self) -> dict[str, object]:
        """Return every option that decides a number."""
        return {**asdict(self), "epsilon": self.margin}
