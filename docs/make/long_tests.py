"""The page of the last run by hand of every slow and long test.

``python -m docs.make.long_tests JUNIT_XML`` writes the table of tests on
``docs/evidence/long_tests.md`` and the counts of injected faults;
``python -m tests.mutants`` writes the table of deliberate faults.
"""

import subprocess
import sys
from collections import defaultdict
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

PAGE = Path(__file__).parents[1] / "evidence" / "long_tests.md"
RECORD = Path(__file__).parents[1] / "evidence" / "record.md"
TESTS = "<!-- table of tests -->\n", "<!-- end of the tests -->\n"
FAULTS = "<!-- counts of faults -->\n", "<!-- end of the counts -->\n"
MUTANTS = "<!-- deliberate faults -->\n", "<!-- end of the deliberate faults -->\n"


def write_tests(junit: Path) -> None:
    """Write when it was, of which commit, and a row a file of tests."""
    # The file is pytest's own, written a moment ago.
    rows: dict[str, list[float]] = defaultdict(lambda: [0, 0, 0.0])
    for case in ElementTree.parse(junit).iter("testcase"):
        row = rows[case.attrib["classname"]]
        failed = case.find("failure") is not None or case.find("error") is not None
        row[0 if not failed else 1] += case.find("skipped") is None
        row[2] += float(case.attrib["time"])
    lines = [
        f"`.ci/long` {_when()}. Of a count that the docs name `.ci/run` holds a seeded "
        "part; here it is whole.",
        "",
        "| tests | passed | failed | seconds |",
        "|---|---|---|---|",
    ]
    for name, (passed, failed, seconds) in sorted(rows.items()):
        lines.append(f"| `{name}` | {passed:g} | {failed:g} | {seconds:.0f} |")
    _put(PAGE, TESTS, "\n".join(lines) + "\n")


def write_faults(junit: Path) -> str:
    """Write the counts of injected faults and return them."""
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for entry in ElementTree.parse(junit).iter("property"):
        if entry.attrib["name"] == "faults":
            kind, injected, survived = entry.attrib["value"].split("|")
            counts[kind][0] += int(injected)
            counts[kind][1] += int(survived)
    lines = ["| fault | injected | survived |", "|---|---|---|"]
    lines += [f"| {kind} | {n} | {m} |" for kind, (n, m) in sorted(counts.items())]
    table = "\n".join(lines) + "\n"
    when = f"`python -m tests.faults`, which `.ci/long` runs too, {_when()}:\n\n"
    _put(PAGE, FAULTS, when + table)
    return table


def write_mutants(
    results: dict[str, tuple[str, str, float]], names: Sequence[str]
) -> str:
    """Write tests, result and processor time of faults; return how many were killed.

    The rows of other faults of these names stay as they are.
    """
    _, table, _ = _parts(PAGE, MUTANTS)
    rows = {line.split(" | ")[0][2:]: line for line in table.splitlines()[4:]}
    when = _when()
    for name, (tests, result, seconds) in results.items():
        rows[name] = f"| {name} | `{tests}` | {result} | {seconds:.0f} | {when} |"
    lines = [rows[name] for name in names if name in rows]
    killed = f"{sum(' | killed | ' in line for line in lines)} of {len(names)} killed."
    head = [
        "| fault | tests | result | processor time, s | run |",
        "|---|---|---|---|---|",
    ]
    _put(PAGE, MUTANTS, "\n".join([killed, "", *head, *lines]) + "\n")
    return killed


def _parts(file: Path, marks: tuple[str, str]) -> tuple[str, str, str]:
    """Split a page into what stands before the marks, between them, and after."""
    before, _, rest = file.read_text(encoding="utf-8").partition(marks[0])
    between, _, after = rest.partition(marks[1])
    return before, between, after


def _put(file: Path, marks: tuple[str, str], text: str) -> None:
    before, _, after = _parts(file, marks)
    page = f"{before}{marks[0]}{text}{marks[1]}{after}"
    file.write_text(page, encoding="utf-8")


def _when() -> str:
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    return f"on {datetime.now(UTC):%Y-%m-%d}, at commit {commit}"


if __name__ == "__main__":
    write_tests(Path(sys.argv[1]))
    write_faults(Path(sys.argv[1]))
