"""What each section says of its data, in the page and the tables of a report."""

import math
import re
from math import radians
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from masrel.errors import RecordingError
from masrel.lab.analysis import analyze
from masrel.lab.elbow import ConstantSpeed, peak_torque
from masrel.lab.protocol import Protocol, SampleSize, joint_model, report_sections
from masrel.lab.ratings import Ratings, ratings_from_rows
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RECORDING_COLUMNS,
    Recording,
    write_recording,
)
from masrel.lab.report._document import ReportFiles, write_report
from masrel.lab.report._material import gather
from masrel.scales import Scale
from tests.lab.analysis.studies import (
    hess2012,
    of_session,
    plan,
    protocol_with,
    ratings,
    table_v,
)
from tests.lab.report.pages import (
    AGAIN,
    page,
    rows_of,
    simulated_ratings,
    written,
)

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")

replace = msgspec.structs.replace


def study(
    *lines: Any, sections: tuple[str, ...], **changes: dict[str, Any]
) -> Protocol:
    """The protocol of 2012 with a plan, sections, and changes of its parts."""
    protocol = protocol_with(*lines, sections=sections)
    parts = {
        name: replace(getattr(protocol, name), **of) for name, of in changes.items()
    }
    return replace(protocol, **parts)


def with_laws(elbow: dict[str, object], of_hm2: dict[str, object]) -> Protocol:
    protocol = protocol_with(sections=("design", "traces"))
    document = msgspec.to_builtins(protocol)
    document["elbow"] |= elbow
    document["models"][1]["constants"] |= of_hm2
    return msgspec.convert(document, type(protocol))


def first_model(**changes: object) -> Protocol:
    protocol = protocol_with(sections=("design",))
    first, *others = protocol.models
    return replace(protocol, models=(replace(first, **changes), *others))


ONE = ratings(*of_session("test", R1=("1",), R2=("1",)))
TWO = ratings(*of_session("test", R1=("1", "1"), R2=("1", "1")))
SIGNS = Scale(name="sign", grades=("normal", "clonus"))
TWICE = ratings_from_rows(
    [
        {"session": "test", "rater": "R1", "model": model, "grade": grade, "repeat": n}
        for model, n, grade in (
            ("HM1", 2, "1"), ("HM2", 2, "2"), ("HM1", 1, "1+"), ("HM2", 1, None)
        )
    ],
    TWO.scale,
)  # fmt: skip
CLONUS = ratings_from_rows(
    [
        {"session": "test", "rater": rater, "model": "D01", "grade": grade}
        for rater, grade in (("R1", "clonus"), ("R2", None))
    ],
    SIGNS,
)
DUMMIES = ", ".join(f"D{n:02}" for n in range(1, 13))
DESIGN, GRADES = ("design",), ("grades",)
CUES = {"stretches": ("slow", "fast")}
BREAKS = {"practice": ("HM1",), "break_after": 2, "break_minutes": 3.0}
APART = {"scheme": "restricted", "standards_apart": True, "max_same_grade": 2}
SIZE: dict[str, Any] = {
    "estimate": "line",
    "n_items": 6,
    "n_raters": 8,
    "value": 0.6,
    "model": "mixture",
    "half_width": 0.25,
    "expected_half_width": 0.2431,
    "assurance": 0.7,
    "method": "simulation",
    "n_studies": 5000,
}


def sized(size: dict[str, Any], **line: Any) -> Protocol:
    protocol = study(
        plan(**{"interval": "jackknife", **line}), sections=("sample-size",)
    )
    sizes = (msgspec.convert({**SIZE, **size}, SampleSize),)
    return replace(protocol, analysis=replace(protocol.analysis, sample_sizes=sizes))


