"""What logs, and opened schedules, say, without masrel: independent.py STUDY."""

import hashlib
import json
import sys
from collections import Counter
from datetime import datetime
from pathlib import Path


def events_of(log: Path) -> list[dict]:
    """Return the events of a log; each line has the hash of the one before."""
    events, before = [], "0" * 64
    for line in log.read_bytes().splitlines():
        event = json.loads(line)
        if event["previous"] != before:
            raise SystemExit(f"{log}: the chain is broken at {line[:80]!r}")
        before = hashlib.sha256(line).hexdigest()
        day = datetime.fromisoformat(event["time_utc"]).astimezone().date()
        named = {"event": event["event"], "day": day.isoformat()}
        events.append(named | event["fields"])
    return events


def session_of(log: Path, models: dict) -> dict:
    """Return what the log of one session says in the end."""
    head, *events = events_of(log)
    place = head["session"], head["rater"]
    grades, firsts, second, held, done = {}, {}, {}, None, None
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
        elif kind in ("held", "day-correction"):
            held = event["on"]
        elif kind == "complete":
            done = event["day"]
    ratings = [
        [*place, code, models[*place, code], grade, firsts.get(code), head["grades"]]
        for code, grade in grades.items()
    ]
    differ = [code for code in second if second[code] != grades[code]]
    return {"ratings": ratings, "day": held or done, "second": [len(second), differ]}


def models_of(schedule: Path) -> dict:
    """Return which model each code of an opened schedule was."""
    lines = schedule.read_text(encoding="utf-8").splitlines()
    head = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# "))
    rows = [line.split(",") for line in lines if line[0].isdigit()]
    return {(head["session"], head["rater"], code): model for _, code, model, _ in rows}


def flat(value: object, *keys: str) -> dict:
    """Return every leaf of a protocol by its keys; entries with ids by these."""
    if isinstance(value, list) and value and isinstance(value[0], dict):
        value = {str(each.get("id", n)): each for n, each in enumerate(value)}
    if not isinstance(value, dict):
        return {".".join(keys): value}
    return {k: v for n, each in value.items() for k, v in flat(each, *keys, n).items()}


def changes_of(versions: list[dict]) -> list:
    """Return the keys of a plan that changed after its first version, with the day."""
    plans = [flat(json.loads(version["protocol"])) for version in versions]
    return [
        [key, old.get(key), new.get(key), version["day"]]
        for old, new, version in zip(plans, plans[1:], versions[1:], strict=False)
        for key in sorted(old.keys() | new.keys())
        if old.get(key) != new.get(key) and "raters" not in key  # who takes part
    ]


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
    logs = [*map(events_of, (root / "conduct").glob("*.jsonl"))]
    events = [event for log in logs for event in log]
    sheets = (root / "sessions").glob("*.jsonl")
    sessions = {log.stem: session_of(log, models) for log in sheets}
    of = lambda kind: [each for each in events if each["event"] == kind]  # noqa: E731
    plan, items = json.loads(of("drawn")[0]["protocol"]), {}
    standards = [each["id"] for each in plan["models"] if each["role"] == "standard"]
    for each in sessions.values():
        for session, _, _, model, grade, *_ in each["ratings"]:
            if session == "test" and model in standards:
                items.setdefault(model, []).append(grade)
    versions = [[e for e in log if e["event"] in ("drawn", "amended")] for log in logs]
    return {
        "sessions": sessions,
        "late": [each["rater"] for each in of("rater-added")],
        "withdrawn": {e["rater"]: e["on"] or e["day"] for e in of("withdrawn")},
        "excluded": [e["rater"] for e in of("excluded")],  # nobody is included again
        "adverse": [e for e in of("noted") if e["kind"] == "adverse-event"],
        "plan": plan,
        "changes": [changes_of(each) for each in versions],
        "fleiss": fleiss([*items.values()]),
    }


if __name__ == "__main__":
    print(json.dumps(main(Path(sys.argv[1]))))
