"""Forgeries of a whole record and of a sealed one: what is found, and what is not.

``docs/record.md`` shows the table; ``python -m tests.lab.flow.test_forgeries`` writes it.
"""

import hashlib
import json
import shutil
from collections import Counter
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

PAGE = Path(__file__).parents[3] / "docs" / "record.md"
MARKS = "<!-- forgeries -->\n", "<!-- end of the forgeries -->\n"
R1, R2, R3 = (f"sessions/test_{rater}.jsonl" for rater in ("R1", "R2", "R3"))
CONDUCT, TABLE, ANALYSIS = "conduct.jsonl", "ratings/ratings.csv", "analysis.json"
RATERS, SCHEDULE, SEALED = "ratings/raters.csv", "schedules/test_R1.csv", "../sealed"
MANIFEST, NUMBERS = "report/manifest.json", "report/analysis.json"
BY = ("--who", "MK", "--why", "a slip")

Forge = Callable[[Path], object]
"""Changes a file."""

FOUND, DOUBT, STALE, NO = "found", "in doubt", "out of date", "not found"


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


def timed(place: int, time: str) -> Forge:
    return lines(lambda of: of[place].update(time_utc=time))  # type: ignore[arg-type]


def a_year_earlier(of: Events) -> None:
    for each in of:
        year, rest = str(each["time_utc"]).split("-", 1)
        each.update(time_utc=f"{int(year) - 1}-{rest}")  # type: ignore[arg-type]


def changing_places(key: str) -> Forge:
    """Two grades, or their codes, change places."""

    def change(of: Events) -> None:
        one, other = [e["fields"] for e in of if e["event"] == "grade"][:2]
        one[key], other[key] = other[key], one[key]

    return lines(change)


def a_key_twice(log: Path) -> None:
    lines(lambda of: None)(log)
    text = log.read_text().splitlines()
    place = next(i for i, each in enumerate(text) if '"event": "complete"' in each)
    text[place] = text[place].replace(
        '"fields": {', '"fields": {"n_presentations": 1, '
    )
    previous = hashlib.sha256(text[place].encode()).hexdigest()
    for n in range(place + 1, len(text)):
        document = json.loads(text[n])
        text[n] = json.dumps(document | {"previous": previous})
        previous = hashlib.sha256(text[n].encode()).hexdigest()
    log.write_text("".join(f"{each}\n" for each in text))


def the_new_plan_from_the_first(of: Events) -> None:
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


def another_model(file: Path) -> None:
    with_facts(file, model="HM9")


def models_that_change_places(schedule: Path) -> None:
    *head, one, other = (x.split(",") for x in schedule.read_text().splitlines())
    one[2:], other[2:] = other[2:], one[2:]
    schedule.write_text("".join(f"{','.join(x)}\n" for x in (*head, one, other)))


def another_order(schedule: Path) -> None:
    """A schedule, and its hash in the log of the session."""
    models_that_change_places(schedule)
    sha256 = hashlib.sha256(schedule.read_bytes()).hexdigest()
    line("session", schedule_sha256=sha256)(root_of(schedule) / R1)


def another_secret(file: Path) -> None:
    file.write_text(f"format: 1\nsecret: {'5' * 32}\n")


def a_link(log: Path) -> None:
    log.rename(log.parent.parent / "elsewhere.jsonl")
    log.symlink_to("../elsewhere.jsonl")


def an_older_log(log: Path) -> None:
    """As it was before a correction."""
    lines(lambda of: of.remove(of[-1]))(log)


def a_session_that_never_was(log: Path) -> None:
    shutil.rmtree(log.with_suffix(""))
    gone(log)


def another_number(file: Path) -> None:
    document = json.loads(file.read_text())
    document["estimates"][0]["estimate"]["value"] = 0.9
    file.write_text(json.dumps(document))