EXPECTED = {"half_width": None, "expected_half_width": 0.31}
SAYS: dict[str, tuple[Protocol, Ratings, list[str]]] = {
    "counts, in the singular and plural": (
        study(sections=DESIGN), table_v(),
        ["The protocol plans 16 haptic models (4 standard, 12 dummies), 8 raters and 2",
         "Raters may stretch the arm as often as they want before each grade. Scale ",
         "No ratings in these data: session retest.",
         f"Models without ratings in these data: {DUMMIES}."],
    ),
    "numbers as they were given": (
        first_model(residual_ratio=0.1255), table_v(),
        ["| HM1 | standard | 1 | 130 | 1.40 | 0.1255 | 60 |"],
    ),
    "models of simulated recordings": (
        first_model(simulated=True), table_v(),
        ["Fitted to SIMULATED recordings: HM1."],
    ),
    "orders of a Williams design": (
        study(sections=DESIGN, schedule={"scheme": "williams"}), table_v(),
        ["is presented with the models in an order of a Williams design"],
    ),
    "orders with rules": (
        study(sections=DESIGN, schedule=APART), table_v(),
        ["with the models in an order drawn from all in which no two standards come "
         "in a row and at most 2 of one grade come in a row and sees only their codes"],
    ),
    "stretches, practice and breaks": (
        study(sections=DESIGN, presentation=CUES, occasions=BREAKS), table_v(),
        ["as follows before each grade: slow (V1, at most ",
         ", then fast (V3, at least ",
         "begins with practice on HM1, which is not rated. A break of 3 min is planned "
         "after every 2 presentations."],
    ),
    "default laws": (
        with_laws({}, {}), table_v(),
        ["Q: residual torque of the catch divided by its peak;",
         "Constants shared by all models\n", "| θ_end |"],
    ),
    "other laws": (
        with_laws(
            {"residual_reading": "decrease", "rest_angle_deg": 20.0},
            {"catch_rise_s": 0.03, "post_catch": "additive", "damping_nms_rad": 1.26},
        ), table_v(),
        ["Q: decrease after the peak of the catch", "| θ_rest |",
         "| definition of Q | decrease after the peak divided by the rise |",
         "except those in the table below",
         "after the catch | additive: added to the torque before the catch |",
         "| HM2 | ΔT_rise |"],
    ),
    "a law of one model": (
        with_laws({}, {"residual_reading": "decrease"}), table_v(),
        ["Q: share of the peak of the catch, as each model defines it"],
    ),
    "a size, and what came": (
        sized({}), table_v(),
        ["With 6 items and 8 raters, the 95 % interval of Fleiss' κ",
         "assurance 0.700 of a half-width up to 0.25, if the coefficient is",
         "The data have 4 items and 8 raters; the interval's half-width is 0.306",
         "more than the required 0.250.",
         "models | planned | 6 | 8 | 0.600 | 0.243 | – | – | 0.700 | – |",
         "models | obtained | 4 | 8 | 0.626 | 0.306 | 0.320 | 0.933 | – | – |"],
    ),
    "a size that was expected": (
        sized(EXPECTED), table_v(), ["not more than the expected 0.310."],
    ),
    "a size without an interval": (
        sized({}, interval="none"), table_v(),
        ["The data have 4 items and 8 raters, and there is no interval."],
    ),
    "a size of nothing": (
        sized({}, models="dummy"), table_v(),
        ["There is no estimate: no dummy model has ratings"],
    ),
    "no size": (
        study(sections=("sample-size",)), table_v(),
        ["the protocol does not say how its size was chosen"],
    ),
    "an unknown aim": (
        study(sections=GRADES),
        ratings(("test", "R1", "HM1", "1"), ("test", "R1", "D01", "2")),
        ["| HM1 | 1 | 1 |", "| D01 | – | 2 |", "D01: 1 of grade 2"],
    ),
    "presentations in their order": (
        study(sections=GRADES), TWICE, ["| HM1 | 1 | 1+, 1 |", "| HM2 | 1+ | 2 |"],
    ),
    "grades that are missing": (
        study(sections=GRADES),
        ratings(*of_session("test", R1=("1", None, "2"), R2=(None, "2", "2"))),
        ["2 ratings missing, shown as –.", "Blank: no rating."],
    ),
    "names without an order": (
        study(plan(), sections=GRADES), CLONUS,
        ["Grades of session test. Blank: no rating."],
    ),
    "an order that effects ask for": (
        study(plan(), sections=("grades", "order")), CLONUS,
        ["Grades of session test. Darker: a higher grade. Blank: no rating."],
    ),
    "an order that weights ask for": (
        study(plan(weights="linear"), sections=GRADES), CLONUS,
        ["Grades of session test. Darker: a higher grade. Blank: no rating."],
    ),
    "the mean of models": (
        study(sections=("intended",)), table_v(),
        # 84.375 and 11.968, see tests/lab/analysis/test_table_v.py
        ["Mean over the 4 standard models: 84.4 % (standard deviation between models "
         "12.0, n − 1)."],
    ),
    "a grade that nobody gave": (
        study(plan(), sections=("categories",)), table_v(),
        ["| 0 | 0 | – | – | – |", "| 1 | 9 | 0.698 | 2 models are too few | 0.580 |"],
    ),
    "the word that agree has for it, whose interval ends in 'fair'": (
        study(plan(interval="posterior", target="items"), sections=("agreement",)),
        table_v(),
        ["| [0.370, 0.874] | 4 | 8 | moderate |", "by its interval (one-sided)"],
    ),
    "no estimate, so no grade": (
        study(sections=("categories",)), table_v(),
        ["Not in these data: agreement on each grade (the plan asks for no estimate"],
    ),
    "no estimate in the data": (
        study(plan(models="dummy"), sections=("categories", "agreement")), table_v(),
        ["Not in these data: no dummy model has ratings in session test.",
         "| Fleiss' κ, dummy models | – | not in these data | – | – |",
         "in these data: agreement on each grade (no dummy model has ratings in"],
    ),
    "no aims": (
        study(sections=("confusion",)),
        ratings(("test", "R1", "D01", "1"), ("test", "R2", "D01", "1")),
        ["data: grades by intended grade (no model with an intended grade has "
         "ratings)."],
    ),
    "no order": (
        study(plan(), sections=("order",)), table_v(),
        ["Not in these data: effects of order (the positions of"],
    ),
    "nobody in person": (
        study(sections=("in-person",)), ONE,
        ["in-person and haptic grades (no grades given in person belong to these"],
    ),
    "no speed": (
        study(sections=("speeds", "traces")), ONE,
        ["stretching speeds (no rating comes with a stretching speed); torque traces"],
    ),
    "speeds that are not known": (
        study(sections=("speeds",)),
        ratings_from_rows(
            [{"session": "test", "rater": rater, "model": "HM1", "grade": "1"}
             | {"mean_speed_deg_s": speed}
             for rater, speed in (("R1", 80.0), ("R2", math.nan))],
            TWO.scale,
        ),
        ["Ratings with an unknown speed: 1."],
    ),
    "reconstructions": (
        study(sections=("traces",)), table_v(),
        ["reconstructions, not measurements", "published mean speeds"],
    ),
    "claims, by another command": (
        study(sections=("claims",)), table_v(),
        ["of agreement between raters.\n\n## Provenance"],
    ),
    "recorded ratings": (
        study(sections=()), ratings(("test", "R1", "HM1", "1"), source="recorded"),
        ["Study hess2012, recorded ratings."],
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", SAYS)
def test_a_page_says(what: str, tmp_path: Path) -> None:
    protocol, rows, texts = SAYS[what]
    text = page(written(tmp_path, protocol, rows))
    for said in texts:
        assert said in text


def test_what_was_not_computed_is_said_to_be_so(tmp_path: Path) -> None:
    rows = table_v()
    analysis = analyze(protocol_with(), rows)
    asked = protocol_with(sections=("intended",))
    files = write_report(asked, rows, analysis, tmp_path)
    text = "agreement with the intended grade (this was not computed)."
    assert f"Not in these data: {text}" in page(files)


def test_only_a_study_that_says_its_size_has_the_section() -> None:
    for protocol, has in ((study(sections=()), False), (sized({}), True)):
        report = replace(protocol.report, sections=None)
        names = report_sections(replace(protocol, report=report))
        assert ("sample-size" in names) == has


def test_constants_of_all_are_told_once(tmp_path: Path) -> None:
    own = {"catch_rise_s": 0.03, "damping_nms_rad": 1.26}  # this is that of all
    files = written(tmp_path / "own", with_laws({}, own), table_v())
    assert [row["symbol"] for row in rows_of(files, "own_constants")] == ["ΔT_rise"]
    shared = [row["symbol"] for row in rows_of(files, "constants")]
    assert shared == ("m b k α ΔT_peak k_post ν_th ν_L θ_L θ_start θ_end".split())
    plain = written(tmp_path / "plain", with_laws({}, {}), table_v())
    assert "own_constants" not in [path.stem for path in plain.tables]


def test_peaks_are_those_of_each_models_law(tmp_path: Path) -> None:
    # R1 stretched HM1 at 122 deg/s from 30 deg to the end of the range, 146 deg.
    motion = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(122))
    peak = peak_torque(joint_model(hess2012(), "HM1"), motion)
    laws = ({}, {"rest_angle_deg": 20.0})
    plain, other = (
        rows_of(written(tmp_path / str(n), with_laws({}, of), table_v()), "peak_torque")
        for n, of in enumerate(laws)
    )
    assert float(plain[0]["R1_nm"]) == pytest.approx(peak, rel=1e-14)
    own = [float(plain[0][f"R{n}_nm"]) for n in range(1, 9)]
    ends = float(plain[0]["least_nm"]), float(plain[0]["most_nm"])
    assert ends == (min(own), max(own))
    # k · 10 deg more wherever the largest torque is, for HM2 alone
    for before, after in zip(plain, other, strict=True):
        more = radians(3.15 * 10.0) if before["model"] == "HM2" else 0.0
        expected = [float(before[key]) + more for key in before if key.endswith("_nm")]
        found = [float(after[key]) for key in after if key.endswith("_nm")]
        assert found == pytest.approx(expected, rel=1e-12)


def test_in_person_pairs_and_remarks_are_told(published: ReportFiles) -> None:
    text = page(published)
    assert "11 of 11 pairs are equal (100.0 %)" in text
    assert "absent by Table IV and its footnote" in text
    rows = rows_of(published, "in_person")
    assert [row["equal"] for row in rows] == ["yes"] * 11


def test_grades_of_many_raters_are_counted(tmp_path: Path) -> None:
    given = {f"R{n}": ("1", "2" if n < 10 else "1+") for n in range(31)}
    protocol, rows = (
        protocol_with(sections=GRADES),
        ratings(*of_session("test", **given)),
    )
    raters = [replace(protocol.raters[0], id=name) for name in given]
    files = written(tmp_path, replace(protocol, raters=tuple(raters)), rows)
    text = page(files)
    assert "| HM1 | 1 | 0 | 31 | 0 | 0 | 0 | 0 |" in text
    assert "| HM2 | 1+ | 0 | 0 | 21 | 10 | 0 | 0 |" in text
    assert "the intended grade is framed" in text
    (svg,) = (path for path in files.figures if path.suffix == ".svg")
    texts = re.findall(r"<!-- (.*?) -->", svg.read_text(encoding="utf-8"))
    assert [texts.count(n) for n in ("31", "21", "10")] == [4, 2, 2]  # with totals


def shares(folder: Path, cells: list[tuple[str, ...]]) -> tuple[float, float, float]:
    """The part of HM1 as intended; grades by rater, of every presentation."""
    rows = [
        {"session": "test", "rater": f"R{rater}", "model": "HM1", "repeat": repeat}
        | {"grade": grade}
        for rater, grades in enumerate(cells, start=1)
        for repeat, grade in enumerate(grades, start=1)
    ]
    protocol = protocol_with(sections=("confusion",))
    files = written(folder, protocol, ratings_from_rows(rows, TWO.scale))
    (row,) = rows_of(files, "confusion")
    return float(row["percent"]), float(row["low"]), float(row["high"])


def test_grades_of_one_rater_alike_count_for_less(tmp_path: Path) -> None:
    # 8 raters: a grade each, or the same one twice; then halves of each rater's
    grades = ["1", "1", "1", "1", "1", "1", "2", "2"]
    once = shares(tmp_path / "once", [(grade,) for grade in grades])
    alike = shares(tmp_path / "alike", [(grade, grade) for grade in grades])
    # 6 of 8: 34.9 to 96.8 % (Clopper & Pearson 1934)
    assert once == pytest.approx((75.0, 34.9, 96.8), abs=0.05)
    assert alike[0] == 75.0
    # twice as many grades that say nothing new: hardly narrower
    assert 0.9 < (alike[2] - alike[1]) / (once[2] - once[1]) < 1.1
    assert shares(tmp_path / "mixed", [("1", "2")] * 8)[0] == 50.0


def test_methods_say_who_is_excluded_and_what_is_missing(tmp_path: Path) -> None:
    rows = ratings(*of_session("test", R1=("1", None), R2=("1", "2"), R3=("1", "1+")))
    protocol = study(plan(), sections=("methods", "categories"))
    text = page(written(tmp_path, protocol, rows, excluded=["R3"]))
    assert "2 of 8 raters graded 2 standard models" in text
    assert "The grades of R3, who is excluded, are not counted.\n" in text
    assert "R3 is excluded from every number." in text
    assert "are missing (1 of Fleiss' κ, standard models)" in text
    assert "specific agreement (Cicchetti & Feinstein, 1990)" in text


AT_SPEEDS = "Model reconstruction at {} mean speeds, not a measurement"
MADE_UP = "Simulated grades show that a study runs; they"
SOURCES: dict[str, tuple[str, str, str]] = {  # what is said, and stamps
    "simulated": (MADE_UP, "SIMULATED DATA", "SIMULATED DATA"),
    "recorded+simulated": ("1 of 2 grades are a", "SIMULATED DATA", "SIMULATED DATA"),
    "published": ("Published grades and speeds", "Published data", "published"),
    "recorded": ("Study hess2012, recorded ratings.", "", "recorded"),
}


@pytest.mark.parametrize("sources", SOURCES)
def test_the_source_is_said_of_pages_and_figures(sources: str) -> None:
    rows = [
        {"session": "test", "rater": f"R{n}", "model": "HM1", "grade": "1"}
        | {"source": source, "mean_speed_deg_s": 80.0}
        for n, source in enumerate(sources.split("+"), start=1)
    ]
    protocol = study(sections=("grades", "traces"), study={"source": ""})
    given = ratings_from_rows(rows, TWO.scale)
    made = gather(protocol, given, analyze(protocol, given))
    said, stamp, of_traces = SOURCES[sources]
    assert said in f"{made.banner} {made.provenance}"
    assert (made.data, made.stamp) == (sources, stamp)
    assert made.trace_stamp in (of_traces, AT_SPEEDS.format(of_traces))


def recorded(file: Path, model: str, *, fault: str | None = None) -> None:
    """A recording of 3 s: at 10 deg/s, back, then at 60 deg/s; torque is the time."""
    columns = {name: np.zeros(3000) for name in RECORDING_COLUMNS}
    columns["time_s"] = columns[MEASURED_TORQUE.column] = np.arange(3000) * 1e-3
    for number, start, speed in ((1, 500, 10.0), (2, 1500, 60.0)):
        columns["stretch"][start : start + 400] = number
        columns["velocity_deg_s"][start : start + 400] = speed
    session, rater = file.parent.name.split("_")
    facts = {"model": model, "rater": rater, "session": session, "simulated": True}
    recording = Recording(
        columns=columns, facts={**facts, "fault": fault}, channels=(MEASURED_TORQUE,)
    )
    write_recording(recording, file)


SENSOR = study(sections=("traces",), device={"torque_sensor": True})


def test_measured_torque_is_of_the_first_recording_of_each_model(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "sessions"
    recorded(folder / "test_R1" / "A1.npz", "HM2", fault="speed")
    recorded(folder / "retest_R2" / "A2.npz", "HM2")
    for place in ("retest_R1", "test_R2", "test_R1"):
        recorded(folder / place / "A3.npz", "HM1")
    rows = simulated_ratings()
    files = written(tmp_path / "report", SENSOR, rows, recordings=folder)
    text = page(files)
    assert "Torque of HM1, HM2 measured by the device's sensor (line)" in text
    # of the second stretch, the first that could catch, and .25 s after it
    assert "the largest measured torque is 2.1 N·m" in text
    (svg,) = (p for p in files.figures if re.match(r"measured_1.*\.svg", p.name))
    drawn = svg.read_text(encoding="utf-8")
    assert "R1, test" in drawn
    assert "R2, retest" in drawn


def test_recordings_are_looked_at_with_a_sensor_alone(tmp_path: Path) -> None:
    rows, folder = simulated_ratings(), tmp_path / "sessions"
    nothing = written(tmp_path / "report", SENSOR, rows, recordings=folder)
    said = "Measured torque is not in these data: no recording has it."
    assert said in page(nothing)
    (folder / "test_R1").mkdir(parents=True)
    (folder / "test_R1" / "A1.npz").write_bytes(b"no recording")
    bare = study(sections=("traces",))
    text = page(written(tmp_path / "report", bare, rows, recordings=folder))
    assert "Measured torque" not in text
    with pytest.raises(RecordingError, match=r"A1\.json: no such file"):
        written(tmp_path / "report", SENSOR, rows, recordings=folder)


def test_agreement_of_one_rater_counts_one(tmp_path: Path) -> None:
    line = replace(AGAIN, coefficient="cohen_kappa")
    files = written(
        tmp_path, study(line, sections=("test-retest",)), simulated_ratings()
    )
    rows = rows_of(files, "test_retest")
    assert [(row["id"], row["n_raters"]) for row in rows[:1]] == [("again: R1", "1")]
    assert rows[0]["sessions"] == "test and retest"
    (svg,) = (path for path in files.figures if path.suffix == ".svg")
    assert "R1, Cohen" in svg.read_text(encoding="utf-8")
