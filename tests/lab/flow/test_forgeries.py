"""Forgeries of a whole record and of a sealed one: what is found, and what is not.

``python -m tests.lab.flow.test_forgeries`` writes the rows beside
``docs/evidence/record.md``.
"""

import csv
import hashlib
import json
import shlex
import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from docs.make.evidence import EVIDENCE, table, with_part, write_part, write_rows
from masrel.lab.protocol import StudyPaths
from masrel.lab.verification import (
    anchor_findings,
    anchors_of,
    read_anchors,
    verify_study,
    write_anchors,
)
from tests.files import edit
from tests.lab.flow.conftest import run
from tests.lab.flow.test_verify import (
    Events,
    chained_anew,
    events,
    first,
    gone,
    replaced,
    with_a_bit_changed,
    without_line,
)

PAGE, ROWS = EVIDENCE / "record.md", "record_forgeries"
R1, R2, R3 = (f"sessions/test_{rater}.jsonl" for rater in ("R1", "R2", "R3"))
CONDUCT, TABLE, ANALYSIS = "conduct.jsonl", "ratings/ratings.csv", "analysis.json"
RATERS, SCHEDULE, SEALED = "ratings/raters.csv", "schedules/test_R1.csv", "../sealed"
MANIFEST, NUMBERS = "report/manifest.json", "report/analysis.json"
RECORDING, FACTS = "sessions/test_R1/*.npz", "sessions/test_R1/*.json"
PAGES, PLAN = "report/report.html", "protocol.toml"

Forge = Callable[[Path], object]
"""Changes a file."""

FOUND, DOUBT, STALE, NO = "found", "in doubt", "out of date", "not found"
WEIGHTS = {"broken": FOUND, "stale": STALE, "doubt": DOUBT}


def lines(change: Callable[[Events], object]) -> Forge:
    """Changes events of a log, and computes its chain anew."""

    def forge(log: Path) -> None:
        documents = events(log)
        change(documents)
        chained_anew(log, documents)

    return forge


def line(kind: str, **fields: object) -> Forge:
    """Changes the first event of a kind."""
    return lines(lambda of: first(of, kind).update(fields))


def without(kind: str) -> Forge:
    return lines(lambda of: of.remove(next(e for e in of if e["event"] == kind)))


def at(kind: str, time: str) -> Forge:
    return lines(lambda of: [e.update(time_utc=time) for e in of if e["event"] == kind])


def changing_places(key: str) -> Forge:
    """Two grades, or their codes, change places."""

    def change(of: Events) -> None:
        one, other = [e["fields"] for e in of if e["event"] == "grade"][:2]
        one[key], other[key] = other[key], one[key]

    return lines(change)


def planned_so(of: Events) -> None:
    amended = next(each for each in of if each["event"] == "amended")
    drawn = first(of, "drawn")
    drawn |= {key: amended["fields"][key] for key in drawn.keys() & amended["fields"]}
    of.remove(amended)


def root_of(file: Path) -> Path:
    return next(p for p in file.parents if (p / "protocol.toml").exists())


def remade(forge: Forge) -> Forge:
    """Makes what comes after the logs anew, too."""

    def forge_all(file: Path) -> None:
        root = root_of(file)
        forge(file)
        shutil.rmtree(root / "report")
        for verb in ("ratings", "analyze"):
            run(verb, str(root))

    return forge_all


def of_another(file: Path) -> None:
    """The file is another one of its kind."""
    others = (p for p in sorted(file.parent.glob(f"*{file.suffix}")) if p != file)
    shutil.copy(next(others), file)


def with_facts(file: Path, **facts: object) -> None:
    """Changes the facts of a recording, and their hash in the log."""
    file.write_text(json.dumps(json.loads(file.read_text()) | facts, indent=1))

    def change(of: Events) -> None:
        for fields in (e["fields"] for e in of if e["event"] == "presented"):
            if str(fields["recording"]).endswith(f"{file.stem}.npz"):
                fields["facts_sha256"] = hashlib.sha256(file.read_bytes()).hexdigest()
                fields |= {k: facts[k] for k in ("sha256",) if k in facts}

    lines(change)(file.parent.with_suffix(".jsonl"))