def another_number_of(key: str) -> Forge:
    """A number, and the hash of what it is of, wherever that is."""

    def forge(file: Path) -> None:
        another_number(file)
        sha256 = json.loads(file.read_text())["inputs"][key]
        edit(file, sha256, hashlib.sha256(b"").hexdigest())

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
    ("a grade, the chain anew", R1, line("grade", grade="4"), FOUND, FOUND),
    (
        "a grade, the chain and all that comes after it anew",
        R1,
        remade(line("grade", grade="4")),
        NO,
        FOUND,
    ),
    (
        "a grade off the scale, the chain anew",
        R1,
        line("grade", grade="7"),
        FOUND,
        FOUND,
    ),
    ("two grades exchanged, all anew", R1, remade(changing_places("grade")), NO, FOUND),
    ("two codes exchanged, the chain anew", R1, changing_places("code"), FOUND, FOUND),
    (
        "a code of no schedule, the chain anew",
        R1,
        line("grade", code="ZZZ"),
        FOUND,
        FOUND,
    ),
    ("a position, the chain anew", R1, line("presented", position=4), FOUND, FOUND),
    ("a correction taken out, all anew", R1, remade(without("correction")), NO, FOUND),
    ("who corrected, the chain anew", R1, line("correction", who="Kim"), NO, FOUND),
    (
        "a time set back, the chain anew",
        R1,
        timed(3, "2012-01-01T00:00:00Z"),
        DOUBT,
        FOUND,
    ),
    ("a time that is none, the chain anew", R1, timed(3, "noon"), FOUND, FOUND),
    (
        "a session a year earlier, all anew",
        R1,
        remade(lines(a_year_earlier)),
        NO,
        FOUND,
    ),
    ("a key of JSON twice, the chain anew", R1, a_key_twice, FOUND, FOUND),
    (
        "presentations: -5, the chain anew",
        R1,
        line("complete", n_presentations=-5),
        FOUND,
        FOUND,
    ),
    ("the last line cut off", R1, without_line(-1), FOUND, FOUND),
    (
        "the last line cut off, all after it anew",
        R1,
        remade(without_line(-1)),
        NO,
        FOUND,
    ),
    (
        "the whole log as it once was, all after it anew",
        R1,
        remade(an_older_log),
        NO,
        FOUND,
    ),
    (
        "a session taken away whole, all after it anew",
        R3,
        remade(a_session_that_never_was),
        NO,
        FOUND,
    ),
    ("a link in the place of a log", R1, a_link, FOUND, FOUND),
    (
        "a bit of a recording",
        "sessions/test_R1/*.npz",
        with_a_bit_changed,
        FOUND,
        FOUND,
    ),
    (
        "the recording of another presentation",
        "sessions/test_R1/*.npz",
        of_another,
        FOUND,
        FOUND,
    ),
    (
        "the same, its hashes and the chain anew",
        "sessions/test_R1/*.npz",
        another_movement,
        NO,
        FOUND,
    ),
    (
        "the model in the facts of a recording, hash and chain anew",
        "sessions/test_R1/*.json",
        another_model,
        FOUND,
        FOUND,
    ),
    (
        "two models of a schedule exchanged",
        SCHEDULE,
        models_that_change_places,
        FOUND,
        FOUND,
    ),
    ("the same, its hash and the chain anew", SCHEDULE, another_order, FOUND, FOUND),
    ("another secret", ".key/secret.txt", another_secret, FOUND, FOUND),
    (
        "the copy of the protocol, the chain anew",
        CONDUCT,
        line("drawn", protocol="{}"),
        FOUND,
        FOUND,
    ),
    (
        "the hash of the protocol, the chain anew",
        CONDUCT,
        line("drawn", protocol_sha256="0" * 64),
        FOUND,
        FOUND,
    ),
    (
        "the hash of the scale's texts, the chain anew",
        CONDUCT,
        line("drawn", texts_sha256="0" * 64),
        DOUBT,
        FOUND,
    ),
    (
        "an amendment taken out, the chain anew",
        CONDUCT,
        without("amended"),
        DOUBT,
        FOUND,
    ),
    (
        "an amendment made earlier, the chain anew",
        CONDUCT,
        lines(lambda of: None),
        NO,
        FOUND,
    ),
    (
        "the new plan from the first draw on, all anew",
        CONDUCT,
        remade(lines(the_new_plan_from_the_first)),
        NO,
        FOUND,
    ),
    (
        "a late rater taken out of the log, the chain anew",
        CONDUCT,
        without("rater-added"),
        FOUND,
        FOUND,
    ),
    (
        "a withdrawal taken out, the chain anew",
        CONDUCT,
        without("withdrawn"),
        FOUND,
        FOUND,
    ),
    (
        "a withdrawal taken out, all anew",
        CONDUCT,
        remade(without("withdrawn")),
        NO,
        FOUND,
    ),
    (
        "the day of a withdrawal, the chain anew",
        CONDUCT,
        line("withdrawn", on="2025-01-01"),
        FOUND,
        FOUND,
    ),
    (
        "the day of a note, all anew",
        CONDUCT,
        remade(line("noted", on="2025-01-01")),
        NO,
        FOUND,
    ),
    ("a grade from paper, all anew", R2, remade(line("entered", grade="4")), NO, FOUND),
    (
        "the day of a session on paper, all anew",
        R2,
        remade(line("held", on="2025-01-01")),
        NO,
        FOUND,
    ),
    (
        "the correction of a day taken out, all anew",
        R2,
        remade(without("day-correction")),
        NO,
        FOUND,
    ),
    ("a grade of the table", TABLE, lambda f: edit(f, ",4,", ",3,", 1), FOUND, FOUND),
    ("a row of the table taken out", TABLE, without_line(-1), FOUND, FOUND),
    (
        "a status of the table of raters",
        RATERS,
        replaced(b"withdrawn", b"complete"),
        FOUND,
        FOUND,
    ),
    ("a number of the analysis", ANALYSIS, another_number, FOUND, FOUND),
    (
        "the same, and the hash of ratings",
        ANALYSIS,
        another_number_of("ratings_sha256"),
        FOUND,
        FOUND,
    ),
    (
        "the same, and the hash of the protocol",
        ANALYSIS,
        another_number_of("protocol_sha256"),
        STALE,
        STALE,
    ),
    (
        "a page of the report",
        "report/report.html",
        replaced(b"<p>", b"<p> "),
        FOUND,
        FOUND,
    ),
    (
        "a page of the report, with its hash",
        "report/report.html",
        with_its_hash(replaced(b"<p>", b"<p> ")),
        NO,
        NO,
    ),
    (
        "a number of the report, with its hash",
        NUMBERS,
        with_its_hash(another_number),
        FOUND,
        FOUND,
    ),
    (
        "a line of the file of anchors",
        "../study.txt",
        replaced(b"\n1", b"\n2"),
        NO,
        FOUND,
    ),
    (
        "the registration of a plan",
        "../plan.json",
        replaced(b"fleiss", b"cohen"),
        NO,
        NO,
    ),
    (
        "models of an opened schedule exchanged",
        f"{SEALED}/schedules/opened/test_R1.csv",
        models_that_change_places,
        FOUND,
        FOUND,
    ),
    (
        "codes of a sealed schedule",
        f"{SEALED}/{SCHEDULE}",
        models_that_change_places,
        FOUND,
        FOUND,
    ),
    (
        "the unblinding of a sealed study taken out",
        f"{SEALED}/{CONDUCT}",
        without("unblinded"),
        NO,
        FOUND,
    ),
    (
        "the model in the facts of a sealed recording",
        f"{SEALED}/sessions/test_R1/*.json",
        replaced(b"(sealed)", b"HM1"),
        FOUND,
        FOUND,
    ),
]


