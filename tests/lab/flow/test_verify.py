"""What ``masrel verify`` finds: every forgery that leaves the chain, and with an anchor
those that compute it anew."""

import hashlib
import json
import shlex
import shutil
from collections.abc import Callable
from cProfile import Profile
from functools import partial
from pathlib import Path

import pytest

from masrel.errors import ParameterError, RatingsError
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.run._corrections import record_correction
from masrel.lab.verification import (
    anchor_findings,
    anchors_of,
    read_anchors,
    verify_study,
    write_anchors,
)
from tests.files import edit
from tests.lab.flow.conftest import run

Events = list[dict[str, dict[str, object]]]
Forgery = Callable[[Path], Path]
"""Changes a file, and returns what has to be named for it."""

TABLE, RATERS = "ratings/ratings.csv", "ratings/raters.csv"
SESSION, TRAINING = "sessions/test_R1.jsonl", "training/R1.jsonl"
REHEARSAL = "rehearsals/1/rehearsal_test_R1.jsonl"
LOGS = (SESSION, TRAINING, REHEARSAL)


def events(log: Path) -> Events:
    return [json.loads(line) for line in log.read_text().splitlines()]


def first(documents: Events, kind: str) -> dict[str, object]:
    return next(each["fields"] for each in documents if each["event"] == kind)


def chained_anew(log: Path, documents: Events) -> Path:
    """Write events as a chain that holds, whatever they say."""
    previous, lines = "0" * 64, []
    for document in documents:
        line = json.dumps({**document, "previous": previous}).encode()
        previous = hashlib.sha256(line).hexdigest()
        lines.append(line)
    log.write_bytes(b"\n".join(lines) + b"\n")
    return log


def broken(study: StudyPaths) -> list[Path]:
    return [f.path for f in verify_study(study).findings if f.weight == "broken"]


def replaced(old: bytes, new: bytes) -> Forgery:
    def forge(path: Path) -> Path:
        data = path.read_bytes()
        assert old in data
        path.write_bytes(data.replace(old, new, 1))
        return path

    return forge


def rewritten(kind: str, **fields: object) -> Forgery:
    """Changes the first event of a kind, and computes the chain anew."""

    def forge(log: Path) -> Path:
        documents = events(log)
        first(documents, kind).update(fields)
        return chained_anew(log, documents)

    return forge


def without_line(place: int) -> Forgery:
    def forge(path: Path) -> Path:
        lines = path.read_bytes().splitlines(keepends=True)
        del lines[place]
        path.write_bytes(b"".join(lines))
        return path

    return forge


def copied_as(name: str) -> Forgery:
    return lambda path: Path(shutil.copy(path, path.with_name(name)))


def moved_to(name: str) -> Forgery:
    return lambda path: path.rename(path.parent / name)


def gone(path: Path) -> Path:
    path.unlink()
    return path


def emptied(path: Path) -> Path:
    path.write_bytes(b"")
    return path


def with_a_bit_changed(path: Path) -> Path:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    return path


def in_another_order(log: Path) -> Path:
    session, presented, grade, *others = events(log)
    return chained_anew(log, [session, grade, presented, *others])


def called(*commands: str) -> Callable[[StudyPaths], object]:
    return lambda of: [run(*shlex.split(each.format(of.root))) for each in commands]


def corrected(study: StudyPaths, grade: str | None = "4") -> None:
    given = first(events(study.root / SESSION), "grade")
    if given["grade"] == grade:
        grade = "0"
    of = {"code": str(given["code"]), "who": "me", "why": "a slip"}
    record_correction(
        study, read_protocol(study.protocol), "R1", "test", grade=grade, **of
    )