def another_movement(file: Path) -> None:
    """A recording, its facts and the log are of another presentation's movement."""
    of_another(file)
    sha256 = hashlib.sha256(file.read_bytes()).hexdigest()
    with_facts(file.with_suffix(".json"), sha256=sha256)


def exchanged(schedule: Path) -> None:
    *head, one, other = (x.split(",") for x in schedule.read_text().splitlines())
    one[2:], other[2:] = other[2:], one[2:]
    schedule.write_text("".join(f"{','.join(x)}\n" for x in (*head, one, other)))


def another_order(schedule: Path) -> None:
    """A schedule, and its hash in the log of the session."""
    exchanged(schedule)
    sha256 = hashlib.sha256(schedule.read_bytes()).hexdigest()
    line("session", schedule_sha256=sha256)(root_of(schedule) / R1)


def number(**inputs: str) -> Forge:
    """Another number, and perhaps the hash of something else that it is of."""

    def forge(file: Path) -> None:
        document = json.loads(file.read_text())
        document["estimates"][0]["estimate"]["value"] = 0.9
        document["inputs"] |= inputs
        file.write_text(json.dumps(document))

    return forge


def with_its_hash(forge: Forge) -> Forge:
    """Changes a file of the report, and its hash in the manifest."""

    def forge_all(file: Path) -> None:
        before = hashlib.sha256(file.read_bytes()).hexdigest()
        forge(file)
        after = hashlib.sha256(file.read_bytes()).hexdigest()
        edit(root_of(file) / MANIFEST, before, after)

    return forge_all


