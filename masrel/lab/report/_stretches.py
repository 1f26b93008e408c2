"""Section `speeds`: how fast raters stretched."""

import math
from collections.abc import Sequence

from masrel.lab.analysis import Speed, Speeds, SpeedSummary
from masrel.lab.report._figure_data import FIGURES, MANY_RATERS, SpeedColumn
from masrel.lab.report._material import Material
from masrel.pages._sections import Drawing, Paragraph, Section, absent_section
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import Column, Table, Value, number


def speeds_section(material: Material) -> Section:
    """Show the mean speeds per model and per rater."""
    speeds = material.analysis.speeds
    title = "Stretching speeds"
    if speeds is None or not speeds.values:
        return absent_section("speeds", title, speeds.reason if speeds else None)
    text = (
        "Mean speed of the phase before the catch, which sets the catch angle by "
        "equation (2); below ν_L the catch angle no longer changes."
    )
    if speeds.n_missing:
        text += f" Ratings whose speed is not known: {speeds.n_missing}."
    if has_many(speeds.values):
        text += (
            " Where a rater stretched the arm more than once, n counts stretches that "
            "reached ν_th."
        )
    digits = whole_or_tenths([speed.mean_speed_deg_s for speed in speeds.values])
    return Section(
        name="speeds",
        title=title,
        blocks=(
            Paragraph(text=text),
            _summary_table(material, speeds.by_model, "model", digits),
            _speed_drawing(material, speeds),
            _summary_table(material, speeds.by_rater, "rater", digits),
        ),
    )


def _summary_table(
    material: Material, summaries: tuple[SpeedSummary, ...], by: str, digits: int
) -> Table:
    rows = tuple(
        (s.name, s.session, s.n, s.mean, s.sd, s.least, s.most) for s in summaries
    )
    page_rows, notes = _few_of(summaries, rows) if by == "rater" else (None, ())
    return Table(
        name=f"speeds_by_{by}",
        caption=f"Mean stretching speeds per {by} (deg/s)",
        columns=(
            Column(key=by, heading=by.capitalize(), align="left"),
            Column(key="session", heading="Session", align="left"),
            Column(key="n", heading="n"),
            Column(key="mean_deg_s", heading="Mean", digits=1),
            Column(key="sd_deg_s", heading="SD (n − 1)", digits=1),
            Column(key="least_deg_s", heading="Least", digits=digits),
            Column(key="most_deg_s", heading="Most", digits=digits),
        ),
        rows=rows,
        page_rows=page_rows,
        notes=notes,
        data=material.data,
    )


def _few_of(
    summaries: Sequence[SpeedSummary], rows: Sequence[tuple[Value, ...]]
) -> tuple[tuple[tuple[Value, ...], ...] | None, tuple[str, ...]]:
    # of sessions of many raters, five of them; None where there are no such sessions
    shown: list[tuple[Value, ...]] = []
    counts = []
    for session in dict.fromkeys(s.session for s in summaries):
        mine = [i for i, s in enumerate(summaries) if s.session == session]
        if len(mine) <= MANY_RATERS:
            shown += [rows[i] for i in mine]
            continue
        counts.append(f"{len(mine)} of session {session}")
        for rank, at in at_ranks([summaries[i].mean for i in mine]).items():
            name, *cells = rows[mine[at]]
            shown.append((f"{name} ({rank})", *cells))
    if not counts:
        return None, ()
    note = f"Five raters by their mean speed, of {' and '.join(counts)}; the file has"
    return tuple(shown), (f"{note} all.",)


def _speed_columns(material: Material, speeds: Speeds) -> tuple[SpeedColumn, ...]:
    known: dict[tuple[str, str, str], tuple[float, ...]] = {}
    graded: dict[tuple[str, str, str], tuple[float, ...]] = {}
    for value in speeds.values:
        key = (value.session, value.model, value.rater)
        known[key] = (*known.get(key, ()), value.mean_speed_deg_s)
        if value.is_graded:
            graded[key] = (*graded.get(key, ()), value.mean_speed_deg_s)
    return tuple(
        SpeedColumn(
            model=s.name,
            session=s.session,
            speeds=tuple(
                known.get((s.session, s.name, r), ()) for r in material.raters
            ),
            mean=s.mean,
            graded=tuple(
                graded.get((s.session, s.name, r), ()) for r in material.raters
            ),
        )
        for s in speeds.by_model
    )


def _speed_drawing(material: Material, speeds: Speeds) -> Drawing:
    text = "; ".join(
        f"{s.name} in {s.session}: mean {number(s.mean, 0)}, "
        f"{number(s.least, 0)} to {number(s.most, 0)} deg/s"
        for s in speeds.by_model
    )
    slowest = material.protocol.elbow.slowest_mean_speed_deg_s
    return Drawing(
        name="speeds",
        caption=_speed_caption(len(material.raters), speeds.values),
        alt=f"Dot plot of speeds. {text}.",
        content=Drawn(
            FIGURES + "_study_figures:speed_figure",
            (_speed_columns(material, speeds), material.raters, slowest),
        ),
        stamp=material.stamp,
    )


def _speed_caption(n_raters: int, speeds: Sequence[Speed]) -> str:
    dashed = "Dashed: ν_L, below which the catch angle stays the same."
    if n_raters > MANY_RATERS:
        return (
            f"Mean stretching speeds of {n_raters} raters for every model: the middle "
            f"50 % (broad), the middle 90 % (thin) and the mean (bar). {dashed}"
        )
    of = "rater for every model, and the mean over raters"
    if has_many(speeds):
        of = "stretch of every rater for every model, and the mean over stretches"
    caption = f"Mean stretching speed of every {of} (bar). {dashed}"
    if any(speed.is_graded for speed in speeds):
        caption += " Ringed: the stretch that the rater said the grade rests on."
    return caption


def has_many(speeds: Sequence[Speed]) -> bool:
    """Say whether there was more than one stretch to a presentation."""
    return any(speed.stretch is not None and speed.stretch > 1 for speed in speeds)


def whole_or_tenths(values: Sequence[float]) -> int:
    """Return the decimals a column of measurements needs: 0 if all are whole."""
    known = [value for value in values if math.isfinite(value)]
    return 0 if all(float(value).is_integer() for value in known) else 1


def at_ranks(values: Sequence[float]) -> dict[str, int]:
    """Return which of many values are the least, the quartiles and the most."""
    order = sorted(range(len(values)), key=values.__getitem__)
    names = ("lowest", "lower quartile", "median", "upper quartile", "highest")
    return {name: order[k * (len(order) - 1) // 4] for k, name in enumerate(names)}
