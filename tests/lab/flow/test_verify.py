"""What ``masrel verify`` finds: every forgery that leaves the chain, and with an anchor
those that compute it anew."""

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths
from masrel.lab.verification import (
    anchor_findings,
    anchors_of,
    read_anchors,
    verify_study,
    write_anchors,
)
from tests.lab.flow.conftest import run

Forgery = Callable[[StudyPaths], Path]


@pytest.fixture
def study(small_demo: Path, tmp_path: Path) -> StudyPaths:
    """A copy of the small study to forge."""
    return StudyPaths(shutil.copytree(small_demo / "study", tmp_path / "study"))


def test_a_study_that_nobody_touched_is_whole(small_demo: Path) -> None:
    verification = verify_study(StudyPaths(small_demo / "study"))
    assert verification.findings == ()
    assert {record.stage for record in verification.sessions} == {"complete"}
    assert all(
        record.n_graded == record.n_presentations == record.n_recordings > 0
        for record in verification.sessions
    )


def edited(path: Path, old: bytes, new: bytes) -> Path:
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new, 1))
    return path


def logs(study: StudyPaths) -> list[Path]:
    return sorted(study.sessions.glob("*.jsonl"))


def events(log: Path) -> list[dict[str, dict[str, object]]]:
    return [json.loads(line) for line in log.read_text().splitlines()]


def recording(study: StudyPaths) -> Path:
    return sorted(study.sessions.glob("*/*.npz"))[0]


def chained_anew(log: Path, documents: list[dict[str, dict[str, object]]]) -> Path:
    """Write events as a chain that holds, whatever they say."""
    previous, lines = "0" * 64, []
    for document in documents:
        line = json.dumps({**document, "previous": previous}).encode()
        previous = hashlib.sha256(line).hexdigest()
        lines.append(line)
    log.write_bytes(b"\n".join(lines) + b"\n")
    return log


def corrected(study: StudyPaths) -> None:
    log = logs(study)[0]
    session, rater = log.stem.split("_")
    fields = next(e["fields"] for e in events(log) if e["event"] == "grade")
    run(
        *("record", "correct", str(study.root), "--rater", rater, "--session", session),
        *("--code", str(fields["code"]), "--who", "me", "--why", "a slip"),
        *("--grade", "4" if fields["grade"] != "4" else "0"),
    )


def a_grade_in_the_table(study: StudyPaths) -> Path:
    lines = study.ratings_file.read_text().splitlines()
    cells = lines[-1].split(",")
    index = next(i for i, line in enumerate(lines) if line.startswith("session,"))
    place = lines[index].split(",").index("grade")
    cells[place] = "4" if cells[place] != "4" else "0"
    study.ratings_file.write_text("\n".join([*lines[:-1], ",".join(cells)]) + "\n")
    return study.ratings_file


def a_row_taken_from_the_table(study: StudyPaths) -> Path:
    lines = study.ratings_file.read_text().splitlines()
    study.ratings_file.write_text("\n".join(lines[:-1]) + "\n")
    return study.ratings_file


def recorded_for_simulated(study: StudyPaths) -> Path:
    return edited(study.ratings_file, b"simulated", b"recorded")


def a_line_taken_from_the_banner(study: StudyPaths) -> Path:
    return edited(study.ratings_file, b"# SIMULATED", b"# Recorded")


def the_status_of_a_rater(study: StudyPaths) -> Path:
    run("ratings", str(study.root))
    return edited(study.raters_file, b"R2,NA,complete", b"R2,NA,planned")


def a_rater_withdrawn_after_the_table(study: StudyPaths) -> Path:
    of_whom = ("--rater", "R2", "--who", "Kim", "--why", "left")
    run("ratings", str(study.root))
    run("record", "withdraw", str(study.root), *of_whom)
    return study.raters_file


