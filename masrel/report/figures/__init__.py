"""Figures: the only package that draws.

In: what to draw, as plain frozen values. Out: PNG, SVG or PDF, the same bytes for the
same values.
"""

from collections.abc import Sequence

from matplotlib.figure import Figure

from masrel.report import _figure_data as data
from masrel.report.figures._style import file_of, house_style, put_stamp

__all__ = ["draw"]


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
        figure = _figure(content)
        put_stamp(figure, stamp)
        return {form: file_of(figure, form) for form in forms}


def _figure(content: data.Content) -> Figure:
    # Imported here: one figure loads what no other needs.
    match content:
        case data.GradeGrid() | data.SpeedDots() | data.TraceColumns():
            from masrel.report.figures._study_figures import study_figure

            return study_figure(content)
        case data.Forest():
            from masrel.report.figures._forest import forest_figure

            return forest_figure(content)
        case data.LatentScale():
            from masrel.report.figures._latent_scale import latent_figure

            return latent_figure(content)
        case data.Stretches() | data.CatchCurves() | data.CatchSchematic():
            from masrel.report.figures._scene_figures import scene_figure

            return scene_figure(content)
        case data.JointFitView() | data.FrictionView():
            from masrel.report.figures._fit_figures import fit_figure

            return fit_figure(content)
