"""What an analysis holds, as JSON with every digit kept, and estimates as a frame.

Every number that is asked for is there, or the reason why it is not.
"""

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from masrel._files import usual_mode, write_file
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval, as_document
from masrel.lab.protocol import EstimatePlan, JudgeKeys

if TYPE_CHECKING:
    from pandas import DataFrame

    from masrel.judges import AlternativeAnnotatorTest


@dataclass(frozen=True, slots=True, kw_only=True)
class RaterEstimate:
    """One rater's agreement with him- or herself.

    Attributes
    ----------
    rater : str
        The rater.
    estimate : Estimate
        Cohen's kappa of the rater's two sessions.
    """

    rater: str
    estimate: Estimate


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedEstimate:
    """One line of the analysis plan and what came of it.

    Attributes
    ----------
    line : EstimatePlan
        The line of the plan, as in the protocol.
    items : tuple of str
        The haptic models that were used.
    raters : tuple of str
        The raters that were used.
    n_missing : int
        Ratings the design has and the data have not.
    estimate : Estimate or None
        What was estimated; None when it is not in these data.
    by_rater : tuple of RaterEstimate
        For test-retest: every rater alone.
    reason : str or None
        Why there is no estimate, or None.
    """

    line: EstimatePlan
    items: tuple[str, ...] = ()
    raters: tuple[str, ...] = ()
    n_missing: int = 0
    estimate: Estimate | None = None
    by_rater: tuple[RaterEstimate, ...] = ()
    reason: str | None = None

    @property
    def models(self) -> tuple[str, ...]:
        """The models of the items: one that came again is an item each time."""
        return tuple(dict.fromkeys(item.partition("#")[0] for item in self.items))


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedJudge:
    """A judge of the plan beside the humans of a session.

    Attributes
    ----------
    line : JudgeKeys
        What the plan asks for.
    result : AlternativeAnnotatorTest or None
        Whether the judge may replace a human; items are presentations.
    reason : str or None
        Why there is no result, or None.
    """

    line: JudgeKeys
    result: "AlternativeAnnotatorTest | None" = None
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelAgreement:
    """How many raters gave one model the grade it was built for.

    Attributes
    ----------
    model : str
        The haptic model.
    intended_grade : str
        The grade it was built for.
    n_ratings, n_agree : int
        Ratings there are, and those equal to the intended grade.
    percent : float
        Their ratio in percent; ``nan`` without ratings.
    """

    model: str
    intended_grade: str
    n_ratings: int
    n_agree: int
    percent: float


@dataclass(frozen=True, slots=True, kw_only=True)
class IntendedAgreement:
    """Agreement with the intended grade in one session.

    Attributes
    ----------
    session : str or None
        The session; None when no session has ratings.
    models : tuple of ModelAgreement
        Every standard model.
    mean, sd : float
        Mean of the models' percentages and their standard deviation (n − 1);
        ``nan`` when undefined.
    reason : str or None
        Why `mean` or `sd` is undefined, or None.
    """

    session: str | None
    models: tuple[ModelAgreement, ...]
    mean: float
    sd: float
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class InPersonPair:
    """One rater's grade of a patient and of the model built from that patient.

    Attributes
    ----------
    rater, model : str
        Who, and which haptic model.
    in_person, haptic : str
        The two grades.
    """

    rater: str
    model: str
    in_person: str
    haptic: str