def an_estimate(study: StudyPaths) -> Path:
    document = json.loads(study.analysis_file.read_text())
    document["estimates"][0]["estimate"]["value"] = 0.99
    study.analysis_file.write_text(json.dumps(document))
    return study.analysis_file


def a_log_taken_away(study: StudyPaths) -> Path:
    logs(study)[0].unlink()
    return study.sessions  # what is left behind is named


def an_emptied_log(study: StudyPaths) -> Path:
    logs(study)[0].write_bytes(b"")
    return logs(study)[0]


def a_line_changed(study: StudyPaths) -> Path:
    log = logs(study)[0]
    grade = next(e["fields"]["grade"] for e in events(log) if e["event"] == "grade")
    old = f'"grade": "{grade}"'.encode()
    return edited(log, old, b'"grade": "4"' if grade != "4" else b'"grade": "0"')


def a_line_taken_away(study: StudyPaths) -> Path:
    log = logs(study)[0]
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join([*lines[:3], *lines[4:]]))
    return log


def rewritten(study: StudyPaths, kind: str, **fields: object) -> Path:
    """Change the first event of a kind, and compute the chain anew."""
    documents = events(logs(study)[0])
    next(e for e in documents if e["event"] == kind)["fields"].update(fields)
    return chained_anew(logs(study)[0], documents)


def another_position_in_a_chain_computed_anew(study: StudyPaths) -> Path:
    return rewritten(study, "presented", position=99)


def a_grade_off_the_scale_in_a_chain_computed_anew(study: StudyPaths) -> Path:
    return rewritten(study, "grade", grade="5")


def another_schedule_in_a_chain_computed_anew(study: StudyPaths) -> Path:
    return rewritten(study, "session", schedule_sha256="0" * 64)


def lines_in_another_order_in_a_chain_computed_anew(study: StudyPaths) -> Path:
    session, presented, grade, *others = events(logs(study)[0])
    return chained_anew(logs(study)[0], [session, grade, presented, *others])


def a_recording(study: StudyPaths) -> Path:
    path = recording(study)
    data = path.read_bytes()
    middle = len(data) // 2
    path.write_bytes(data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :])
    return path


def a_recording_taken_away(study: StudyPaths) -> Path:
    path = recording(study)
    path.unlink()
    return path


def a_recording_nobody_logged(study: StudyPaths) -> Path:
    path = recording(study)
    return Path(shutil.copy(path, path.with_name("XYZ.npz")))


def the_speed_beside_a_recording(study: StudyPaths) -> Path:
    path = recording(study).with_suffix(".json")
    facts = json.loads(path.read_text())
    path.write_text(json.dumps({**facts, "mean_speed_deg_s": 1.0}))
    return path


def the_model_beside_a_recording(study: StudyPaths) -> Path:
    path = recording(study).with_suffix(".json")
    facts = json.loads(path.read_text())
    path.write_text(json.dumps({**facts, "model": facts["model"] + "x"}))
    return path


def any_fact_beside_a_recording(study: StudyPaths) -> Path:
    path = recording(study).with_suffix(".json")
    return edited(path, b'"rate_hz": 1000', b'"rate_hz": 1001')


def a_page_of_the_report(study: StudyPaths) -> Path:
    run("report", str(study.root), "--quiet")
    return edited(study.report / "report.html", b"<p>", b"<p> ")


def a_table_of_the_report_taken_away(study: StudyPaths) -> Path:
    run("report", str(study.root), "--quiet")
    path = sorted(study.report.glob("tables/*"))[0]
    path.unlink()
    return path


def a_report_of_before_a_correction(study: StudyPaths) -> Path:
    run("report", str(study.root), "--quiet")
    corrected(study)
    run("ratings", str(study.root))
    run("analyze", str(study.root))
    return study.report


def a_schedule(study: StudyPaths) -> Path:
    path = next(p for p in study.schedules.glob("*.csv") if "sheet" not in p.name)
    lines = path.read_text().splitlines()
    first, second = (lines[-2].split(","), lines[-1].split(","))
    first[2:], second[2:] = second[2:], first[2:]  # models change places
    lines[-2:] = [",".join(first), ",".join(second)]
    path.write_text("\n".join(lines) + "\n")
    return study.root


