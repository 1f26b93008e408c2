"""The page of the last run by hand of every slow and long test.

``python -m docs.make.long_tests JUNIT_XML`` writes ``docs/long_tests.md``, and the
counts of injected faults into ``docs/record.md``.
"""

import subprocess
import sys
from collections import defaultdict
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

PAGE = Path(__file__).parents[1] / "long_tests.md"
RECORD = Path(__file__).parents[1] / "record.md"
BEGIN, END = "<!-- counts of faults -->\n", "<!-- end of the counts -->\n"


def page(junit: Path) -> str:
    """Return the page: when, of which commit, and a row a file of tests."""
    # The file is pytest's own, written a moment ago.
    rows: dict[str, list[float]] = defaultdict(lambda: [0, 0, 0.0])
    for case in ElementTree.parse(junit).iter("testcase"):
        row = rows[case.attrib["classname"]]
        failed = case.find("failure") is not None or case.find("error") is not None
        row[0 if not failed else 1] += case.find("skipped") is None
        row[2] += float(case.attrib["time"])
    lines = [
        "# The last run of the long tests",
        "",
        f"`.ci/long` {_when()}. Of a count that the docs name `.ci/run` holds a seeded "
        "part; here it is whole.",
        "",
        "| tests | passed | failed | seconds |",
        "|---|---|---|---|",
    ]
    for name, (passed, failed, seconds) in sorted(rows.items()):
        lines.append(f"| `{name}` | {passed:g} | {failed:g} | {seconds:.0f} |")
    lines += ["", "## Faults injected", "", BEGIN + END]
    return "\n".join(lines)


def write_faults(junit: Path) -> str:
    """Write the counts of injected faults into both pages, and return them."""
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
    _put(PAGE, when + table)
    _put(RECORD, table)
    return table


def _put(file: Path, text: str) -> None:
    before, _, rest = file.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    file.write_text(f"{before}{BEGIN}{text}{END}{after}", encoding="utf-8")


def _when() -> str:
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    return f"on {datetime.now(UTC):%Y-%m-%d}, at commit {commit}"


if __name__ == "__main__":
    PAGE.write_text(page(Path(sys.argv[1])), encoding="utf-8")
    write_faults(Path(sys.argv[1]))
