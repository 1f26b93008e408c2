"""Agreement of ratings, and studies on a haptic simulator of elbow spasticity.

Statistics, for anybody with ratings::

    ratings     any file of ratings, read and checked
    agreement   coefficients of agreement, from any table of ratings
    intervals   intervals for them: analytic, jackknife, bootstrap, posterior
    planning    how large a study must be
    judges      whether a model rates as well as the people, and what follows if not
    audit       whether the numbers that a paper prints can be

and `masrel.lab`, the laboratory, which stands on them and which they never import.
`masrel.agree` goes through them in one call.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from

if TYPE_CHECKING:
    from masrel._agree import Agreement, agree
    from masrel.analysis._file_estimates import Estimating
    from masrel.ratings._findings import Reading

__version__ = "0.2.0"

__all__ = [
    "Agreement",
    "Estimating",
    "Reading",
    "agree",
    "agreement",
    "audit",
    "intervals",
    "judges",
    "lab",
    "planning",
    "ratings",
]

_HOMES = {
    "Agreement": "_agree",
    "Estimating": "analysis._file_estimates",
    "Reading": "ratings._findings",
    "agree": "_agree",
}


# All is loaded on first use: importing masrel costs nothing.
__getattr__ = loaded_from(__name__, _HOMES, packages=__all__)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