FORGERIES: list[Forgery] = [
    a_grade_in_the_table,
    a_row_taken_from_the_table,
    recorded_for_simulated,
    a_line_taken_from_the_banner,
    the_status_of_a_rater,
    a_rater_withdrawn_after_the_table,
    an_estimate,
    a_log_taken_away,
    an_emptied_log,
    a_line_changed,
    a_line_taken_away,
    another_position_in_a_chain_computed_anew,
    a_grade_off_the_scale_in_a_chain_computed_anew,
    another_schedule_in_a_chain_computed_anew,
    lines_in_another_order_in_a_chain_computed_anew,
    a_recording,
    a_recording_taken_away,
    a_recording_nobody_logged,
    the_speed_beside_a_recording,
    the_model_beside_a_recording,
    any_fact_beside_a_recording,
    a_schedule,
    a_page_of_the_report,
    a_table_of_the_report_taken_away,
    a_report_of_before_a_correction,
]


@pytest.mark.parametrize("forge", FORGERIES, ids=lambda forge: forge.__name__)
def test_a_forgery_that_leaves_the_chain_is_found(
    study: StudyPaths, forge: Forgery
) -> None:
    place = forge(study)
    verification = verify_study(study)
    assert not verification.is_whole
    broken = [f.path for f in verification.findings if f.weight == "broken"]
    assert any(path == place or path.is_relative_to(place) for path in broken)


def killed_before_the_log(study: StudyPaths) -> Path:
    """Take a log back to where its first presentation is recorded, and not logged."""
    log = logs(study)[0]
    path = log.parent / next(
        str(e["fields"]["recording"]) for e in events(log) if e["event"] == "presented"
    )
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:1]))
    for other in log.with_suffix("").iterdir():
        if other.stem != path.stem:
            other.unlink()
    path.with_suffix(".partial").write_bytes(b"")
    for file in (study.ratings_file, study.answers_file, study.raters_file):
        file.unlink(missing_ok=True)
    study.analysis_file.unlink(missing_ok=True)
    shutil.rmtree(study.report, ignore_errors=True)
    return path


def test_a_kill_between_a_recording_and_the_log_breaks_no_study(
    study: StudyPaths,
) -> None:
    path = killed_before_the_log(study)
    verification = verify_study(study)
    assert verification.is_whole
    doubted = {finding.path for finding in verification.findings}
    assert doubted == {path, path.with_suffix(".json"), path.with_suffix(".partial")}


def test_samples_left_beside_it_excuse_no_recording_of_a_complete_session(
    study: StudyPaths,
) -> None:
    path = a_recording_nobody_logged(study)
    path.with_suffix(".partial").write_bytes(b"")
    broken = [f.path for f in verify_study(study).findings if f.weight == "broken"]
    assert broken == [path]


def test_of_a_broken_chain_nothing_but_the_chain_is_said(study: StudyPaths) -> None:
    log = a_line_changed(study)
    broken = [f.path for f in verify_study(study).findings if f.weight == "broken"]
    assert log in broken
    assert not any(path.parent == log.with_suffix("") for path in broken)
    assert f"sessions/{log.name}" not in {anchor.log for anchor in anchors_of(study)}


@pytest.mark.parametrize(
    ("forge", "verb"),
    [
        (a_grade_in_the_table, "analyze"),
        (recorded_for_simulated, "analyze"),
        (a_row_taken_from_the_table, "report"),
    ],
)
def test_a_table_that_is_not_that_of_the_logs_is_refused(
    study: StudyPaths, forge: Forgery, verb: str
) -> None:
    from masrel.errors import RatingsError

    forge(study)
    with pytest.raises(RatingsError, match="is not what the session logs say"):
        run(verb, str(study.root))


