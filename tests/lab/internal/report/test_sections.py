"""Sections: what they say, and that they say it when there is nothing."""

import dataclasses
import re
from math import radians

import msgspec
import pytest

from masrel.lab.analysis import analyze
from masrel.lab.elbow import ConstantSpeed, peak_torque
from masrel.lab.protocol import EstimatePlan, elbow_parameters
from masrel.lab.ratings import Ratings, ratings_from_rows
from masrel.lab.report._document import SECTIONS
from masrel.lab.report._material import Material, gather
from masrel.pages._sections import Drawing, Paragraph
from masrel.plots import draw
from masrel.scales import Scale
from masrel.tables._tables import Table, as_text
from tests.lab.analysis.studies import (
    hess2012,
    of_session,
    plan,
    protocol_with,
    ratings,
    table_v,
)
from tests.lab.internal.report.made import build_sections
from tests.lab.report.pages import ALL


def material(rows: Ratings, *sections: str) -> Material:
    protocol = protocol_with(plan(), sections=sections)
    analysis = analyze(protocol, rows)
    return gather(protocol, rows, analysis)


def said(rows: Ratings, section: str) -> list[str]:
    (made,) = build_sections(material(rows, section))
    return [block.text for block in made.blocks if isinstance(block, Paragraph)]


def test_every_section_of_a_protocol_is_made_here() -> None:
    hints = msgspec.inspect.type_info(type(hess2012().report))
    (sections,) = [f.type for f in hints.fields if f.name == "sections"]
    (names,) = [
        t for t in sections.types if not isinstance(t, msgspec.inspect.NoneType)
    ]
    assert set(names.item_type.values) == set(SECTIONS) == set(ALL)


@pytest.mark.parametrize(
    ("section", "why"),
    [
        ("in-person", "no grades given in person belong to these ratings"),
        ("speeds", "no rating comes with a stretching speed"),
        ("traces", "no rating comes with a stretching speed"),
    ],
)
def test_a_section_without_its_data_says_why(section: str, why: str) -> None:
    rows = ratings(*of_session("test", R1=("1",), R2=("1",)))
    protocol = protocol_with(sections=(section,))
    made = gather(protocol, rows, analyze(protocol, rows))
    (only,) = build_sections(made)
    assert [block.text for block in only.blocks] == [f"Not in these data: {why}."]
    assert all(block.absent for block in only.blocks)


def test_a_section_that_was_not_computed_says_so() -> None:
    rows = table_v()
    protocol = protocol_with(sections=())
    analysis = analyze(protocol, rows)
    asked = protocol_with(sections=("intended",))
    (only,) = build_sections(gather(asked, rows, analysis))
    assert [b.text for b in only.blocks] == [
        "Not in these data: this was not computed."
    ]


def test_counts_are_in_the_singular_and_plural() -> None:
    (first, *_) = said(table_v(), "design")
    assert "16 haptic models (4 standard, 12 dummy), 8 raters, 2 sessions" in first


def test_sessions_and_models_without_ratings_are_named() -> None:
    (section,) = build_sections(material(table_v(), "design"))
    *_, sessions = section.blocks
    assert isinstance(sessions, Table)
    dummies = ", ".join(f"D{n:02}" for n in range(1, 13))
    assert sessions.notes == (
        "No ratings in these data: session retest.",
        f"Models without ratings in these data: {dummies}.",
    )


def test_a_model_without_an_intended_grade_is_shown_as_such() -> None:
    rows = ratings(*of_session("test", R1=("1",)), ("test", "R1", "D01", "2"))
    (section,) = build_sections(material(rows, "grades"))
    table, drawing = section.blocks
    assert isinstance(table, Table)
    assert isinstance(drawing, Drawing)
    assert table.rows == (("HM1", "1", "1"), ("D01", None, "2"))
    assert "D01: 1 of grade 2" in drawing.alt