RECORDING, FACTS = "test_R1/*.npz", "test_R1/*.json"
FORGERIES: list[tuple[str, Forgery]] = [
    (TABLE, replaced(b",2,", b",3,")),
    (TABLE, without_line(-1)),
    (TABLE, replaced(b"simulated", b"recorded")),
    (TABLE, replaced(b"# SIMULATED", b"# Recorded")),
    (RATERS, replaced(b"R2,NA,complete", b"R2,NA,planned")),
    ("analysis.json", replaced(b'"value": 0.', b'"value": 0.9')),
    ("report/report.html", replaced(b"<p>", b"<p> ")),
    ("report/tables/*", gone),
    (SESSION, lambda log: gone(log).parent),  # what is left behind is named
    (SESSION, emptied),
    (SESSION, without_line(3)),
    (SESSION, replaced(b'"event": "grade"', b'"event": "Grade"')),
    (SESSION, rewritten("presented", position=99)),
    (SESSION, rewritten("grade", grade="5")),
    (SESSION, rewritten("session", schedule_sha256="0" * 64)),
    (SESSION, in_another_order),
    (f"sessions/{RECORDING}", with_a_bit_changed),
    (f"sessions/{RECORDING}", gone),
    (f"sessions/{RECORDING}", copied_as("XYZ.npz")),
    (f"sessions/{FACTS}", replaced(b'"mean_speed_deg_s": ', b'"mean_speed_deg_s": 1')),
    (f"sessions/{FACTS}", replaced(b'"model": "', b'"model": "x')),
    (f"sessions/{FACTS}", replaced(b'"rate_hz": 1000', b'"rate_hz": 1001')),
]
OF_TRAININGS: list[tuple[str, Forgery]] = [
    (TRAINING, replaced(b'"event": "grade"', b'"event": "Grade"')),
    (TRAINING, rewritten("grade", grade="7")),
    (TRAINING, rewritten("grade", intended="4")),
    (TRAINING, rewritten("presented", model="HM9")),
    (TRAINING, rewritten("presented", attempt=2)),
    (TRAINING, rewritten("presented", position=[])),
    (TRAINING, rewritten("complete", n_presentations=1)),
    (TRAINING, rewritten("training", format=99)),
    (TRAINING, moved_to("R2.jsonl")),
    (TRAINING, copied_as("R9.jsonl")),
    ("training/R1/*.npz", with_a_bit_changed),
    ("training/R1/*.npz", gone),
    ("training/R1/*.npz", copied_as("999.npz")),
]
OF_REHEARSALS: list[tuple[str, Forgery]] = [
    (REHEARSAL, replaced(b'"event": "grade"', b'"event": "Grade"')),
    (REHEARSAL, rewritten("grade", grade="7")),
    (REHEARSAL, rewritten("presented", position=3)),
    (REHEARSAL, rewritten("session", rehearsal=False)),
    (REHEARSAL, moved_to("rehearsal_test_R2.jsonl")),
    ("rehearsals/1", moved_to("two")),
    (f"rehearsals/1/rehearsal_{RECORDING}", with_a_bit_changed),
    (f"rehearsals/1/rehearsal_{FACTS}", replaced(b"HM", b"HX")),
    (f"rehearsals/1/rehearsal_{RECORDING}", gone),
    (f"rehearsals/1/rehearsal_{RECORDING}", copied_as("00A.npz")),
]


def test_a_study_that_nobody_touched_is_whole(study: StudyPaths) -> None:
    verification = verify_study(study)
    assert verification.findings == ()
    assert {record.stage for record in verification.sessions} == {"complete"}
    for record in (*verification.sessions, *verification.rehearsals):
        assert record.n_graded == record.n_presentations == record.n_recordings == 4
    (training,) = verification.trainings
    kinds = [event["event"] for event in events(study.root / TRAINING)]
    counts = (kinds.count("grade"), kinds.count("presented"))
    assert (training.n_graded, training.n_recordings) == counts
    shown = run("verify", str(study.root))
    assert "rehearsal 1 of test R1: complete" in shown
    assert f"training R1: {training.stage}, " in shown
    document = json.loads(run("verify", str(study.root), "--json", "-"))
    for of in ("rehearsals", "trainings"):
        assert [record["rater"] for record in document[of]] == ["R1"]


def test_a_session_that_is_called_training_is_no_training(tmp_path: Path) -> None:
    root = str(tmp_path / "study")
    run("init", root)
    protocol = tmp_path / "study" / "protocol.toml"
    protocol.write_text(protocol.read_text().replace('"test"', '"training"'))
    run("schedule", root)
    place = ("--rater", "R1", "--session", "training")
    run("run", root, *place, "--grades", "simulated", "--quiet")
    assert "training R1: complete, 4 of 4 graded" in run("verify", root)


