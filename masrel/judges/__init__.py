"""Judges: whether a model rates as well as the humans it would replace.

In: grades of humans and of a judge, which may be a language model. Out: whether the
judge can replace a human, rates corrected for its errors, and who is probably right.
"""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from

if TYPE_CHECKING:
    from masrel.judges._paired import PairedTest, ScoreTest, score_test
    from masrel.judges.annotators import (
        EPSILONS,
        AlternativeAnnotatorTest,
        Grades,
        HumanBesideJudge,
        JudgeDifference,
        Score,
        ScoreName,
        advantage,
        advantage_differences,
        alternative_annotator_test,
        reference_difference,
    )
    from masrel.judges.latent_classes import (
        DawidSkene,
        DawidSkeneIntervals,
        EffectiveNumber,
        dawid_skene,
        dawid_skene_intervals,
        effective_number,
    )
    from masrel.judges.power import JudgePlan, judge_plan
    from masrel.judges.preferences import (
        BradleyTerry,
        PositionBias,
        bradley_terry,
        position_bias,
    )
    from masrel.judges.rates import (
        RateEstimate,
        RateEstimates,
        corrected_rate,
        label_allocation,
        labels_needed,
        prediction_powered_mean,
        rate_estimates,
    )

__all__ = [
    "EPSILONS",
    "AlternativeAnnotatorTest",
    "BradleyTerry",
    "DawidSkene",
    "DawidSkeneIntervals",
    "EffectiveNumber",
    "Grades",
    "HumanBesideJudge",
    "JudgeDifference",
    "JudgePlan",
    "PairedTest",
    "PositionBias",
    "RateEstimate",
    "RateEstimates",
    "Score",
    "ScoreName",
    "ScoreTest",
    "advantage",
    "advantage_differences",
    "alternative_annotator_test",
    "bradley_terry",
    "corrected_rate",
    "dawid_skene",
    "dawid_skene_intervals",
    "effective_number",
    "judge_plan",
    "label_allocation",
    "labels_needed",
    "position_bias",
    "prediction_powered_mean",
    "rate_estimates",
    "reference_difference",
    "score_test",
]

_HOMES = {
    "EPSILONS": "annotators",
    "AlternativeAnnotatorTest": "annotators",
    "BradleyTerry": "preferences",
    "DawidSkene": "latent_classes",
    "DawidSkeneIntervals": "latent_classes",
    "EffectiveNumber": "latent_classes",
    "Grades": "annotators",
    "HumanBesideJudge": "annotators",
    "JudgeDifference": "annotators",
    "JudgePlan": "power",
    "PairedTest": "_paired",
    "PositionBias": "preferences",
    "RateEstimate": "rates",
    "RateEstimates": "rates",
    "Score": "annotators",
    "ScoreName": "annotators",
    "ScoreTest": "_paired",
    "advantage": "annotators",
    "advantage_differences": "annotators",
    "alternative_annotator_test": "annotators",
    "bradley_terry": "preferences",
    "corrected_rate": "rates",
    "dawid_skene": "latent_classes",
    "dawid_skene_intervals": "latent_classes",
    "effective_number": "latent_classes",
    "judge_plan": "power",
    "label_allocation": "rates",
    "labels_needed": "rates",
    "position_bias": "preferences",
    "prediction_powered_mean": "rates",
    "rate_estimates": "rates",
    "reference_difference": "annotators",
    "score_test": "_paired",
}


# these load numpy and the coefficients
__getattr__ = loaded_from(__name__, _HOMES)
