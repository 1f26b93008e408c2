"""The look all figures share, and how a figure becomes files.

Colours are Okabe and Ito's, which colour-blind readers tell apart; shapes, line
styles and text repeat what the colours say, so that a grey print loses nothing.
"""

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.text import Text

from masrel.report import _figure_data as data
from masrel.report.figures._margins import arrange
from masrel.report.figures._picture import files_of

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

BLACK = "#000000"
GREY = "#6B6B6B"
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILLION = "#D55E00"
ALARM = "#A63C00"  # darker, so that letters in it can be read on white

DASHES = (0, (4, 3))
"""Line style of what is a reference, not data."""

_NO_STYLE = ("backend", "backend_fallback")
"""What says how figures are shown, not how they look."""

SHADES = {"pre-catch": "#FFFFFF", "catch": "#D9D9D9", "post-catch": "#F0F0F0"}
"""Background of each phase of a stretch."""

STYLE: "dict[RcKeyType, object]" = {
    "font.family": "DejaVu Sans",  # ships with matplotlib: the same everywhere
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "svg.hashsalt": "masrel",  # ids of an SVG are otherwise random
    "svg.fonttype": "path",
    "pdf.fonttype": 42,  # letters stay letters, as journals ask
    "text.hinting": "none",  # as in vectors, where texts are measured
    "figure.dpi": 72,  # a point is a pixel where labels are measured
    "axes.titley": 1.0,  # titles stand where they are placed, and are not moved about
}


_MAX_LETTERS = 22  # of a name


def short_name(name: str) -> str:
    """Return a name that has room at an axis: the middle of a long one goes."""
    # names often differ at their end
    if len(name) <= _MAX_LETTERS:
        return name
    half = (_MAX_LETTERS - 1) // 2
    return f"{name[:half]}…{name[-half:]}"


_DEFAULTS = {
    key: value for key, value in mpl.rcParamsDefault.items() if key not in _NO_STYLE
}


@contextmanager
def house_style(*, parse_math: bool = False) -> Iterator[None]:
    """Draw in the house style alone: a reader's own matplotlibrc changes nothing."""
    # parse_math: as powers of ten need it; a title or a name may have any letters in it
    with mpl.rc_context():
        # not mpl.rcdefaults, which reads every style that matplotlib has
        mpl.rcParams.update(_DEFAULTS)
        mpl.rcParams.update(STYLE)
        mpl.rcParams["text.parse_math"] = parse_math
        yield


def draw(
    content: data.Content, *, stamp: str, forms: Sequence[data.Form] = ("png", "svg")
) -> dict[data.Form, bytes]:
    """Draw values in the house style.

    Parameters
    ----------
    content : Content
        What is drawn.
    stamp : str
        The line that says where the data come from; none if empty.
    forms : sequence of {"png", "svg", "pdf"}, optional
        Which files to make.

    Returns
    -------
    dict of str to bytes
        Each form's file.
    """
    with house_style():
        return finished(_figure(content), stamp=stamp, forms=forms)


def finished(
    figure: Figure, *, stamp: str, forms: Sequence[data.Form] = ("png", "svg")
) -> dict[data.Form, bytes]:
    """Return the files of a figure of the house style, under its stamp."""
    arrange(figure, _stamp(figure, stamp) if stamp else None)
    return files_of(figure, forms)


def _stamp(figure: Figure, text: str) -> Text:
    is_loud = text.isupper()
    # 7 pt letters are about 0.054 in wide; a long source goes on two lines
    n_letters = int(figure.get_figwidth() / 0.054) - 2
    return figure.text(
        0.995,
        1.0,
        textwrap.fill(text, n_letters),
        ha="right",
        va="top",
        fontsize=9.5 if is_loud else 7,
        color=ALARM if is_loud else GREY,
        weight="bold" if is_loud else "normal",
    )


def _figure(content: data.Content) -> Figure:
    # Imported here: one figure loads what no other needs.
    match content:
        case (
            data.GradeGrid()
            | data.GradeCounts()
            | data.GradesByAim()
            | data.SpeedDots()
        ):
            return _study_figure(content)
        case data.TraceColumns() | data.MeasuredTorque():
            from masrel.report.figures import _trace_figures as traces

            if isinstance(content, data.TraceColumns):
                return traces.trace_figure(content)
            return traces.measured_figure(content)
        case data.Forest():
            from masrel.report.figures._forest import forest_figure

            return forest_figure(content)
        case (
            data.PairMaps()
            | data.LearningView()
            | data.OrderPanels()
            | data.OrderDifferences()
            | data.RaterFlow()
            | data.AnswerBars()
        ):
            return _rater_figure(content)
        case data.PlanCurves():
            from masrel.report.figures._planning_figure import planning_figure

            return planning_figure(content)
        case data.Differences():
            from masrel.report.figures._limits_figure import limits_figure

            return limits_figure(content)
        case data.LatentScale():
            from masrel.report.figures._latent_scale import latent_figure

            return latent_figure(content)
        case data.Stretches() | data.CatchCurves() | data.CatchSchematic():
            from masrel.report.figures._scene_figures import scene_figure

            return scene_figure(content)
        case _:
            return _joint_figure(content)


def _study_figure(
    content: data.GradeGrid | data.GradeCounts | data.GradesByAim | data.SpeedDots,
) -> Figure:
    from masrel.report.figures import _study_figures as study

    if isinstance(content, data.GradeGrid):
        return study.grade_figure(content)
    if isinstance(content, data.GradeCounts):
        return study.count_figure(content)
    if isinstance(content, data.GradesByAim):
        return study.aim_figure(content)
    return study.speed_figure(content)


def _rater_figure(
    content: (
        data.PairMaps
        | data.LearningView
        | data.OrderPanels
        | data.OrderDifferences
        | data.RaterFlow
        | data.AnswerBars
    ),
) -> Figure:
    if isinstance(content, data.OrderPanels):
        from masrel.report.figures._order_figure import order_figure

        return order_figure(content)
    if isinstance(content, data.OrderDifferences):
        from masrel.report.figures._order_differences import difference_figure

        return difference_figure(content)
    if isinstance(content, data.RaterFlow):
        from masrel.report.figures._rater_flow import flow_figure

        return flow_figure(content)
    if isinstance(content, data.AnswerBars):
        from masrel.report.figures._answer_bars import answer_figure

        return answer_figure(content)
    if isinstance(content, data.LearningView):
        from masrel.report.figures._learning_figure import learning_figure

        return learning_figure(content)
    from masrel.report.figures._rater_pairs import rater_figure

    return rater_figure(content)


def _joint_figure(
    content: data.ToneView | data.JointFitView | data.FrictionView,
) -> Figure:
    if isinstance(content, data.ToneView):
        from masrel.report.figures._tone_figures import tone_figure

        return tone_figure(content)
    from masrel.report.figures._fit_figures import fit_figure

    return fit_figure(content)
