"""What a report says was done follows the record: change that, and words change."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from masrel.lab import SimulatedGrades, analysis, conduct, ratings, run_session
from masrel.lab.paper._entry import enter_sheet
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.report import _conduct, _document, _material, _paragraphs
from masrel.tables._tables import tag_of
from tests.lab.paper.test_entry import filled, typed
from tests.lab.run.conftest import PROTOCOL
from tests.lab.run.test_session import console

Study = tuple[StudyPaths, Protocol]
pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")

PLAN = """[analysis]
estimates = [{ id = "k", kind = "inter-rater", coefficient = "fleiss_kappa", \
sessions = ["test"], target = "items" }]

[schedule]"""
OTHER = """[occasions]
practice = ["HM1"]
break_after = 2
break_minutes = 1.0

[schedule]
scheme = "latin-square\""""
MORE = {"run": PLAN, "of another scheme": PLAN.replace("[schedule]", OTHER)}
BY = {"who": "JL", "why": "an injury"}
# by a program, in order
PAIRS: dict[str, tuple[tuple[str, str], ...]] = {
    "run": (("R1", "test"), ("R2", "test"), ("R1", "retest")),
    "of another scheme": (("R1", "test"),),
    "drawn": (),
}


@dataclass(frozen=True)
class Case:
    """A change of the record, and what is and is not said then."""

    says: tuple[str, ...]
    never: tuple[str, ...] = ()
    of: str = "run"  # what is changed
    n_run: int = 3  # sessions whose logs are there
    then: Callable[[Study], object] = str  # which changes nothing
    include: tuple[str, ...] = ()


def by_a_person(study: Study) -> None:
    rater = "R2" if study[0].log_file("R1", "test").exists() else "R1"
    run_session(
        *study, rater, "test", grades=console("\n1\n" * 5)[0], clock="simulated"
    )


def on_paper(study: Study) -> None:
    enter_sheet(
        *(*study, typed(study, filled(study, "1", "2", "3")), "R1", "test"), who="JL"
    )


def amend(study: Study) -> None:
    paths = study[0]
    for old, new in (
        ("fleiss_kappa", "gwet_ac"),
        ('target = "items"', 'target = "both"'),
    ):
        text = paths.protocol.read_text(encoding="utf-8").replace(old, new)
        paths.protocol.write_text(text, encoding="utf-8")
        if new == "gwet_ac":
            conduct.record_amendment(paths, read_protocol(paths.protocol), **BY)


def elsewhere(study: Study) -> Path:
    file = study[0].root / "other.csv"
    file.write_text("rater,model,grade\nR1,HM1,1\nR2,HM1,1\nR1,HM3,2\nR2,HM3,3\n")
    return file