@dataclass(frozen=True, slots=True, kw_only=True)
class InPersonAgreement:
    """Agreement of grades given in person and on the haptic models.

    Attributes
    ----------
    session : str or None
        The session of the haptic grades; None without one.
    pairs : tuple of InPersonPair
        Every pair of grades.
    n_pairs, n_equal : int
        How many, and how many are equal.
    n_unpaired : int
        In-person entries without both grades.
    reason : str or None
        Why there are no pairs, or None.
    """

    session: str | None
    pairs: tuple[InPersonPair, ...]
    n_pairs: int
    n_equal: int
    n_unpaired: int
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Speed:
    """Mean speed of a stretch, or of one rater's stretches of one model, deg/s.

    Attributes
    ----------
    session, rater, model : str
        Where it was made.
    mean_speed_deg_s : float
        Mean speed of the pre-catch phase, deg/s.
    stretch : int or None
        Which stretch of the presentation it was, from 1; None where the ratings have
        one speed for all.
    is_graded : bool
        Whether the rater said that the grade rests on this stretch.
    """

    session: str
    rater: str
    model: str
    mean_speed_deg_s: float
    stretch: int | None = None
    is_graded: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedSummary:
    """Speeds of one model or of one rater in one session, deg/s.

    Attributes
    ----------
    session : str
        The session.
    name : str
        The model or rater.
    n : int
        Speeds there are.
    mean, sd, least, most : float
        Their mean, standard deviation (n − 1) and range, deg/s; ``nan`` when
        undefined.
    """

    session: str
    name: str
    n: int
    mean: float
    sd: float
    least: float
    most: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Speeds:
    """How fast the raters stretched.

    Attributes
    ----------
    values : tuple of Speed
        Every known speed.
    by_model, by_rater : tuple of SpeedSummary
        Summaries.
    n_missing : int
        Ratings whose speed is not known.
    reason : str or None
        Why there are no speeds, or None.
    """

    values: tuple[Speed, ...]
    by_model: tuple[SpeedSummary, ...]
    by_rater: tuple[SpeedSummary, ...]
    n_missing: int
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Presentations:
    """How often the arm was stretched, and how often nothing could be felt.

    Attributes
    ----------
    n_presentations : int
        Those whose stretches are known.
    n_stretches : int
        Stretches in all of them.
    n_felt, n_below_threshold, n_no_catch, n_unknown : int
        Presentations in which what the model has was felt; in which no stretch reached
        ν_th; in which no catch came though the model has one at that speed; and those
        for which it is unknown.
    n_grip_lost : int or None
        Presentations in which the arm came loose and the model let it go; None where
        no log says so of any.
    """

    n_presentations: int
    n_stretches: int
    n_felt: int
    n_below_threshold: int
    n_no_catch: int
    n_unknown: int
    n_grip_lost: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerCount:
    """How often one answer, or one of a range, was given.

    Attributes
    ----------
    label : str
        The answer, or the range.
    n : int
        How often it was given.
    """

    label: str
    n: int


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionSummary:
    """How one question was answered in one session.

    Attributes
    ----------
    questionnaire, question : str
        Their ids.
    session : str or None
        The session; None for a question about the study.
    model : str or None
        The model, for a question about presentations.
    n, n_missing : int
        Answers there are, and those there are not.
    mean, sd, median, least, most : float
        Of answers that are numbers, with the standard deviation of n − 1; ``nan`` where
        undefined.
    counts : tuple of AnswerCount
        Of each choice or whole number, or of each tenth of a wide range; empty for
        texts, and where there is no answer. It is empty, too, and all numbers are
        ``nan``, where fewer than 5 raters answered a question that is not public.
    is_reconstructed : bool
        Whether the answers were never given, and only fit what is printed of them.
    """

    questionnaire: str
    question: str
    session: str | None
    model: str | None
    n: int
    n_missing: int
    mean: float
    sd: float
    median: float
    least: float
    most: float
    counts: tuple[AnswerCount, ...]
    is_reconstructed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """Everything a study's plan asks for.

    Attributes
    ----------
    study : str
        Id of the study.
    level : float
        Nominal level of the intervals.
    estimates : tuple of PlannedEstimate
        One per line of the plan, in its order.
    judges : tuple of PlannedJudge
        One per judge of the plan.
    intended : IntendedAgreement or None
        None when no section asks for it.
    in_person : InPersonAgreement or None
        None when no section asks for it.
    speeds : Speeds or None
        None when no section asks for them.
    presentations : Presentations or None
        None when nothing is known of the stretches.
    questionnaires : tuple of QuestionSummary
        One per question, session and model that it is about.
    simulated : bool
        Whether any rating is simulated.
    excluded : tuple of str
        Raters who are left out of every number.
    plan_changes : tuple of mapping of str to (str or None)
        What has changed in the plan since it was drawn: ``key``, ``before`` and
        ``after`` as JSON, and when that was recorded, ``time_utc``.
    inputs : mapping of str to str
        SHA-256 of every input, by name.
    masrel_version : str
        The version that computed it.
    """

    study: str
    level: float
    estimates: tuple[PlannedEstimate, ...]
    judges: tuple[PlannedJudge, ...] = ()
    intended: IntendedAgreement | None
    in_person: InPersonAgreement | None
    speeds: Speeds | None
    presentations: Presentations | None
    questionnaires: tuple[QuestionSummary, ...]
    simulated: bool
    excluded: tuple[str, ...] = ()
    plan_changes: tuple[Mapping[str, str | None], ...] = ()
    inputs: Mapping[str, str]
    masrel_version: str


ANALYSIS_FORMAT = 1
"""Version of the file of an analysis; one that names none is of version 1."""


# Fields that analyses once had not, and have not in a file where they are empty
_LATER = ("judges", "excluded", "plan_changes", "questionnaires")