def test_repeated_presentations_are_all_shown_in_their_order() -> None:
    rows = ratings(*of_session("test", R1=("1", "2")), repeat=2)
    first = ratings(*of_session("test", R1=("1+", None)), repeat=1)
    both = dataclasses.replace(rows, rows=(*rows.rows, *first.rows))
    (section,) = build_sections(material(both, "grades"))
    shown, drawing = section.blocks
    assert isinstance(shown, Table)
    assert shown.rows == (("HM1", "1", "1+, 1"), ("HM2", "1+", "2"))
    assert isinstance(drawing, Drawing)
    svg = draw(drawing.content, stamp="", forms=("svg",))["svg"].decode()
    # intended, the first of HM1, and what colours mean; HM2's only one is not intended
    texts = re.findall(r"<!-- (.*?) -->", svg)
    assert [texts.count(grade) for grade in ("1", "1+", "2")] == [3, 3, 2]
    assert "Blank" not in drawing.caption


@pytest.mark.parametrize(
    ("sections", "line", "has_order"),
    [
        (("grades",), plan(), False),
        (("grades", "order"), plan(), True),
        (("grades",), plan(weights="linear"), True),
    ],
)
def test_names_without_an_order_are_not_higher_or_lower(
    sections: tuple[str, ...], line: EstimatePlan, has_order: bool
) -> None:
    names = {"session": "test", "model": "D01"}
    grades = [{**names, "rater": f"R{n}", "grade": g} for n, g in ((1, "clonus"),)]
    grades.append({**names, "rater": "R2", "grade": None})
    rows = ratings_from_rows(grades, Scale(name="sign", grades=("normal", "clonus")))
    protocol = protocol_with(line, sections=sections)
    made = gather(protocol, rows, analyze(protocol, rows))
    (drawing,) = (
        of for of in SECTIONS["grades"](made).blocks if isinstance(of, Drawing)
    )
    order = "Darker: a higher grade. " if has_order else ""
    assert drawing.caption == f"Grades of session test. {order}Blank: no rating."


def test_grades_of_many_raters_are_counted() -> None:
    given = {f"R{n}": ("1", "2" if n < 10 else "1+") for n in range(31)}
    protocol, rows = protocol_with(plan()), ratings(*of_session("test", **given))
    raters = [msgspec.structs.replace(protocol.raters[0], id=name) for name in given]
    protocol = msgspec.structs.replace(protocol, raters=tuple(raters))
    made = gather(protocol, rows, analyze(protocol, rows))
    shown, drawing = SECTIONS["grades"](made).blocks
    assert isinstance(shown, Table)
    assert [row[-6:] for row in shown.rows] == [
        (0, 31, 0, 0, 0, 0),
        (0, 0, 21, 10, 0, 0),
    ]
    assert isinstance(drawing, Drawing)
    svg = draw(drawing.content, stamp="", forms=("svg",))["svg"].decode()
    texts = re.findall(r"<!-- (.*?) -->", svg)
    assert [texts.count(n) for n in ("31", "21", "10")] == [4, 2, 2]  # with totals
    assert "the intended grade is framed" in drawing.caption


def test_missing_grades_are_counted_below_the_grid() -> None:
    rows = ratings(*of_session("test", R1=("1", None, "2"), R2=(None, "2", "2")))
    (section,) = build_sections(material(rows, "grades"))
    table = section.blocks[0]
    assert isinstance(table, Table)
    assert table.notes == ("2 ratings missing, shown as –.",)
    assert "–" in as_text(table)


def test_the_mean_agreement_is_told_with_its_deviation() -> None:
    # 84.375 and 11.968, see tests/lab/analysis/test_table_v.py
    assert said(table_v(), "intended") == [
        "Mean over the 4 standard models: 84.4 % (standard deviation between models "
        "12.0, n − 1)."
    ]


def with_laws(elbow: dict[str, object], own: dict[str, object]) -> Material:
    """Table V under other laws: for all models, and for HM2."""
    made = material(table_v(), "design", "traces")
    protocol = msgspec.to_builtins(made.protocol)
    protocol["elbow"] |= elbow
    protocol["models"][1]["constants"] |= own
    return dataclasses.replace(
        made, protocol=msgspec.convert(protocol, type(made.protocol))
    )


def tables_of(made: Material, section: str) -> dict[str, Table]:
    (found,) = (one for one in build_sections(made) if one.name == section)
    return {block.name: block for block in found.blocks if isinstance(block, Table)}


