"""Agreement statistics from any table of ratings; numpy is all they load.

In: item × rater labels (or counts, or a contingency table). Out: an `Estimate`.
"""

from masrel.agreement.cohen import cohen_kappa, cohen_kappa_from_table
from masrel.agreement.fleiss import fleiss_kappa, fleiss_kappa_from_counts
from masrel.agreement.percent import percent_agreement, percent_agreement_from_counts
from masrel.agreement.registry import COEFFICIENTS, Coefficient, coefficient
from masrel.agreement.stratified import stratified_kappa

__all__ = [
    "COEFFICIENTS",
    "Coefficient",
    "coefficient",
    "cohen_kappa",
    "cohen_kappa_from_table",
    "fleiss_kappa",
    "fleiss_kappa_from_counts",
    "percent_agreement",
    "percent_agreement_from_counts",
    "stratified_kappa",
]