def as_analysis_document(analysis: Analysis) -> dict[str, object]:
    """Turn an analysis into plain values for JSON, ``nan`` as None.

    Parameters
    ----------
    analysis : Analysis
        The analysis.

    Returns
    -------
    dict
        The version of its format, and its fields in order, `excluded`, `plan_changes`
        and `questionnaires` only where there are some; every part carries the hashes of
        its inputs.
    """
    document: dict[str, object] = {"format": ANALYSIS_FORMAT}
    for field in dataclasses.fields(analysis):
        value = getattr(analysis, field.name)
        if field.name == "estimates":
            document[field.name] = [_with_inputs(line, analysis) for line in value]
        elif dataclasses.is_dataclass(value):
            document[field.name] = _with_inputs(value, analysis)
        elif value or field.name not in _LATER:
            document[field.name] = as_plain(value)
    return document


def write_analysis(
    analysis: Analysis,
    path: Path,
    *,
    within: Path | None = None,
    is_private: bool = False,
) -> None:
    """Write an analysis as JSON; the same analysis gives the same bytes.

    Parameters
    ----------
    analysis : Analysis
        The analysis.
    path : Path
        The file.
    within : Path, optional
        A folder that the file may not leave by a link, such as the study's.
    is_private : bool, optional
        Whether it is its owner's alone, as of a study that goes on.

    Raises
    ------
    ParameterError
        If `path` is the place of a study's primary record, or not within `within`.
    OSError
        If the file cannot be written; what was there is then there still.
    """
    mode = 0o600 if is_private else usual_mode(0o666)
    write_file(path, analysis_text(analysis), within=within, mode=mode)


def analysis_text(analysis: Analysis) -> str:
    """Return an analysis as its file has it."""
    document = as_analysis_document(analysis)
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    return text + "\n"


def to_frame(results: "Iterable[Estimate] | Mapping[str, Estimate]") -> "DataFrame":
    """Put several estimates into a DataFrame, one row each.

    Parameters
    ----------
    results : iterable of Estimate, or mapping of str to Estimate
        The estimates, with or without intervals; names of a mapping become the index.

    Returns
    -------
    DataFrame, shape (n_results, n_fields)
        A column for each field of `Estimate`, by its name, with the fields of
        `Interval` in place of its interval; why an interval is undefined is
        ``interval_reason``. Columns are the same for any results, and empty where a
        result has no such thing. Every digit is kept.

    Raises
    ------
    ParameterError
        If a result is not an `Estimate`.
    ImportError
        If pandas is not installed.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa, gwet_ac
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]
    >>> frame = to_frame({"kappa": fleiss_kappa(ratings), "AC1": gwet_ac(ratings)})
    >>> frame[["coefficient", "value", "n_items"]].round(3)
            coefficient  value  n_items
    kappa  fleiss_kappa  0.467        4
    AC1         gwet_ac  0.529        4
    """
    from pandas import DataFrame  # loaded only when asked for

    index = None
    if isinstance(results, Mapping):
        index, results = list(results), results.values()
    rows = [_row(result, place) for place, result in enumerate(results)]
    # fields of an interval in the place of it
    place = _OF_ESTIMATE.index("interval")
    of_interval = ["interval_reason" if x == "reason" else x for x in _OF_INTERVAL]
    columns = [*_OF_ESTIMATE[:place], *of_interval, *_OF_ESTIMATE[place + 1 :]]
    return DataFrame(rows, index=index, columns=columns)


_OF_INTERVAL = [field.name for field in dataclasses.fields(Interval) if field.repr]
_OF_ESTIMATE = [field.name for field in dataclasses.fields(Estimate)]


def _row(result: object, place: int) -> dict[str, object]:
    # of one estimate; nan where a number is missing
    if not isinstance(result, Estimate):
        raise ParameterError(
            f"results: place {place}: needs an Estimate, got {type(result).__name__}"
        )
    row = {name: getattr(result.interval, name, None) for name in _OF_INTERVAL}
    row["interval_reason"] = row.pop("reason")
    if result.interval is None:
        row |= dict.fromkeys(("low", "high", "level"), math.nan)
    return row | {name: getattr(result, name) for name in _OF_ESTIMATE}


def _with_inputs(part: object, analysis: Analysis) -> dict[str, object]:
    # A line of the plan reads best beside its numbers.
    named = as_plain(part)
    line = {k: v for k, v in named.pop("line", {}).items() if k != "title"}  # in words
    return {**line, **named, "inputs": dict(analysis.inputs)}


def as_plain(value: object) -> Any:
    """Return a result as plain values for JSON, ``nan`` as None."""
    if isinstance(value, Estimate | Interval):
        return as_document(value)
    if isinstance(value, msgspec.Struct):
        value = msgspec.structs.asdict(value)
    elif dataclasses.is_dataclass(value):
        names = (field.name for field in dataclasses.fields(value))
        value = {name: getattr(value, name) for name in names}
    if isinstance(value, Mapping):
        return {str(name): as_plain(part) for name, part in value.items()}
    if isinstance(value, tuple | list):
        return [as_plain(part) for part in value]
    is_undefined = isinstance(value, float) and not math.isfinite(value)
    return None if is_undefined else value