def test_laws_that_are_not_the_default_are_told() -> None:
    elbow = {"residual_reading": "decrease", "rest_angle_deg": 20.0}
    own = {"catch_rise_s": 0.03, "post_catch": "additive", "damping_nms_rad": 1.26}
    tables = tables_of(with_laws(elbow, own), "design")
    shared = {row[0]: row[2] for row in tables["constants"].rows}
    assert shared["θ_rest"] == 20.0
    assert shared["Q"] == "decrease after the peak over the rise"
    assert "ΔT_rise" not in shared
    # damping is that of all, and so no constant of its own
    assert [(row[0], row[1], row[3]) for row in tables["own_constants"].rows] == [
        ("HM2", "τ post-catch", "additive: to the torque of pre-catch"),
        ("HM2", "ΔT_rise", 0.03),
    ]
    assert "but for those in the table below" in tables["constants"].caption


@pytest.mark.parametrize(
    ("elbow", "own", "said"),
    [
        ({}, {}, "Q: residual over peak torque of the catch;"),
        ({"residual_reading": "decrease"}, {}, "Q: decrease after the peak of the"),
        ({}, {"residual_reading": "decrease"}, "Q: share of the peak of the catch, as"),
    ],
)
def test_q_is_explained_as_the_models_read_it(
    elbow: dict[str, object], own: dict[str, object], said: str
) -> None:
    (note,) = tables_of(with_laws(elbow, own), "design")["models"].notes
    assert said in note


def test_models_from_simulated_recordings_are_labelled() -> None:
    made = material(table_v(), "design")
    models = made.protocol.models
    fitted = msgspec.structs.replace(models[1], simulated=True)
    protocol = msgspec.structs.replace(
        made.protocol, models=(models[0], fitted, *models[2:])
    )
    for each, notes in ((protocol, [f"Fitted to SIMULATED recordings: {fitted.id}."]),
                        (made.protocol, [])):  # fmt: skip
        (section,) = build_sections(dataclasses.replace(made, protocol=each))
        (table,) = [
            block
            for block in section.blocks
            if isinstance(block, Table) and block.name == "models"
        ]
        assert list(table.notes[1:]) == notes


def test_default_laws_are_not_told() -> None:
    tables = tables_of(with_laws({}, {}), "design")
    assert "own_constants" not in tables
    symbols = [row[0] for row in tables["constants"].rows]
    assert symbols == [
        "m", "b", "k", "α", "ΔT_peak", "k_post", "ν_th", "ν_L", "θ_L", "θ_start",
        "θ_end",
    ]  # fmt: skip


def test_peaks_of_the_report_are_those_of_the_models_law() -> None:
    plain = tables_of(with_laws({}, {}), "traces")["peak_torque"]
    other = tables_of(with_laws({}, {"rest_angle_deg": 20.0}), "traces")["peak_torque"]
    # k · 10 deg more wherever the largest torque is, for HM2 alone
    for before, after in zip(plain.rows, other.rows, strict=True):
        more = radians(3.15 * 10.0) if before[0] == "HM2" else 0.0
        assert after[1:] == pytest.approx([x + more for x in before[1:]], rel=1e-12)


def test_many_models_are_drawn_four_to_a_figure() -> None:
    rows = ratings(
        *[("test", "R1", f"D{n:02}", "1") for n in range(1, 7)], mean_speed_deg_s=90.0
    )
    (section,) = build_sections(material(rows, "traces"))
    names = [block.name for block in section.blocks if isinstance(block, Drawing)]
    assert names == ["traces_1", "traces_2"]


def test_a_speed_that_is_no_stretch_is_said_and_not_drawn() -> None:
    still = ratings(*of_session("test", R1=("1",)), mean_speed_deg_s=0.0)
    assert said(still, "traces") == ["Not in these data: every speed is below 1 deg/s."]
    moved = ratings(*of_session("test", R2=("2",)), mean_speed_deg_s=80.0)
    both = dataclasses.replace(still, rows=(*still.rows, *moved.rows))
    (about,) = said(both, "traces")
    assert about.endswith("Speeds below 1 deg/s, which are not drawn: 1.")
    assert "from 30° to 146°" in about


