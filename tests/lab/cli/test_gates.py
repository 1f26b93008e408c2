"""Gates fail where a number falls short, and say it in one sentence each."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from masrel.agreement import fleiss_kappa, p_value
from masrel.lab.protocol import StudyPaths, protocol_hash, read_protocol
from masrel.lab.ratings import rating_matrix, read_study_data
from tests.cli.process import Caller

STUDY = Path("studies/hess2012")


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Table V with one estimate: Fleiss' kappa 0.6261, of 4 models by 8 raters."""
    text = (STUDY / "protocol.toml").read_text()
    head, _, rest = text.partition("[[analysis.estimates]]")
    report = rest[rest.index("[report]") :]
    plan = """
[[analysis.estimates]]
id = "kappa.std"
kind = "inter-rater"
coefficient = "fleiss_kappa"
sessions = ["test"]
target = "raters"
interval = "jackknife"

[[analysis.estimates]]
id = "again"
kind = "test-retest"
coefficient = "stratified_kappa"
sessions = ["test", "retest"]
target = "items"

"""
    (tmp_path / "ratings").mkdir()
    table = (STUDY / "ratings" / "published.csv").read_text()
    (tmp_path / "ratings" / "published.csv").write_text(table)
    (tmp_path / "protocol.toml").write_text(head + plan + report)
    return tmp_path


def verdicts(masrel: Caller, study: Path, *gates: str) -> tuple[object, list[str]]:
    required = [text for gate in gates for text in ("--require", gate)]
    done = masrel("analyze", study, *required)
    return done.code, [line for line in done.err.splitlines() if "--require" in line]


def test_every_number_can_be_required(masrel: Caller, study: Path) -> None:
    masrel("analyze", study)
    document = json.loads((study / "analysis.json").read_text())
    estimate = document["estimates"][0]["estimate"]
    low, high = estimate["interval"]["low"], estimate["interval"]["high"]
    protocol = read_protocol(study / "protocol.toml")
    ratings = read_study_data(StudyPaths(study), protocol).ratings
    grades = rating_matrix(ratings, session="test").grades
    p = p_value(fleiss_kappa(grades, categories=protocol.scale.grades))
    numbers = {
        "value": estimate["value"],
        "low": low,
        "high": high,
        "width": high - low,
        "n": 4.0,
        "n_missing": 0.0,
        "p": p,
    }
    assert round(numbers["value"], 4) == 0.6261
    for name, number in numbers.items():
        gates = [f"kappa.std.{name}{sign}{number!r}" for sign in (">=", "<=", ">", "<")]
        code, lines = verdicts(masrel, study, *gates)
        assert code == 1
        said = [line.rpartition(" ")[0].rpartition(" ")[2] for line in lines]
        assert said == ["holds:", "holds:", "fails:", "fails:"]


def test_what_is_not_there_fails(masrel: Caller, study: Path) -> None:
    code, (line,) = verdicts(masrel, study, "again.value > -9")
    assert code == 1
    assert line.endswith(
        "fails: not in these data: there are no ratings of session retest"
    )


def test_gates_of_the_protocol_are_checked_by_the_report_too(
    masrel: Caller, study: Path, tmp_path: Path
) -> None:
    before = protocol_hash(read_protocol(study / "protocol.toml"))
    with (study / "protocol.toml").open("a") as file:
        file.write('\n[[report.gates]]\nrequire = "kappa.std.n >= 5"\nwhy = "size"\n')
    assert protocol_hash(read_protocol(study / "protocol.toml")) != before
    done = masrel("report", study, "-o", tmp_path / "out", "--quiet")
    assert done.code == 1
    assert "report.gates[0]: kappa.std.n >= 5 (size) fails: 4" in done.err
    assert (tmp_path / "out" / "report.html").is_file()


# What the schema of Jenkins' xUnit plugin, which others follow, has of each element.
JUNIT = {
    "testsuite": (
        {"name", "tests", "failures", "errors", "skipped", "time"},
        {"testcase"},
    ),
    "testcase": (
        {"name", "classname", "time"},
        {"skipped", "failure", "error", "system-out", "system-err"},
    ),
    "skipped": ({"message"}, set()),
    "failure": ({"message"}, set()),
    "system-out": (set(), set()),
}


def check_junit(root: ElementTree.Element) -> None:
    assert root.tag == "testsuite"
    for element in root.iter():
        attributes, children = JUNIT[element.tag]
        assert set(element.attrib) <= attributes
        assert {child.tag for child in element} <= children
    assert int(root.get("tests", "")) == len(root.findall("testcase"))
    for tag in ("failure", "error", "skipped"):
        name = tag if tag == "skipped" else f"{tag}s"
        assert int(root.get(name, "")) == len(root.findall(f"*/{tag}"))


@pytest.mark.parametrize("place", ["none/summary.md", "."])
def test_a_summary_that_cannot_be_written_hides_no_gate(
    masrel: Caller,
    study: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    place: str,
) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / place))
    done = masrel("analyze", study, "--require", "kappa.std.n > 4")
    assert done.code == 2
    assert "--require: kappa.std.n > 4 fails: 4" in done.err
    assert done.err.splitlines()[-1].startswith(
        f"masrel: GITHUB_STEP_SUMMARY: {tmp_path / place}: "
    )


def test_junit_and_the_summary_of_a_job_have_every_estimate_and_gate(
    masrel: Caller, study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    summary = tmp_path / "summary.md"
    summary.write_text("before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    with (study / "protocol.toml").open("a") as file:
        file.write('\n[[report.gates]]\nrequire = "kappa.std.n >= 5"\n')
        file.write('why = "a | b <i>"\n')
    gates = ("--require", "kappa.std.n>=4", "--require", "kappa.std.n>4")
    junit = tmp_path / "junit.xml"
    done = masrel("analyze", study, *gates, "--junit", junit)
    assert done.code == 1
    suite = ElementTree.parse(junit).getroot()
    assert {key: suite.get(key) for key in ("tests", "failures", "skipped")} == {
        "tests": "5",
        "failures": "2",
        "skipped": "1",
    }
    check_junit(suite)
    cases = {case.get("name"): [child.tag for child in case] for case in suite}
    assert cases == {
        "kappa.std": ["system-out"],
        "again": ["skipped"],
        "kappa.std.n >= 4": [],
        "kappa.std.n > 4": ["failure"],
        "kappa.std.n >= 5": ["failure"],
    }
    text = summary.read_text()
    assert text.startswith("before\n")
    assert r"(a \| b \<i\>)" in text
    assert "Fleiss' κ = .63" in text
    assert r"| **fails** | --require: kappa.std.n \> 4 fails: 4 |" in text
    first = junit.read_bytes()
    masrel("analyze", study, *gates, "--junit", junit)
    assert junit.read_bytes() == first