def named(forgeries: list[tuple[str, Forgery]]) -> pytest.MarkDecorator:
    ids = [
        f"{file} {forge.__qualname__.partition('.')[0]}" for file, forge in forgeries
    ]
    return pytest.mark.parametrize(("file", "forge"), forgeries, ids=ids)


@named([*FORGERIES, *OF_TRAININGS, *OF_REHEARSALS])
def test_a_forgery_that_leaves_the_chain_is_found(
    study: StudyPaths, file: str, forge: Forgery
) -> None:
    place = forge(sorted(study.root.glob(file))[0])
    assert any(path.is_relative_to(place) for path in broken(study))


ANALYSIS, REPORT = "analysis.json", "report/manifest.json"


@pytest.mark.parametrize(
    ("later", "made_before"),
    [
        (called("record note {0} cut --who Kim"), [REPORT]),
        (
            called("record withdraw {0} --rater R2 --who Kim --why left"),
            [RATERS, REPORT],
        ),
        (corrected, [TABLE, ANALYSIS, REPORT]),
        (
            lambda of: edit(of.protocol, '"percent_agreement"', '"gwet_ac"'),
            [ANALYSIS, REPORT],
        ),
        (
            called(
                "record rater add {0} --rater R3 --session test --who Kim",
                "schedule {0}",
                "run {0} --rater R3 --session test --grades simulated --quiet",
            ),
            [TABLE, RATERS, ANALYSIS, REPORT],
        ),
    ],
)
def test_what_is_out_of_date_is_stale_and_is_made_anew(
    study: StudyPaths, later: Callable[[StudyPaths], object], made_before: list[str]
) -> None:
    later(study)
    findings = [f for f in verify_study(study).findings if f.weight != "doubt"]
    of = [(f.path.relative_to(study.root).as_posix(), f.weight) for f in findings]
    assert of == [(name, "stale") for name in made_before]
    shown = run("verify", str(study.root), code=1)
    assert f"masrel: {study.root}: {len(made_before)} out of date" in shown
    run("check", str(study.root))
    is_said = f"{study.ratings_file}: is out of date" in run("analyze", str(study.root))
    assert is_said == (TABLE in made_before)
    for verb in ("ratings", "report"):
        run(verb, str(study.root))
    run("verify", str(study.root))


@pytest.mark.parametrize(
    "later",
    [
        partial(corrected, grade=None),
        called("record exclude {0} --rater R2 --who Kim --why late"),
    ],
)
def test_what_was_made_of_more_than_there_is_now_is_stale(
    study: StudyPaths, later: Callable[[StudyPaths], object]
) -> None:
    later(study)
    called(*["record note {0} cut --who Kim"] * 40)(study)
    assert [f.weight for f in verify_study(study).findings] == ["stale"] * 3


def test_a_state_that_the_record_had_is_found_by_halves(study: StudyPaths) -> None:
    for _ in range(40):
        corrected(study)
    without_line(-1)(study.ratings_file)
    profile = Profile()
    findings = profile.runcall(verify_study, study).findings
    assert {f.weight for f in findings if f.path == study.ratings_file} == {"broken"}
    calls = {getattr(e.code, "co_name", ""): e.callcount for e in profile.getstats()}
    assert calls["ratings_from_logs"] < 30  # of 60 states, for three files


@pytest.mark.parametrize(
    ("log", "forge"),
    [
        (TRAINING, rewritten("training", presented_sha256="0" * 64)),
        (REHEARSAL, rewritten("session", schedule_sha256="0" * 64)),
    ],
)
def test_what_cannot_be_drawn_again_is_in_doubt(
    study: StudyPaths, log: str, forge: Forgery
) -> None:
    path = forge(study.root / log)
    (finding,) = verify_study(study).findings
    assert (finding.weight, finding.path) == ("doubt", path)
    with_a_bit_changed(sorted(path.with_suffix("").glob("*.npz"))[0])
    assert not verify_study(study).is_whole  # the log has its hash all the same