def test_of_repeated_presentations_every_speed_counts() -> None:
    first = ratings(*of_session("test", R1=("1",)), mean_speed_deg_s=120.0)
    again = ratings(*of_session("test", R1=("1",)), mean_speed_deg_s=80.0, repeat=2)
    both = dataclasses.replace(first, rows=(*first.rows, *again.rows))
    made = material(both, "traces", "speeds")
    traces, speeds = build_sections(made)
    *_, peaks = traces.blocks
    assert isinstance(peaks, Table)
    quick = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(120))
    own = peak_torque(elbow_parameters(hess2012(), "HM1"), quick)
    ((model, *found),) = peaks.rows
    assert model == "HM1"
    assert found == pytest.approx([own] * 4, rel=1e-14)
    assert peaks.notes[-1] == "Of repeated presentations the largest peak is given."
    summary = speeds.blocks[1]
    assert isinstance(summary, Table)
    assert summary.rows[0][:4] == ("HM1", "test", 2, 100.0)


def test_stretches_are_counted_and_the_one_a_grade_rests_on_is_marked() -> None:
    of_two = {
        "n_stretches": 2,
        "speeds_deg_s": (120.0, 80.0),
        "graded_stretch": 2,
        "mean_speed_deg_s": 100.0,
        "min_speed_deg_s": 80.0,
        "max_speed_deg_s": 120.0,
        "felt": "felt",
        "grip_lost": True,
    }
    made = material(
        ratings(*of_session("test", R1=("1",)), **of_two), "traces", "speeds", "grades"
    )
    traces, speeds, grades = build_sections(made)
    summary, dots = speeds.blocks[1:3]
    assert isinstance(summary, Table)
    assert summary.rows[0][:4] == ("HM1", "test", 2, 100.0)
    assert isinstance(dots, Drawing)
    ((column,), *_) = dots.content.arguments
    assert (column.speeds, column.graded) == (((120.0, 80.0),), ((80.0,),))
    assert "Ringed: the stretch" in dots.caption
    about, drawing, peaks = traces.blocks
    assert isinstance(about, Paragraph)
    assert "one line a stretch" in about.text
    assert "A thicker line is the stretch" in about.text
    assert isinstance(drawing, Drawing)
    ((panel,), _) = drawing.content.arguments
    assert panel.graded == (False, True)
    assert isinstance(peaks, Table)
    assert peaks.notes[-1] == "Of several stretches the largest peak is given."
    (counted, *_) = grades.blocks
    assert isinstance(counted, Paragraph)
    said = "Raters stretched the arm 2 times in 1 presentation, 2.0 times each."
    assert counted.text.startswith(f"{said} In 1 of 1 presentation the arm came loose")


@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
@pytest.mark.parametrize(
    ("interval", "looks"),
    [
        ("none", ""),
        ("jackknife", ", confidence intervals (lines with ends)"),
        (
            "posterior",
            ", credible intervals (broad bars). Filled curves: posterior densities, "
            "each to its own height",
        ),
        (
            "bootstrap",
            ", confidence intervals (lines with ends). Blue, above: resamples, each "
            "row to its own height",
        ),
    ],
)
def test_the_caption_of_a_forest_has_the_marks_there_are(
    interval: str, looks: str
) -> None:
    line = plan(id="kappa", interval=interval, target="items")
    (section,) = build_sections(material_of(line))
    (forest,) = [block for block in section.blocks if isinstance(block, Drawing)]
    assert forest.caption == (
        f"Agreement between raters: estimates (dots){looks}. Dashed: what chance gives."
    )
    (share,) = build_sections(material_of(plan(coefficient="percent_agreement")))
    (forest,) = [block for block in share.blocks if isinstance(block, Drawing)]
    assert "Dashed" not in forest.caption


def material_of(line: EstimatePlan) -> Material:
    protocol, rows = protocol_with(line, sections=("agreement",)), table_v()
    return gather(protocol, rows, analyze(protocol, rows))


def test_the_forest_shows_the_posterior_behind_an_interval() -> None:
    line = plan(id="kappa", interval="posterior", target="items")
    (section,) = build_sections(material_of(line))
    (forest,) = [block for block in section.blocks if isinstance(block, Drawing)]
    first, second = (draw(forest.content, stamp="")["svg"] for _ in range(2))
    assert b"posterior density" in first
    assert first == second
