"""How often each answer was given, a panel a question."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from masrel.lab.report._figure_data import AnswerPanel
from masrel.plots._style import BLUE

_IN_A_ROW = 2
_LONG = 4  # letters of a label that is not slanted


def answer_figure(panels: Sequence[AnswerPanel]) -> Figure:
    """Return bars of counts, one panel a question and session."""
    n_panels = len(panels)
    n_columns = min(_IN_A_ROW, n_panels)
    n_rows = -(-n_panels // n_columns)
    figure = Figure(figsize=(0.4 + 3.6 * n_columns, 0.5 + 2.4 * n_rows))
    all_axes = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
    for axes, panel in zip(all_axes, panels, strict=False):
        _draw(axes, panel)
    for axes in all_axes[n_panels:]:
        axes.set_visible(False)
    return figure


def _draw(axes: Axes, panel: AnswerPanel) -> None:
    axes.bar(range(len(panel.counts)), panel.counts, width=0.8, color=BLUE)
    is_long = max(map(len, panel.labels)) > _LONG
    slanted: dict[str, Any] = {"rotation": 45, "ha": "right", "rotation_mode": "anchor"}
    look = slanted if is_long else {}
    axes.set_xticks(range(len(panel.labels)), panel.labels, **look)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("answers")
    axes.set_title(panel.title, loc="left")
