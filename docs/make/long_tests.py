"""The page of the last run by hand of every slow and long test.

``python -m docs.make.long_tests JUNIT_XML`` writes the tests and the counts of
injected faults beside ``docs/evidence/long_tests.md``; ``python -m tests.mutants``
writes the deliberate faults.
"""

import csv
import subprocess
import sys
from collections import defaultdict
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

from docs.make.evidence import EVIDENCE, table, write_part, write_rows

PAGE = EVIDENCE / "long_tests.md"
DELIBERATE = EVIDENCE / "long_tests_deliberate.csv"


def write_tests(junit: Path) -> None:
    """Write a row per file of tests; on the page, when it was and of which commit."""
    # The file is pytest's own, written a moment ago.
    counts: dict[str, list[float]] = defaultdict(lambda: [0, 0, 0.0])
    for case in ElementTree.parse(junit).iter("testcase"):
        count = counts[case.attrib["classname"]]
        failed = case.find("failure") is not None or case.find("error") is not None
        count[0 if not failed else 1] += case.find("skipped") is None
        count[2] += float(case.attrib["time"])
    head = ("passed", "failed", "seconds")
    rows = [
        {"tests": name, **dict(zip(head, map(round, count), strict=True))}
        for name, count in sorted(counts.items())
    ]
    write_rows("long_tests", rows)
    passed, failed, seconds = (
        round(sum(of)) for of in zip(*counts.values(), strict=True)
    )
    text = f"`.ci/long` ran {_when()}: {passed} passed, {failed} failed, {seconds} s."
    write_part(PAGE, "tests", text)


def write_faults(junit: Path) -> str:
    """Write the counts of injected faults and return them as a table."""
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for entry in ElementTree.parse(junit).iter("property"):
        if entry.attrib["name"] == "faults":
            kind, injected, survived = entry.attrib["value"].split("|")
            counts[kind][0] += int(injected)
            counts[kind][1] += int(survived)
    head = ("fault", "injected", "survived")
    rows = [(kind, *count) for kind, count in sorted(counts.items())]
    write_rows(
        "long_tests_injected", [dict(zip(head, row, strict=True)) for row in rows]
    )
    survived, injected = (sum(row[k] for row in rows) for k in (2, 1))
    text = f"`python -m tests.faults` ran {_when()}: {survived} of {injected} survived."
    write_part(PAGE, "injected", text)
    return table(head, rows) + "\n"


def write_mutants(
    results: dict[str, tuple[str, str, float]], names: Sequence[str]
) -> str:
    """Write tests, result and processor time of faults; return how many were killed.

    The rows of other faults of these names stay as they are.
    """
    with DELIBERATE.open(encoding="utf-8", newline="") as file:
        rows: dict[str, dict[str, object]] = {
            r["fault"]: r for r in csv.DictReader(file)
        }
    for name, (tests, result, seconds) in results.items():
        rows[name] = {"fault": name, "tests": tests, "result": result}
        rows[name] |= {"seconds": round(seconds), "run": _when()}
    kept = [rows[name] for name in names if name in rows]
    write_rows(DELIBERATE.stem, kept)
    n_killed, n_left = (
        sum(r["result"] == "killed" for r in kept),
        len(names) - len(kept),
    )
    text = f"{n_killed} of {len(names)} killed, {n_left} not run since they were added."
    write_part(PAGE, "deliberate", text)
    return text


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
