"""From ratings in any form to their agreement in one call, like ``masrel agree``."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from masrel._input import check_option, refuse, shown
from masrel.agreement import BandScale, Metric
from masrel.analysis._file_estimates import Answer, Estimating, Questions
from masrel.analysis._file_questions import answers
from masrel.errors import MasrelError
from masrel.estimates import Estimate, IntervalMethod, Target, _Convention
from masrel.ratings import Finding, RatingsFile, Reading, read_ratings
from masrel.tables._answer_tables import Detail, agreement_sentences
from masrel.tables._first_screen import (
    first_screen,
    lacks_interval,
    reading_warnings,
)
from masrel.tables._tables import SIMULATED, Table, as_html, as_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_Options = TypeVar("_Options", Reading, Estimating)

_WIDTH = 88  # of notes
_CHOICES = {
    "target": Target,
    "interval": IntervalMethod,
    "convention": _Convention,
    "metric": Metric,
    "words": BandScale,
}
_ASK = 'No interval; for other items like these: masrel.agree(…, target="items").'

_NAMES = (
    "In Python options are fields, --no-item is reading=Reading(no_item=True) and "
    "--weights is estimating=Estimating(weights=…); --missing is missing_codes and "
    "--from is source."
)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Agreement:
    """Agreement of raters: one row per coefficient, and what was read.

    Attributes
    ----------
    file : RatingsFile
        The ratings, and what was read of them.
    answer : Answer
        The estimates with their notes.
    estimating : Estimating
        What was estimated, and how.
    reading : Reading
        How it was read.
    """

    file: RatingsFile
    answer: Answer = field(compare=False)
    estimating: Questions
    reading: Reading

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Every estimate with its interval."""
        return tuple(row.estimate for row in self.answer.estimates)

    @property
    def table(self) -> "pd.DataFrame":
        """The estimates as a DataFrame, with columns of groups first if there are any.

        Its columns are coefficient, value, standard_error, low, high, method, n_items
        and n_raters; low and high are ``nan`` where there is no interval.
        """
        import pandas as pd

        return pd.DataFrame(
            {
                **row.keys,
                "coefficient": of.coefficient,
                "value": of.value,
                "standard_error": of.standard_error,
                "low": getattr(of.interval, "low", math.nan),
                "high": getattr(of.interval, "high", math.nan),
                "method": getattr(of.interval, "method", None),
                "n_items": of.n_items,
                "n_raters": of.n_raters,
            }
            for row, of in zip(self.answer.estimates, self.estimates, strict=True)
        )

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """What may have been read wrongly, and which option tells."""
        return reading_warnings(self.file, self.answer)

    @property
    def notes(self) -> tuple[str, ...]:
        """How the estimates were made, and what to know of them."""
        return self._screen("usual").notes

    def _screen(self, detail: Detail) -> Table:
        # in brief with a sentence of result, and what may have been read wrongly
        is_text = detail == "brief"
        (screen,) = first_screen(
            *(self.file, self.estimating, [self.answer]), detail=detail, is_text=is_text
        )
        if is_text:
            warned = (f"warning: {text}" for text in self.warnings)
            screen = replace(screen, notes=(*screen.notes, *warned))
        is_asked = self.estimating.target is not None or not lacks_interval(self.answer)
        return screen if is_asked else replace(screen, notes=(*screen.notes, _ASK))

    def sentence(self) -> str:
        """Return a sentence for a paper of every estimate, one a line."""
        return agreement_sentences(
            self.answer, bands=self.estimating.words, data=self._screen("usual").data
        )

    def to_html(self) -> str:
        """Return one page with results, pictures, items to discuss and methods.

        It needs no other file, and is what ``masrel agree FILE --html`` writes.
        """
        from masrel.pages._answer_page import answer_page

        return answer_page(
            self.file, self.estimating, [self.answer], reading=self.reading.record()
        )

    def plot(
        self, picture: str = "forest", *, group: str = "", ax: "Axes | None" = None
    ) -> "Axes":
        """Draw a picture of the ratings or their estimates, and return its axes.

        Parameters
        ----------
        picture : str, optional
            forest, pairs, confusion, bland_altman, grades, categories, items or
            components.
        group : str, optional
            Of which group, where groups or sessions are told apart; the first unless
            given.
        ax : Axes, optional
            Where it is drawn; on a new figure of pyplot unless given.

        Returns
        -------
        Axes
            Those that it is drawn on.

        Raises
        ------
        ParameterError
            If these ratings have no such picture, or no such group.
        """
        from masrel.pages._pictures import picture_of
        from masrel.plots import _on_axes

        drawn = picture_of(
            picture, self.file, self.estimating, [self.answer], group=group
        )
        return _on_axes(drawn, ax, SIMULATED if self.file.simulated else "")

    def __str__(self) -> str:
        return as_text(self._screen("brief"), width=_WIDTH)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return as_html(self._screen("brief"))


