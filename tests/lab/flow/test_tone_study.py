"""A study that mixes kinds of models, from its template to the report."""

from pathlib import Path

import pytest

from masrel.errors import ProtocolError, RatingsError
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.recording import PHASES, read_recording
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from tests.files import edit, table_of
from tests.lab.flow.conftest import run

RATERS = ("R1", "R2", "R3")


@pytest.fixture(scope="module")
def rated(tmp_path_factory: pytest.TempPathFactory) -> StudyPaths:
    """The tone study, rated by its simulated raters through the command line."""
    study = StudyPaths(tmp_path_factory.mktemp("tone") / "study")
    run("init", str(study.root), "--study", "tone")
    edit(study.protocol, 'stretches = "free"', "stretches = 1")
    run("schedule", str(study.root))
    for rater in RATERS:
        options = ("--session", "test", "--grades", "simulated", "--quiet")
        run("run", str(study.root), "--rater", rater, *options)
    run("ratings", str(study.root))
    return study


def test_every_model_of_every_kind_was_presented_without_a_fault(
    rated: StudyPaths,
) -> None:
    assert "no problems. 10 models, 3 raters" in run("check", str(rated.root))
    recordings = {}
    for rater in RATERS:
        for shown in read_schedule(rated.schedule_file(rater, "test")).presentations:
            file = rated.log_file(rater, "test").with_suffix("") / f"{shown.code}.npz"
            recordings[shown.model] = recording = read_recording(file)
            facts = recording.facts
            ended = facts["fault"], facts["ended"], facts["simulated"]
            assert ended == (None, "arrived", True)
    assert len(recordings) == 10
    # a model without a trigger, and a latch that closes, and gives way
    phases = [recordings[model].facts["phases"] for model in ("L3", "K3")]
    assert phases == [PHASES[0], ", ".join(PHASES)]
    # a contracture ends where its own range does
    assert 125.0 < float(recordings["F3"].columns["angle_deg"].max()) < 126.5
    assert len(table_of(rated.ratings_file)) == 30


@pytest.mark.slow
def test_its_report_has_traces_and_numbers_of_every_kind(rated: StudyPaths) -> None:
    run("report", str(rated.root), "--quiet")
    report = rated.root / "report"
    shown = {}
    for name in ("other_kinds", "peak_torque"):
        file = report / "tables" / f"{name}.csv"
        assert "simulated" in file.read_text(encoding="utf-8").lower()
        shown[name] = table_of(file)
    kinds = {m.id: m.kind for m in read_protocol(rated.protocol).models}
    others = {row["model"]: row["kind"] for row in shown["other_kinds"]}
    assert others == {m: kind for m, kind in kinds.items() if kind != "spastic-elbow"}
    assert [row["model"] for row in shown["peak_torque"]] == list(kinds)
    page = (report / "report.md").read_text(encoding="utf-8")
    assert "Constants shared by all spastic elbows" in page
    assert len(list((report / "figures").glob("traces_*.png"))) == 3


def test_what_grades_follow_is_asked_of_the_spastic_elbows_alone(
    rated: StudyPaths,
) -> None:
    # S2 is the only one, and what one model was graded follows nothing.
    with pytest.raises(RatingsError, match="got 1 and 3 in 3 ratings with every"):
        run("grading", str(rated.root))


def test_run_refuses_what_check_refuses_and_simulated_raters_what_has_no_rank(
    tmp_path: Path,
) -> None:
    study = StudyPaths(tmp_path / "study")
    run("init", str(study.root), "--study", "tone")
    text = study.protocol.read_text(encoding="utf-8")
    strong = text.replace("beat_rate_hz = 5.0", "beat_torque_nm = 9.0")
    study.protocol.write_text(strong, encoding="utf-8")
    run("schedule", str(study.root))
    protocol = read_protocol(study.protocol)
    grades = SimulatedGrades(protocol)
    with pytest.raises(ProtocolError, match=r"active_torque_limit_nm \(10 N·m\)"):
        run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")
    assert not study.sessions.exists()
    text = text.replace('intended_grade = "clonus"', 'role = "dummy"')
    study.protocol.write_text(text, encoding="utf-8")
    needed = "need an intended_grade for a model of kind clonus, got none for B3"
    with pytest.raises(ProtocolError, match=needed):
        SimulatedGrades(read_protocol(study.protocol))
