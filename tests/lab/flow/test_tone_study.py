"""A study that mixes kinds of models, from its template to the report."""

import csv
import json
from pathlib import Path

import pytest

from masrel.errors import ProtocolError, RatingsError
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.recording import PHASES, read_recording
from masrel.lab.run import SimulatedGrades, run_session
from masrel.lab.schedule import read_schedule
from tests.lab.flow.conftest import run

RATERS = ("R1", "R2", "R3")


@pytest.fixture(scope="module")
def rated(tmp_path_factory: pytest.TempPathFactory) -> StudyPaths:
    """The tone study, rated by its simulated raters through the command line."""
    study = StudyPaths(tmp_path_factory.mktemp("tone") / "study")
    run("init", str(study.root), "--study", "tone")
    run("schedule", str(study.root))
    for rater in RATERS:
        options = ("--session", "test", "--grades", "simulated", "--quiet")
        run("run", str(study.root), "--rater", rater, *options)
    run("ratings", str(study.root))
    return study


def test_it_is_checked_once_it_is_rated(rated: StudyPaths) -> None:
    assert "no problems. 10 models, 3 raters" in run("check", str(rated.root))


def test_every_model_of_every_kind_was_presented_without_a_fault(
    rated: StudyPaths,
) -> None:
    phases = {}
    for rater in RATERS:
        for shown in read_schedule(rated.schedule_file(rater, "test")).presentations:
            file = rated.recording_file(rater, "test", shown.code)
            facts = read_recording(file).facts
            assert facts["fault"] is None
            assert facts["ended"] == "done"
            assert facts["simulated"] is True
            phases[shown.model] = facts["phases"]
    assert len(phases) == 10
    assert phases["L3"] == PHASES[0]  # a model without a trigger
    assert phases["K3"] == ", ".join(PHASES)  # the latch closes, and gives way
    with rated.ratings_file.open(encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert len(rows) == 30
    known = read_protocol(rated.protocol).scale.grades
    assert {row["grade"] for row in rows} <= set(known)


def test_a_contracture_ends_where_its_own_range_does(rated: StudyPaths) -> None:
    schedule = read_schedule(rated.schedule_file("R1", "test"))
    (code,) = [p.code for p in schedule.presentations if p.model == "F3"]
    columns = read_recording(rated.recording_file("R1", "test", code)).columns
    assert 125.0 < float(columns["angle_deg"].max()) < 126.5


@pytest.mark.slow
def test_its_report_has_traces_and_numbers_of_every_kind(rated: StudyPaths) -> None:
    run("analyze", str(rated.root))
    analysis = json.loads(rated.analysis_file.read_text(encoding="utf-8"))
    assert analysis["simulated"] is True
    run("report", str(rated.root), "--quiet")
    report = rated.root / "report"
    for name in ("other_kinds", "peak_torque"):
        (table,) = report.glob(f"tables/{name}-*.csv")
        text = table.read_text(encoding="utf-8")
        assert "simulated" in text.lower()
    models = {m.id: m.kind for m in read_protocol(rated.protocol).models}
    (table,) = report.glob("tables/other_kinds-*.csv")
    with table.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    shown = {row["model"]: row["kind"] for row in rows}
    assert shown == {m: kind for m, kind in models.items() if kind != "spastic-elbow"}
    (table,) = report.glob("tables/peak_torque-*.csv")
    with table.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert [row["model"] for row in rows] == list(models)
    page = (report / "report.md").read_text(encoding="utf-8")
    assert "Constants all spastic elbows share" in page
    assert len(list((report / "figures").glob("traces_*.png"))) == 3


def test_what_grades_follow_is_asked_of_the_spastic_elbows_alone(
    rated: StudyPaths,
) -> None:
    # S2 is the only one, and what one model was graded follows nothing.
    with pytest.raises(RatingsError, match="got 1 and 3 in 3 ratings with every"):
        run("grading", str(rated.root))


def test_run_refuses_what_check_refuses(tmp_path: Path) -> None:
    study = StudyPaths(tmp_path / "study")
    run("init", str(study.root), "--study", "tone")
    text = study.protocol.read_text(encoding="utf-8")
    strong = text.replace("beat_rate_hz = 5.0", "beat_torque_nm = 9.0")
    study.protocol.write_text(strong, encoding="utf-8")
    run("schedule", str(study.root))
    protocol = read_protocol(study.protocol)
    with pytest.raises(ProtocolError, match=r"active_torque_limit_nm \(10 N·m\)"):
        run_session(
            study,
            protocol,
            "R1",
            "test",
            grades=SimulatedGrades(protocol),
            clock="simulated",
        )
    assert not study.sessions.exists()


def test_a_dummy_of_another_kind_has_no_rank_for_simulated_raters(
    tmp_path: Path,
) -> None:
    study = StudyPaths(tmp_path / "study")
    run("init", str(study.root), "--study", "tone")
    text = study.protocol.read_text(encoding="utf-8")
    text = text.replace('intended_grade = "clonus"', 'role = "dummy"')
    study.protocol.write_text(text, encoding="utf-8")
    with pytest.raises(
        ProtocolError,
        match="simulated raters need an intended_grade for a model of kind clonus, got "
        "none for B3",
    ):
        SimulatedGrades(read_protocol(study.protocol))
