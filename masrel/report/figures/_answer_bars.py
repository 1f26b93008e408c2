"""How often each answer was given, a panel a question."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from masrel.report._figure_data import AnswerBars, AnswerPanel
from masrel.report.figures._style import BLUE

_IN_A_ROW = 2
_LONG = 4  # letters of a label that stands upright


def answer_figure(content: AnswerBars) -> Figure:
    """Return bars of counts, one panel a question and session."""
    n_panels = len(content.panels)
    n_columns = min(_IN_A_ROW, n_panels)
    n_rows = -(-n_panels // n_columns)
    figure = Figure(figsize=(0.4 + 3.6 * n_columns, 0.5 + 2.4 * n_rows))
    all_axes = figure.subplots(n_rows, n_columns, squeeze=False).flat
    for axes, panel in zip(all_axes, content.panels, strict=False):
        _draw(axes, panel)
    for axes in list(all_axes)[n_panels:]:
        axes.set_visible(False)
    return figure


def _draw(axes: Axes, panel: AnswerPanel) -> None:
    axes.bar(range(len(panel.counts)), panel.counts, width=0.8, color=BLUE)
    is_long = max(map(len, panel.labels)) > _LONG
    axes.set_xticks(
        range(len(panel.labels)), panel.labels, rotation=45 if is_long else 0
    )
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("answers")
    axes.set_title(panel.title, loc="left")
