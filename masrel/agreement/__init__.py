"""Agreement statistics from any table of ratings; numpy is all they load.

In: item × rater labels (or counts, or a contingency table). Out: an `Estimate`, or a
`Significance` from a test.
"""

from masrel.agreement._codes import (
    CodedRatings,
    CountedRatings,
    code_long,
    code_ratings,
    count_items,
    count_ratings,
    count_table,
)
from masrel.agreement._labels import Label
from masrel.agreement._weights import (
    WeightName,
    Weights,
    WeightsLike,
    declared_weights,
)
from masrel.agreement.benchmarks import (
    Alternative,
    Band,
    BandScale,
    bands,
    benchmark,
    equivalence_p_value,
    holm,
    p_value,
    strength,
)
from masrel.agreement.change import (
    McnemarKind,
    bhapkar,
    bias_index,
    bowker,
    contingency_table,
    kappa_max,
    mcnemar,
    prevalence_index,
    specific_agreement,
    stuart_maxwell,
)
from masrel.agreement.icc import (
    IccForm,
    icc,
    icc_f_test,
    kendall_w,
    kendall_w_test,
    robinson_a,
)
from masrel.agreement.kappas import (
    brennan_prediger,
    category_kappa,
    conger_kappa,
    fleiss_kappa,
    fleiss_null,
    gwet_ac,
    percent_agreement,
    scott_pi,
)
from masrel.agreement.krippendorff import Metric, krippendorff_alpha
from masrel.agreement.measurement import (
    ErrorKind,
    LimitsOfAgreement,
    limits_of_agreement,
    lin_ccc,
    mdc,
    sem,
)
from masrel.agreement.pairs import (
    Deletion,
    cohen_kappa,
    light_kappa,
    pooled_kappa,
    stratified_kappa,
)
from masrel.agreement.registry import COEFFICIENTS, Coefficient, Property, coefficient
from masrel.estimates import Significance

__all__ = [
    "COEFFICIENTS",
    "Alternative",
    "Band",
    "BandScale",
    "CodedRatings",
    "Coefficient",
    "CountedRatings",
    "Deletion",
    "ErrorKind",
    "IccForm",
    "Label",
    "LimitsOfAgreement",
    "McnemarKind",
    "Metric",
    "Property",
    "Significance",
    "WeightName",
    "Weights",
    "WeightsLike",
    "bands",
    "benchmark",
    "bhapkar",
    "bias_index",
    "bowker",
    "brennan_prediger",
    "category_kappa",
    "code_long",
    "code_ratings",
    "coefficient",
    "cohen_kappa",
    "conger_kappa",
    "contingency_table",
    "count_items",
    "count_ratings",
    "count_table",
    "declared_weights",
    "equivalence_p_value",
    "fleiss_kappa",
    "fleiss_null",
    "gwet_ac",
    "holm",
    "icc",
    "icc_f_test",
    "kappa_max",
    "kendall_w",
    "kendall_w_test",
    "krippendorff_alpha",
    "light_kappa",
    "limits_of_agreement",
    "lin_ccc",
    "mcnemar",
    "mdc",
    "p_value",
    "percent_agreement",
    "pooled_kappa",
    "prevalence_index",
    "robinson_a",
    "scott_pi",
    "sem",
    "specific_agreement",
    "stratified_kappa",
    "strength",
    "stuart_maxwell",
]