def a_record(folder: Path) -> Path:
    """Devices and paper, a late rater, a changed plan, corrections, a withdrawal."""
    study, protocol = folder / "study", folder / "study" / "protocol.toml"
    at = ("--rater", "R2", "--session", "test")
    run("init", str(study))
    text = protocol.read_text().partition("[report]")[0]
    protocol.write_text(f'{text}[report]\nsections = ["grades"]\n')
    run("schedule", str(study))
    run("record", "register", str(study), "-o", str(folder / "plan.json"))
    simulated = ("--grades", "simulated", "--quiet")
    run("run", str(study), "--rater", "R1", "--session", "test", *simulated)
    run("paper", "print", str(study))
    typed = study / "sheets" / "test_R2.csv"
    typed.write_text(typed.read_text().replace(",\n", ",2\n"))
    run(
        "paper",
        "enter",
        str(study),
        str(typed),
        *at,
        "--who",
        "MK",
        "--on",
        "2026-05-02",
    )
    run("record", "day", str(study), *at, "--on", "2026-05-03", *BY)
    code = str(first(events(study / R1), "grade")["code"])
    run(
        "record",
        "correct",
        str(study),
        "--rater",
        "R1",
        *at[2:],
        "--code",
        code,
        "--grade",
        "4",
        *BY,
    )
    run(
        "record", "note", str(study), "a power cut", "--who", "MK", "--on", "2026-05-03"
    )
    edit(protocol, '"percent_agreement"', '"gwet_ac"')
    run("record", "amend", str(study), *BY)
    run("record", "rater", "add", str(study), "--rater", "R3", *at[2:], "--who", "MK")
    run("schedule", str(study))
    run("run", str(study), "--rater", "R3", "--session", "test", *simulated)
    run("record", "withdraw", str(study), "--rater", "R3", *BY)
    for verb in ("ratings", "analyze", "report"):
        run(verb, str(study))
    return study