# what is done, to which file, how, and what comes out without an anchor and with one
FORGERIES: list[tuple[str, str, Forge, str, str]] = [
    ("a grade of a log", R1, replaced(b'"grade": "', b'"grade": "+'), FOUND, FOUND),
    ("a grade, the chain recomputed", R1, line("grade", grade="4"), FOUND, FOUND),
    ("a grade, all recomputed", R1, remade(line("grade", grade="4")), NO, FOUND),
    (
        "a grade off the scale, the chain recomputed",
        R1,
        line("grade", grade="7"),
        FOUND,
        FOUND,
    ),
    (
        "two grades exchanged, all recomputed",
        R1,
        remade(changing_places("grade")),
        NO,
        FOUND,
    ),
    (
        "two codes exchanged, the chain recomputed",
        R1,
        changing_places("code"),
        FOUND,
        FOUND,
    ),
    (
        "a code of no schedule, the chain recomputed",
        R1,
        line("grade", code="ZZZ"),
        FOUND,
        FOUND,
    ),
    (
        "a position, the chain recomputed",
        R1,
        line("presented", position=4),
        FOUND,
        FOUND,
    ),
    (
        "who corrected a grade, the chain recomputed",
        R1,
        line("correction", who="JL"),
        NO,
        FOUND,
    ),
    (
        "a time set back, the chain recomputed",
        R1,
        at("grade", "2012-01-01T00:00:00Z"),
        DOUBT,
        FOUND,
    ),
    ("an invalid time, the chain recomputed", R1, at("grade", "noon"), FOUND, FOUND),
    (
        "a session on another day, all recomputed",
        R1,
        remade(
            lines(
                lambda of: [e.update(time_utc=f"2025{e['time_utc'][4:]}") for e in of]
            )
        ),
        NO,
        FOUND,
    ),
    (
        "a key of a line twice",
        R1,
        replaced(b'"who": "MK"', b'"who": "JL", "who": "MK"'),
        FOUND,
        FOUND,
    ),
    (
        "−5 presentations, the chain recomputed",
        R1,
        line("complete", n_presentations=-5),
        FOUND,
        FOUND,
    ),
    ("the last line cut off, a correction", R1, without_line(-1), FOUND, FOUND),
    (
        "a log as it was before a correction, all after it recomputed",
        R1,
        remade(without_line(-1)),
        NO,
        FOUND,
    ),
    ("the last line cut off, the end of a session", R3, without_line(-1), NO, FOUND),
    (
        "a session removed with its recordings, all after it recomputed",
        R3,
        remade(lambda log: [shutil.rmtree(log.with_suffix("")), gone(log)]),
        NO,
        FOUND,
    ),
    (
        "a link instead of a log",
        R1,
        lambda log: [log.rename(log.parent.parent / "x"), log.symlink_to("../x")],
        FOUND,
        FOUND,
    ),
    ("a bit of a recording", RECORDING, with_a_bit_changed, FOUND, FOUND),
    ("the recording of another presentation", RECORDING, of_another, FOUND, FOUND),
    (
        "the same, its hashes and the chain recomputed",
        RECORDING,
        another_movement,
        NO,
        FOUND,
    ),
    (
        "the model of a recording, its hash and the chain recomputed",
        FACTS,
        lambda facts: with_facts(facts, model="HM9"),
        FOUND,
        FOUND,
    ),
    ("two models of a schedule exchanged", SCHEDULE, exchanged, FOUND, FOUND),
    (
        "the same, its hash and the chain recomputed",
        SCHEDULE,
        another_order,
        FOUND,
        FOUND,
    ),
    (
        "another secret",
        ".key/secret.txt",
        lambda file: file.write_text(f"format: 1\nsecret: {'5' * 32}\n"),
        DOUBT,
        DOUBT,
    ),
    (
        "the copy of the protocol, the chain recomputed",
        CONDUCT,
        line("drawn", protocol="{}"),
        FOUND,
        FOUND,
    ),
    (
        "the hash of the protocol, the chain recomputed",
        CONDUCT,
        line("drawn", protocol_sha256="0" * 64),
        FOUND,
        FOUND,
    ),
    (
        "the hash of the scale's texts, all recomputed",
        CONDUCT,
        remade(line("drawn", texts_sha256="0" * 64)),
        DOUBT,
        FOUND,
    ),
    (
        "the new plan since the first draw, all recomputed",
        CONDUCT,
        remade(lines(planned_so)),
        DOUBT,
        FOUND,
    ),
    (
        "an amendment removed: the next draw has the plan too, all recomputed",
        CONDUCT,
        remade(without("amended")),
        NO,
        FOUND,
    ),
    (
        "who amended the plan, all recomputed",
        CONDUCT,
        remade(line("amended", who="JL")),
        NO,
        FOUND,
    ),
    (
        "a late rater removed from the log, the chain recomputed",
        CONDUCT,
        without("rater-added"),
        FOUND,
        FOUND,
    ),
    (
        "a withdrawal removed, the chain recomputed",
        CONDUCT,
        without("withdrawn"),
        FOUND,
        FOUND,
    ),
    (
        "a withdrawal removed, all recomputed",
        CONDUCT,
        remade(without("withdrawn")),
        NO,
        FOUND,
    ),
    (
        "the day of a withdrawal, the chain recomputed",
        CONDUCT,
        line("withdrawn", on="2025-01-01"),
        FOUND,
        FOUND,
    ),
    (
        "the day of a note, all recomputed",
        CONDUCT,
        remade(line("noted", on="2025-01-01")),
        NO,
        FOUND,
    ),
    ("the log of the study removed", CONDUCT, gone, FOUND, FOUND),
    (
        "a grade from paper, all recomputed",
        R2,
        remade(line("entered", grade="4")),
        NO,
        FOUND,
    ),
    (
        "the day of a session on paper, all recomputed",
        R2,
        remade(line("held", on="2025-01-01")),
        NO,
        FOUND,
    ),
    (
        "the correction of a day removed, all recomputed",
        R2,
        remade(without("day-correction")),
        NO,
        FOUND,
    ),
    ("a grade of the table", TABLE, replaced(b",4,", b",3,"), FOUND, FOUND),
    ("a row of the table removed", TABLE, without_line(-1), FOUND, FOUND),
    (
        "a status of the table of raters",
        RATERS,
        replaced(b"R1,NA,complete", b"R1,NA,planned"),
        FOUND,
        FOUND,
    ),
    (
        "the same, as it was before a withdrawal",
        RATERS,
        replaced(b"withdrawn", b"complete"),
        STALE,
        STALE,
    ),
    ("a number of the analysis", ANALYSIS, number(), FOUND, FOUND),
    (
        "the same, and the hash of ratings",
        ANALYSIS,
        number(ratings_sha256="0" * 64),
        FOUND,
        FOUND,
    ),
    (
        "the same, and the hash of the protocol",
        ANALYSIS,
        number(protocol_sha256="0" * 64),
        STALE,
        STALE,
    ),
    ("a page of the report", PAGES, replaced(b"<p>", b"<p> "), FOUND, FOUND),
    (
        "the same, with its hash",
        PAGES,
        with_its_hash(replaced(b"<p>", b"<p> ")),
        NO,
        NO,
    ),
    (
        "a number of the report, with its hash",
        NUMBERS,
        with_its_hash(number()),
        FOUND,
        FOUND,
    ),
    (
        "a line of the anchors",
        "../study.txt",
        replaced(b"test_R1", b"test_R3"),
        NO,
        FOUND,
    ),
    (
        "the registration of the plan",
        "../plan.json",
        replaced(b"fleiss", b"cohen"),
        NO,
        NO,
    ),
    (
        "two models of an opened schedule exchanged",
        f"{SEALED}/schedules/opened/test_R1.csv",
        exchanged,
        FOUND,
        FOUND,
    ),
    (
        "two rows of a sealed schedule exchanged",
        f"{SEALED}/{SCHEDULE}",
        exchanged,
        FOUND,
        FOUND,
    ),
    (
        "the model in a sealed recording",
        f"{SEALED}/{FACTS}",
        replaced(b"(sealed)", b"HM1"),
        FOUND,
        FOUND,
    ),
    (
        "an unblinding removed, the chain recomputed",
        f"{SEALED}/{CONDUCT}",
        without("unblinded"),
        FOUND,
        FOUND,
    ),
]