def with_other_grade(log: Path) -> Path:
    documents = events(log)
    graded = next(d for d in documents if d["event"] == "grade")
    graded["fields"]["grade"] = "4" if graded["fields"]["grade"] != "4" else "0"
    return chained_anew(log, documents)


def without_last_grade(log: Path) -> Path:
    return chained_anew(log, events(log)[:-2])


@pytest.mark.parametrize("forge", [with_other_grade, without_last_grade])
def test_with_an_anchor_a_chain_computed_anew_is_found(
    study: StudyPaths, tmp_path: Path, forge: Callable[[Path], Path]
) -> None:
    file = tmp_path / "anchors.txt"
    write_anchors(anchors_of(study), file)
    assert anchor_findings(study, read_anchors(file)) == ()
    log = forge(logs(study)[0])
    run("ratings", str(study.root))
    run("analyze", str(study.root))
    assert verify_study(study).is_whole  # without the anchor it cannot be seen
    assert [f.path for f in anchor_findings(study, read_anchors(file))] == [log]


def test_a_log_that_has_grown_still_fits_its_anchor(study: StudyPaths) -> None:
    anchors = anchors_of(study)
    corrected(study)
    assert anchor_findings(study, anchors) == ()
    assert {a.log for a in anchors_of(study)} == {a.log for a in anchors}
    assert anchors_of(study) != anchors


def test_lines_that_no_anchor_covers_are_said(
    study: StudyPaths, tmp_path: Path
) -> None:
    old, new = tmp_path / "old.txt", tmp_path / "new.txt"

    def said(file: Path, code: int) -> str:
        return run("verify", str(study.root), "--anchor", str(file), code=code)

    said(old, 0)
    assert "no anchor" not in said(old, 0)
    corrected(study)  # the table of ratings is older now, which is broken
    n = len(anchors_of(study))
    assert f"note: 1 of {n} logs have lines that no anchor in {old} " in said(old, 2)
    said(new, 2)
    new.write_text(old.read_text() + new.read_text())
    assert "no anchor" not in said(new, 2)


def test_the_verb_says_every_session_and_ends_with_2_when_broken(
    study: StudyPaths, tmp_path: Path
) -> None:
    file = tmp_path / "kept" / "anchors.txt"
    whole = run("verify", str(study.root), "--anchor", str(file))
    assert f"{study.root}: whole." in whole
    assert whole.count("complete, ") == len(logs(study))
    assert file.is_file()
    with_other_grade(logs(study)[0])
    out = run("verify", str(study.root), "--anchor", str(file), code=2)
    assert "the anchored SHA-256" in out
    document = json.loads(run("verify", str(study.root), "--json", "-", code=2))
    assert document["is_whole"] is False
    assert document["findings"][0]["weight"] == "broken"


def test_a_study_without_logs_leaves_no_file_of_anchors(tmp_path: Path) -> None:
    study, file = tmp_path / "study", tmp_path / "anchors.txt"
    run("init", str(study), "--study", "small")
    for _ in range(2):  # a file without anchors would be refused by the second
        out = run("verify", str(study), "--anchor", str(file))
        assert "no log to anchor yet" in out
        assert not file.exists()


def test_an_anchor_within_the_study_is_refused(study: StudyPaths) -> None:
    from masrel.errors import ParameterError

    with pytest.raises(ParameterError, match="needed a file outside"):
        run("verify", str(study.root), "--anchor", str(study.root / "anchors.txt"))


@pytest.mark.parametrize(
    "text", ["", "abc  1  sessions/a.jsonl\n", f"{'0' * 64} sessions/a.jsonl\n"]
)
def test_a_file_that_holds_no_anchors_is_refused(tmp_path: Path, text: str) -> None:
    from masrel.errors import ParameterError

    file = tmp_path / "anchors.txt"
    file.write_text(text)
    with pytest.raises(ParameterError, match="needed"):
        read_anchors(file)
