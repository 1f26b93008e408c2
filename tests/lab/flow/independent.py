"""What logs, and opened schedules, say, without masrel: independent.py STUDY."""

import hashlib
import json
import sys
from collections import Counter
from pathlib import Path


def events_of(log: Path) -> list[dict]:
    """Return the events of a log; each line has the hash of the one before."""
    events, before = [], "0" * 64
    for line in log.read_bytes().splitlines():
        event = json.loads(line)
        if event["previous"] != before:
            raise SystemExit(f"{log}: the chain is broken at {line[:80]!r}")
        before = hashlib.sha256(line).hexdigest()
        events.append({"event": event["event"]} | event["fields"])
    return events


def session_of(log: Path, models: dict) -> dict:
    """Return what the log of one session says in the end."""
    head, *events = events_of(log)
    place = head["session"], head["rater"]
    grades, firsts, second = {}, {}, {}
    for event in events:
        kind, code = event["event"], event.get("code")
        if kind in ("grade", "entered"):
            grades[code] = firsts[code] = event["grade"]
        elif kind == "correction":
            grades[code] = event["grade"]
        elif kind == "skipped":
            grades.setdefault(code, None)
        elif kind == "reentered" and event["column"] == "grade":
            second[code] = event["value"]
    ratings = [
        [*place, code, models[*place, code], grade, firsts.get(code), head["grades"]]
        for code, grade in grades.items()
    ]
    differ = [code for code in second if second[code] != grades[code]]
    return {"ratings": ratings, "second": [len(second), differ]}


def models_of(schedule: Path) -> dict:
    """Return which model each code of an opened schedule was."""
    lines = schedule.read_text(encoding="utf-8").splitlines()
    head = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# "))
    rows = [line.split(",") for line in lines if line[0].isdigit()]
    return {(head["session"], head["rater"], code): model for _, code, model, _ in rows}


def fleiss(table: list[list[str]]) -> list:
    """Return Fleiss' kappa of complete items, and how many pairs it compares."""
    n_raters, counts = len(table[0]), [Counter(row) for row in table]
    n_pairs = len(table) * n_raters * (n_raters - 1) // 2
    agreeing = sum(n * (n - 1) for of in counts for n in of.values()) / 2
    shares = [n / len(table) / n_raters for n in sum(counts, Counter()).values()]
    chance = sum(share**2 for share in shares)
    return [(agreeing / n_pairs - chance) / (1 - chance), n_pairs]


def main(root: Path) -> dict:
    """Return all that the logs say, to be held against what masrel says."""
    opened = (root / "schedules/opened").glob("*.csv")
    models = {code: of for each in opened for code, of in models_of(each).items()}
    events = [e for log in (root / "conduct").glob("*.jsonl") for e in events_of(log)]
    sheets = (root / "sessions").glob("*.jsonl")
    sessions = {log.stem: session_of(log, models) for log in sheets}
    plan = next(e["protocol"] for e in events if e["event"] == "drawn")
    roles, items = {m["id"]: m["role"] for m in json.loads(plan)["models"]}, {}
    for each in sessions.values():
        for session, _, _, model, grade, *_ in each["ratings"]:
            if session == "test" and roles[model] == "standard":
                items.setdefault(model, []).append(grade)
    return {"sessions": sessions, "fleiss": fleiss([*items.values()])}


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]))))