def a_sealed_record(folder: Path) -> Path:
    study = folder / "sealed"
    run("init", str(study))
    with (study / "protocol.toml").open("a", encoding="utf-8") as file:
        file.write("\n[blinding]\nsealed = true\n")
    run("schedule", str(study))
    for rater in ("R1", "R2"):
        at = ("--rater", rater, "--session", "test")
        run("run", str(study), *at, "--grades", "simulated", "--quiet")
    run("record", "unblind", str(study), "--all", *BY)
    return study


Findings = set[tuple[str, str]]


def found(root: Path) -> tuple[Findings, Findings]:
    """What verify finds in a study, and what it finds with its anchors besides."""
    study, anchors = StudyPaths(root), root.with_suffix(".txt")
    alone = verify_study(study).findings
    anchored = anchor_findings(study, read_anchors(anchors))
    one, other = (
        {(f.weight, f.message.replace(str(root), "")) for f in each}
        for each in (alone, anchored)
    )
    return one, other


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both records, each with anchors and what is found in it without a forgery."""
    folder = tmp_path_factory.mktemp("records")
    for root in (a_record(folder), a_sealed_record(folder)):
        write_anchors(anchors_of(StudyPaths(root)), root.with_suffix(".txt"))
        alone, anchored = found(root)
        assert {weight for weight, _ in alone} <= {"doubt"}
        assert anchored == set()
        root.with_suffix(".json").write_text(json.dumps(sorted(alone)))
    return folder


def outcome(findings: Findings, known: Findings) -> str:
    weights = {weight for weight, _ in findings - known}
    names = {"broken": FOUND, "stale": STALE, "doubt": DOUBT}
    return next((names[each] for each in names if each in weights), NO)


@pytest.mark.parametrize(
    ("what", "file", "forge", "alone", "anchored"),
    FORGERIES,
    ids=[f[0] for f in FORGERIES],
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


def table() -> str:
    """The forgeries as the page shows them."""
    rows = [
        f"| {what} | {alone} | {anchored} |"
        for what, _, _, alone, anchored in FORGERIES
    ]
    n = [Counter(each[place] for each in FORGERIES) for place in (3, 4)]
    counts = " | ".join(
        ", ".join(f"{of[key]} {key}" for key in (FOUND, DOUBT, STALE, NO) if of[key])
        for of in n
    )
    head = ["| forgery | without an anchor | with one from before |", "|---|---|---|"]
    return "\n".join([*head, *rows, f"| **of {len(FORGERIES)}** | {counts} |", ""])


def parts(text: str) -> tuple[str, str, str]:
    """The page before, in and after the table."""
    before, _, rest = text.partition(MARKS[0])
    made, _, after = rest.partition(MARKS[1])
    return before, made, after


def test_the_page_has_the_table() -> None:
    assert parts(PAGE.read_text(encoding="utf-8"))[1] == table()


if __name__ == "__main__":
    before, _, after = parts(PAGE.read_text(encoding="utf-8"))
    page = f"{before}{MARKS[0]}{table()}{MARKS[1]}{after}"
    PAGE.write_text(page, encoding="utf-8")