SIMULATED, BY = "--session test --grades simulated --quiet", "--who MK --why 'a slip'"


def with_a_corrected_grade(study: Path) -> None:
    code = str(first(events(study / R1), "grade")["code"])
    at_r1 = ("--rater", "R1", "--session", "test", "--code", code)
    run("record", "correct", str(study), *at_r1, "--grade", "4", *shlex.split(BY))


# commands, and what is done beside them, by the names of studies
RECORDS: dict[str, list[str | Callable[[Path], None]]] = {
    "study": [
        "init {0}",
        lambda s: edit(s / PLAN, "[report]", '[report]\nsections = ["grades"]'),
        "schedule {0}",
        "record register {0} -o {0}/../plan.json",
        f"run {{0}} --rater R1 {SIMULATED}",
        "paper print {0}",
        lambda s: edit(s / "sheets" / "test_R2.csv", ",\n", ",2\n"),
        "paper enter {0} {0}/sheets/test_R2.csv --rater R2 --session test --who MK "
        "--on 2026-05-02",
        f"record day {{0}} --rater R2 --session test --on 2026-05-03 {BY}",
        with_a_corrected_grade,
        "record note {0} 'a power cut' --who MK --on 2026-05-03",
        lambda s: edit(s / PLAN, '"percent_agreement"', '"gwet_ac"'),
        f"record amend {{0}} {BY}",
        "record rater add {0} --rater R3 --session test --who MK",
        "schedule {0}",
        f"run {{0}} --rater R3 {SIMULATED}",
        f"record withdraw {{0}} --rater R3 {BY}",
        "ratings {0}",
        "analyze {0}",
        "report {0}",
    ],
    "sealed": [
        "init {0}",
        lambda s: edit(s / PLAN, "[report]", "[blinding]\nsealed = true\n[report]"),
        "schedule {0}",
        f"run {{0}} --rater R1 {SIMULATED}",
        f"run {{0}} --rater R2 {SIMULATED}",
        f"record unblind {{0}} --all {BY}",
    ],
}