def test_a_kill_between_a_recording_and_the_log_breaks_no_study(
    study: StudyPaths,
) -> None:
    # back to where the first presentation is recorded, and not logged
    log = study.root / SESSION
    path = log.parent / str(first(events(log), "presented")["recording"])
    log.write_bytes(log.read_bytes().splitlines(keepends=True)[0])
    for other in log.with_suffix("").iterdir():
        if other.stem != path.stem:
            other.unlink()
    path.with_suffix(".partial").write_bytes(b"")
    for made in (study.ratings_file.parent, study.report):
        shutil.rmtree(made)
    study.analysis_file.unlink()
    verification = verify_study(study)
    assert verification.is_whole
    doubted = {finding.path for finding in verification.findings}
    assert doubted == {path, path.with_suffix(".json"), path.with_suffix(".partial")}


def test_samples_left_beside_it_excuse_no_recording_of_a_complete_session(
    study: StudyPaths,
) -> None:
    path = copied_as("XYZ.npz")(sorted(study.sessions.glob(RECORDING))[0])
    path.with_suffix(".partial").write_bytes(b"")
    assert broken(study) == [path]


def test_of_a_broken_chain_nothing_but_the_chain_is_said(study: StudyPaths) -> None:
    log = without_line(3)(study.root / SESSION)
    found = broken(study)
    assert log in found
    assert not any(path.parent == log.with_suffix("") for path in found)
    assert SESSION not in {anchor.log for anchor in anchors_of(study)}


@pytest.mark.parametrize(
    ("forge", "verb"),
    [
        (replaced(b",2,", b",3,"), "analyze"),
        (replaced(b"simulated", b"recorded"), "analyze"),
        (without_line(-1), "report"),
    ],
)
def test_a_table_that_is_not_that_of_the_logs_is_refused(
    study: StudyPaths, forge: Forgery, verb: str
) -> None:
    forge(study.ratings_file)
    with pytest.raises(RatingsError, match="is not what the session logs say"):
        run(verb, str(study.root))


def without_the_last_grade(log: Path) -> Path:
    return chained_anew(log, events(log)[:-2])


@pytest.mark.parametrize(
    ("file", "forge"),
    [
        (SESSION, rewritten("grade", grade="4")),
        (SESSION, without_the_last_grade),
        (TRAINING, rewritten("complete", passed=None)),
        (REHEARSAL, rewritten("grade", stretch=1)),
    ],
)
def test_with_an_anchor_a_chain_computed_anew_is_found(
    study: StudyPaths, tmp_path: Path, file: str, forge: Forgery
) -> None:
    anchors = tmp_path / "anchors.txt"
    write_anchors(anchors_of(study), anchors)
    assert {anchor.log for anchor in read_anchors(anchors)} > {*LOGS}
    assert [*anchor_findings(study, read_anchors(anchors))] == []
    log = forge(study.root / file)
    shutil.rmtree(study.report)
    for verb in ("ratings", "analyze"):
        run(verb, str(study.root))
    assert verify_study(study).is_whole  # without the anchor it cannot be seen
    assert [f.path for f in anchor_findings(study, read_anchors(anchors))] == [log]


def test_a_log_that_has_grown_still_fits_its_anchor(study: StudyPaths) -> None:
    anchors = anchors_of(study)
    corrected(study)
    assert [*anchor_findings(study, anchors)] == []
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
    corrected(study)  # what was made before is out of date now
    n = len(anchors_of(study))
    assert f"note: 1 of {n} logs have lines that no anchor in {old} " in said(old, 1)
    said(new, 1)
    new.write_text(old.read_text() + new.read_text())
    assert "no anchor" not in said(new, 1)


def test_the_verb_says_every_session_and_ends_with_2_when_broken(
    study: StudyPaths, tmp_path: Path
) -> None:
    file = tmp_path / "kept" / "anchors.txt"
    whole = run("verify", str(study.root), "--anchor", str(file))
    assert f"{study.root}: whole." in whole
    assert whole.count("complete, ") == len(study.logs()) + 1  # and the rehearsal
    assert file.is_file()
    rewritten("grade", grade="4")(study.root / SESSION)
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
    with pytest.raises(ParameterError, match="needed a file outside"):
        run("verify", str(study.root), "--anchor", str(study.root / "anchors.txt"))


@pytest.mark.parametrize(
    "text", ["", "abc  1  sessions/a.jsonl\n", f"{'0' * 64} sessions/a.jsonl\n"]
)
def test_a_file_that_holds_no_anchors_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "anchors.txt"
    file.write_text(text)
    with pytest.raises(ParameterError, match="needed"):
        read_anchors(file)