def agree(
    data: Any,
    *,
    item: str | Sequence[str] | None = None,
    rater: str | None = None,
    grade: str | None = None,
    raters: str | Sequence[str] | None = None,
    target: Target | None = None,
    coefficients: str | Sequence[str] | None = None,
    reading: Reading | None = None,
    estimating: Estimating | None = None,
) -> Agreement:
    """Estimate how well the raters of a table or a file agree.

    The table is read by the rules of a file, and what could be read in two ways is
    refused in one sentence. Messages name options as the command line has them:
    ``--no-item`` is ``Reading(no_item=True)``.

    Parameters
    ----------
    data : DataFrame, path, dict of columns or array_like
        Ratings with one row per item and one column per rater, or one row per rating: a
        DataFrame of pandas or polars, a table of Arrow or a relation of DuckDB; the
        path of a file in any form; columns by name; or rows of grades, items by raters.
        Ordered categories give the scale in order, and a named index is a column.
    item : str or sequence of str, optional
        Column of the items; several name an item together.
    rater, grade : str, optional
        Columns of a long table, with one row per rating.
    raters : str or sequence of str, optional
        Columns of a wide table that are raters.
    target : {"items", "raters", "both"}, optional
        The population to generalise to; without it no interval is given.
    coefficients : str or sequence of str, optional
        Names of coefficients, or "all" that fit; percent agreement and Fleiss' kappa
        unless given.
    reading : Reading, optional
        How the table is read: these columns, and everything else.
    estimating : Estimating, optional
        What is estimated, and how: the target and coefficients, and everything else.

    Returns
    -------
    Agreement
        The estimates, as a DataFrame in `table`, and what was read.

    Raises
    ------
    RatingsError
        If it is not a table of ratings, or could be more than one.
    ParameterError
        If an option is invalid, is given twice, or does not fit the ratings.

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"patient": ["A", "B", "C", "D", "E", "F"],
    ...                       "Kim": [1, 2, 3, 1, 2, 3], "Lee": [1, 2, 3, 1, 3, 3]})
    >>> result = agree(frame, target="items", coefficients="cohen_kappa")
    >>> print(f"{result.table.loc[0, 'value']:.3f}")
    0.750
    """
    how = _joined(
        "reading",
        reading,
        Reading(),
        item=item,
        rater=rater,
        grade=grade,
        raters=raters,
    )
    what = _joined(
        "estimating", estimating, Estimating(), target=target, coefficients=coefficients
    )
    for name, kind in _CHOICES.items():
        if (value := getattr(what, name)) is not None:
            check_option(name, value, get_args(kind))
    questions = Questions(
        **{of.name: getattr(what, of.name) for of in fields(Estimating)},
        reference=how.reference,
    )
    try:
        file = read_ratings(data, how)
        questions = questions.on_scale(file).checked(how.clusters)
        file, (answer,) = answers(file, questions)
    except MasrelError as error:
        error.add_note(_NAMES)
        raise
    return Agreement(file=file, answer=answer, estimating=questions, reading=how)


def _joined(
    name: str, options: _Options | None, default: _Options, **short_cuts: Any
) -> _Options:
    """Return options with those that are arguments of their own."""
    chosen, kind = default if options is None else options, type(default)
    changes = {key: value for key, value in short_cuts.items() if value is not None}
    refuse(
        (
            not isinstance(chosen, kind),
            f"{name}: needs masrel.{kind.__name__}(…), got {shown(options)}",
        ),
        *(
            (
                getattr(chosen, key, None) != getattr(default, key),
                f"{key}: needed once, got it as an argument and in {name}",
            )
            for key in changes
        ),
    )
    return replace(chosen, **changes)