Findings = set[tuple[str, str]]


def found(root: Path) -> tuple[Findings, Findings]:
    """What verify finds in a study, and what it finds with its anchors besides."""
    study, anchors = StudyPaths(root), root.with_suffix(".txt")
    alone, anchored = (
        {(f.weight, f.message.replace(str(root), "")) for f in each}
        for each in (
            verify_study(study).findings,
            anchor_findings(study, read_anchors(anchors)),
        )
    )
    return alone, anchored


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both records, each with anchors and what is found in it without a forgery."""
    folder = tmp_path_factory.mktemp("records")
    for name, steps in RECORDS.items():
        root = folder / name
        for step in steps:
            if isinstance(step, str):
                run(*shlex.split(step.format(root)))
            else:
                step(root)
        write_anchors(anchors_of(StudyPaths(root)), root.with_suffix(".txt"))
        alone, anchored = found(root)
        assert {weight for weight, _ in alone} <= {"doubt"}
        assert anchored == set()
        root.with_suffix(".json").write_text(json.dumps(sorted(alone)))
    return folder


def outcome(findings: Findings, known: Findings) -> str:
    weights = {weight for weight, _ in findings - known}
    return next((WEIGHTS[each] for each in WEIGHTS if each in weights), NO)


@pytest.mark.parametrize(
    ("what", "file", "forge", "alone", "anchored"),
    [
        pytest.param(
            *row,
            marks=[pytest.mark.slow]
            * row[0].endswith(("all recomputed", "after it recomputed")),
            id=row[0],
        )
        for row in FORGERIES
    ],
)
def test_a_forgery_is_found_or_said_not_to_be(
    records: Path,
    tmp_path: Path,
    what: str,
    file: str,
    forge: Forge,
    alone: str,
    anchored: str,
) -> None:
    folder = shutil.copytree(records, tmp_path / "records")
    root = folder / ("sealed" if file.startswith(SEALED) else "study")
    known = {tuple(each) for each in json.loads(root.with_suffix(".json").read_text())}
    forge(sorted((folder / "study").glob(file))[0])
    with_and_without = found(root)
    assert outcome(with_and_without[0], known) == alone, what
    assert outcome(set().union(*with_and_without), known) == anchored, what


def rows() -> list[dict[str, str]]:
    """The forgeries as the file beside the page has them."""
    head = ("forgery", "without an anchor", "with one from before")
    return [
        dict(zip(head, (what, alone, anchored), strict=True))
        for what, _, _, alone, anchored in FORGERIES
    ]


def summary() -> str:
    """How many were found, as the page shows it."""
    kinds = (FOUND, DOUBT, STALE, NO)
    counts = []
    for key in list(rows()[0])[1:]:
        count = Counter(row[key] for row in rows())
        counts.append([key, *(count[kind] for kind in kinds)])
    return table([f"of {len(FORGERIES)}", *kinds], counts)


def test_the_page_and_its_file_have_what_was_found() -> None:
    with (EVIDENCE / f"{ROWS}.csv").open(encoding="utf-8") as file:
        assert list(csv.DictReader(file)) == rows()
    text = PAGE.read_text(encoding="utf-8")
    assert with_part(text, "forgeries", summary()) == text


if __name__ == "__main__":
    write_rows(ROWS, rows())
    write_part(PAGE, "forgeries", summary())