PROGRAM = "a program instead of 2 raters graded the models in a random order"
BLIND = "saw only their codes"
CASES = {
    "all sessions by a program": Case(
        ("SIMULATED DATA: no person gave these grades.", PROGRAM,
         "In session test, 2 of 2 raters completed all 3 presentations",
         "a simulated hand stretched the arm 1.0 times per presentation",
         "In session retest, 1 of 1 rater completed all 3 presentations",
         "drawn with a secret that is not published", "No unblinding is recorded.",
         "\nSimulated data.\n", "stamp='SIMULATED DATA')"),
        never=(BLIND, "INTERIM", "practice", "break", "the plan was changed"),
    ),
    "a session missing": Case(
        ("INTERIM: 2 of 3 sessions", "stamp='SIMULATED DATA, INTERIM')",
         "\nSimulated data, interim.\n", "In session retest, none of 1 rater has begun",
         "Sessions are still to come"),
        never=("random order, drawn beforehand; none",), n_run=2,
    ),
    "one of two raters": Case(
        ("INTERIM: 1 of 3 sessions", "In session test, 1 of 2 raters completed all"),
        n_run=1,
    ),
    "another scheme": Case(
        ("graded the models in an order of a Latin square, which balances places",),
        never=("a random order",),
        of="of another scheme", n_run=1,
    ),
    "a published secret": Case(
        ("drawn with a secret that has been published",), never=("is not published",),
        then=lambda study: study[0].secret_file.rename(
            study[0].published_secret_file
        ).name,
    ),
    "an unblinding": Case(
        ("Codes were unblinded once.",), never=("No unblinding",),
        then=lambda study: conduct.record_unblinding(*study, None, **BY),
    ),
    "a person instead of a program": Case(
        ("SIMULATED DEVICE: persons gave these grades, 3 of 3 on the simulated device",
         "1 rater received the models in a random order, drawn beforehand, and saw "
         "only their codes", "raters stretched the arm 1.0 times", "In session test, 1 "
         "of 2 raters completed all 3 presentations",
         "stamp='SIMULATED DEVICE, INTERIM')"),
        never=("a program", "SIMULATED DATA"), of="drawn", then=by_a_person,
    ),
    "a person and a program": Case(
        ("SIMULATED DATA: 3 of 6 grades are a program's, 3 by persons on the simulated "
         "device.", "1 rater received the models", "a program instead of 1 rater grad"),
        of="of another scheme", n_run=1, then=by_a_person,
    ),
    "on paper": Case(
        ("wrote grades on sheets with only codes, in a random order, drawn "
         "beforehand; what was presented to them is not recorded", "stamp='INTERIM')",
         "Study three, recorded ratings."),
        never=(BLIND, "stretched", "SIMULATED"), of="drawn", then=on_paper,
    ),
    "ratings from elsewhere": Case(
        ("In session test, 2 raters graded 2 standard models (4 grades, none missing)",
         "The data are 4 grades of 2 haptic models by 2 raters in session test",
         "The ratings come from the file other.csv and not from session logs, so how "
         "they were collected is not recorded. The protocol plans 3 haptic models (2 "
         "standard, 1 dummy), 2 raters and 2 sessions, in which each rater is"),
        never=(BLIND, "completed", "INTERIM", "drawn", "In session retest"),
        of="drawn", then=elsewhere,
    ),
    "ratings from elsewhere, of a study that is under way": Case(
        ("The ratings come from the file other.csv", "INTERIM: 1 of 3 sessions"),
        never=("completed", "SIMULATED"), n_run=1, then=elsewhere,
    ),
    "a changed plan": Case(
        ("After the first draw of schedules the plan was changed; the table “Changes "
         "to the plan” has 2 changes.", "'\"fleiss_kappa\"', '\"gwet_ac\"', '20",
         ".target', '\"items\"', '\"both\"', 'no')"),
        never=("JL", "an injury"), then=amend,
    ),
    "a changed plan, and who changed it": Case(
        ("'an injury', 'JL')", "'no', None, None)"), then=amend,
        include=("who", "notes"),
    ),
    "a withdrawn rater": Case(
        ("R1 withdrew; grades given before that count.",),
        never=("INTERIM",), n_run=2,
        then=lambda study: conduct.record_standing(*study, "R1", "withdrawn", **BY),
    ),
    "practice and breaks": Case(
        ("1 session began with practice on HM1, which was not rated; 1 break was taken",
         "In session test, 1 of 2 raters completed"),
        of="of another scheme", n_run=1,
    ),
}  # fmt: skip


def shown(material: _material.Material) -> str:
    """Headline, methods, and tables and captions with their tags and stamps."""
    texts = [material.banner, material.provenance, _paragraphs.result_text(material)]
    made = [
        _document.made_section(name, material)
        for name in ("methods", "grades", "conduct")
    ]
    return "\n".join((*texts, tag_of(material.data), *map(str, made)))


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study as it was run, one that was only drawn, and one of another scheme."""
    folder = tmp_path_factory.mktemp("studies")
    for name, pairs in PAIRS.items():
        paths = StudyPaths(folder / name)
        paths.root.mkdir()
        paths.protocol.write_text(
            PROTOCOL.replace("[schedule]", MORE.get(name, PLAN)), encoding="utf-8"
        )
        protocol = read_protocol(paths.protocol)
        conduct.allot_schedules(paths, protocol)
        for pair in pairs:
            grades = SimulatedGrades(protocol)
            run_session(paths, protocol, *pair, grades=grades, clock="simulated")
    return folder


@pytest.mark.parametrize("what", CASES)
def test_words_follow_the_record(what: str, studies: Path, tmp_path: Path) -> None:
    case = CASES[what]
    paths = StudyPaths(shutil.copytree(studies / case.of, tmp_path / "study"))
    for rater, session in PAIRS[case.of][case.n_run :]:
        paths.log_file(rater, session).unlink()
        shutil.rmtree(paths.log_file(rater, session).with_suffix(""))
    came = case.then((paths, read_protocol(paths.protocol)))
    file = came if isinstance(came, Path) else None
    protocol = read_protocol(paths.protocol)
    data = ratings.read_study_data(paths, protocol, file=file)
    happened = _conduct.study_conduct(paths, protocol, file=file, include=case.include)
    of_study = (protocol, data.ratings, analysis.analyze(protocol, data.ratings))
    text = shown(_material.gather(*of_study, conduct=happened))
    assert [said for said in case.says if said not in text] == []
    assert [said for said in case.never if said in text] == []
