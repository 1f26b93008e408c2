"""Every coefficient by name, with what is true of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from masrel.agreement.coding import CodedRatings, Label, code_ratings
from masrel.agreement.cohen import COHEN_KERNEL, cohen_kappa
from masrel.agreement.fleiss import FLEISS_KERNEL, fleiss_kappa
from masrel.agreement.kernel import Kernel
from masrel.agreement.percent import PERCENT_KERNEL, percent_agreement
from masrel.agreement.stratified import (
    STRATIFIED_KERNEL,
    code_strata,
    stratified_kappa,
)
from masrel.errors import ParameterError
from masrel.estimates import Estimate

__all__ = ["COEFFICIENTS", "Coefficient", "coefficient"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficient:
    """A coefficient, how to compute it, and what is true of it.

    Attributes
    ----------
    name : str
        Name of its public function.
    title : str
        Its name for a reader.
    function : callable
        The public function.
    code : callable
        Ratings and categories to the codes its kernel takes.
    kernel : Kernel
        The coefficient from sums over items.
    shape : {"ratings", "pairs"}
        What the function takes: item × rater, or pairs per rater.
    n_raters : tuple of int or None
        Fewest and most raters; None for any number.
    lowest : float
        Lower end of the parameter space.
    chance_corrected : bool
        Whether 0 is what chance gives.
    """

    name: str
    title: str
    function: Callable[..., Estimate]
    code: Callable[..., CodedRatings]
    kernel: Kernel
    shape: Literal["ratings", "pairs"] = "ratings"
    n_raters: tuple[int, int | None] = (2, None)
    lowest: float = -1.0
    chance_corrected: bool = True

    def __call__(
        self, ratings: object, *, categories: Sequence[Label] | None = None
    ) -> Estimate:
        """Estimate the coefficient, as its public function does."""
        return self.function(ratings, categories=categories)


COEFFICIENTS: dict[str, Coefficient] = {
    entry.name: entry
    for entry in (
        Coefficient(
            name="percent_agreement",
            title="Percent agreement",
            function=percent_agreement,
            code=code_ratings,
            kernel=PERCENT_KERNEL,
            lowest=0.0,
            chance_corrected=False,
        ),
        Coefficient(
            name="cohen_kappa",
            title="Cohen's κ",
            function=cohen_kappa,
            code=code_ratings,
            kernel=COHEN_KERNEL,
            n_raters=(2, 2),
        ),
        Coefficient(
            name="fleiss_kappa",
            title="Fleiss' κ",
            function=fleiss_kappa,
            code=code_ratings,
            kernel=FLEISS_KERNEL,
        ),
        Coefficient(
            name="stratified_kappa",
            title="Stratified κ",
            function=stratified_kappa,
            code=code_strata,
            kernel=STRATIFIED_KERNEL,
            shape="pairs",
            n_raters=(1, None),
        ),
    )
}
"""Name to coefficient."""


def coefficient(name: str) -> Coefficient:
    """Look a coefficient up by name.

    Parameters
    ----------
    name : str
        Name of its public function.

    Returns
    -------
    Coefficient
        The coefficient; it can be called like its function.

    Raises
    ------
    ParameterError
        If there is none of that name; the message lists those there are.

    Examples
    --------
    >>> coefficient("fleiss_kappa").title
    "Fleiss' κ"
    """
    if name not in COEFFICIENTS:
        raise ParameterError(
            f"coefficient: needs one of {', '.join(COEFFICIENTS)}, got {name!r}"
        )
    return COEFFICIENTS[name]
