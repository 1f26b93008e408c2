"""Rules across keys of a protocol: each mistake one sentence with file and key."""

from pathlib import Path
from typing import Any

import pytest

from masrel.lab.protocol import protocol_hash, read_protocol
from tests.files import edit
from tests.lab.protocol.documents import VALID, changed, problems_of, write

OCCASIONS = [
    (
        {"practice": ["HM1", "HM9"]},
        'practice[1]: needed a model of [[models]] (HM1, D1), got "HM9"',
    ),
    (
        {"break_after": 2},
        "break_after: needed fewer than the 2 presentations of a session, as no "
        "break comes after the last, got 2",
    ),
    (
        {"break_after": 0},
        "break_after: needed a whole number at least 1, got 0",
    ),
    (
        {"break_minutes": 3.0},
        "break_minutes: needed with occasions.break_after only, got 3",
    ),
    (
        {"resume": "never"},
        'resume: needed one of "always", "ask", "restart", "same-day", got "never"',
    ),
]

SESSIONS = [
    (
        {"after": "later"},
        "after: needed another session of [[sessions]] (test, retest), got "
        '"later" (id "retest")',
    ),
    (
        {"after": "retest"},
        "after: needed a session that does not come after this one, got "
        '"retest" (id "retest")',
    ),
    (
        {"after": "test", "at_least_days": 9, "at_most_days": 7},
        'at_least_days: needed at most at_most_days (7), got 9 (id "retest")',
    ),
    (
        {"at_least_days": 9},
        'at_least_days: needed with after only, got it alone (id "retest")',
    ),
]

WHOLE = {"id": "score", "text": "How real?", "type": "whole", "low": 1, "high": 10}
QUESTIONS = [
    ({"low": 10, "high": 1}, "low: needed less than high (1), got 10"),
    ({"high": None}, 'high: needed a whole number for type "whole", got none'),
    (
        {"type": "text", "low": None},
        'high: needed for type "whole" only, got 10 for type "text"',
    ),
    (
        {"type": "choice", "low": None, "high": None},
        "choices: needed at least 2 texts, got an array of 0",
    ),
    (
        {"type": "choice", "low": None, "high": None, "choices": ["a", "a"]},
        'choices[1]: needed choices that differ, got "a" again',
    ),
    (
        {"choices": ["a", "b"]},
        'choices: needed for type "choice" only, got them for type "whole"',
    ),
    (
        {"type": "text", "low": None, "high": None, "low_label": "x"},
        'low_label: needed for type "whole" or "visual-analogue" only, got it for '
        'type "text"',
    ),
]

STRETCHES = (
    'needed "free" or a whole number at least 1 and at most 100 or an array of 1 to '
    '100 entries, each one of "fast", "slow"'
)
PRESENTATION = [
    ({"stretches": 0}, f"stretches: {STRETCHES}, got 0"),
    ({"stretches": -2}, f"stretches: {STRETCHES}, got -2"),
    ({"stretches": 1.5}, f"stretches: {STRETCHES}, got 1.5"),
    ({"stretches": True}, f"stretches: {STRETCHES}, got true"),
    ({"stretches": "many"}, f'stretches: {STRETCHES}, got "many"'),
    (
        {"stretches": []},
        "stretches: needed an array of 1 to 100 entries, each one of "
        '"fast", "slow", got an array of 0',
    ),
    (
        {"stretches": ["slow", "brisk"]},
        'stretches[1]: needed one of "fast", "slow", got "brisk"',
    ),
    (
        {"stretches": "free", "time_limit_s": -1.0},
        "time_limit_s: needed a number above 0 and at most 3600, got -1.0",
    ),
    (
        {"stretches": "free", "stretch_limit_s": 0.0},
        "stretch_limit_s: needed a number above 0 and at most 600, got 0.0",
    ),
    (
        {"stretches": 2, "done_with": "voice"},
        'done_with: needed one of "button", "enter", got "voice"',
    ),
    (
        {"time_limit_s": 30.0},
        "time_limit_s: needed with presentation.stretches other than 1 only, got 30.0",
    ),
    (
        {"stretches": ["slow"], "stretch_limit_s": 5.0},
        "slow_speed_deg_s: needed a stretch of 116 deg within "
        "presentation.stretch_limit_s (5), got 10",
    ),
    (
        {"stretches": ["fast"], "fast_speed_deg_s": 140.0},
        "fast_speed_deg_s: needed at most stretch.largest_speed_deg_s (131), got 140",
    ),
    (
        {"stretches": ["slow", "fast"], "slow_speed_deg_s": 120.0},
        "slow_speed_deg_s: needed less than presentation.fast_speed_deg_s (120), "
        "got 120",
    ),
    ({"pause_s": 1.0}, "pause_s: needed a known key"),
]

FIELDS: dict[str, Any] = {
    "profession": {"type": "choice", "choices": ["PT", "MD"], "public": True},
    "years": {"type": "whole", "title": "Experience", "unit": "years"},
    "height_m": {"type": "number", "unit": "m"},
    "since": {"type": "date"},
    "clinic": {"type": "text"},
}
VALUES = [
    ("age", 40, "needed a field of [rater_fields] (profession, years, height_m,"),
    ("profession", "MSc", 'needed one of "PT", "MD", got "MSc"'),
    ("years", 1.5, "needed a whole number, got 1.5"),
    ("years", True, "needed a whole number, got true"),
    ("years", 2**63, "needed a whole number, got 9223372036854775808"),
    ("height_m", "2", 'needed a number, got "2"'),
    ("since", "3.2.2001", 'needed a date, YYYY-MM-DD, got "3.2.2001"'),
    ("since", "20010203", 'needed a date, YYYY-MM-DD, got "20010203"'),
    ("clinic", " ", 'needed text that is not empty (in quotes), got " "'),
    ("clinic", ["a"], "needed text that is not empty (in quotes), got an array"),
]
DECLARATIONS = [
    ("Years", {"type": "whole"}, "Years: needed a name of 1 to 32 small letters"),
    ("status", {"type": "text"}, "status: needed a name of"),
    ("x", {"type": "choice"}, "x.choices: needed at least 2"),
    ("x", {"type": "choice", "choices": ["a", "a"]}, "x.choices: needed at least 2"),
    (
        "x",
        {"type": "text", "choices": ["a", "b"]},
        'x.choices: needed for type "choice" only',
    ),
    ("x", {"type": "date", "unit": "d"}, "x.unit: needed for numbers"),
    ("x", {"type": "years"}, 'x.type: needed one of "choice"'),
    ("x", {}, "x.type: needed one of"),
]

SIZE: dict[str, Any] = {
    "estimate": "kappa",
    "n_items": 30,
    "n_raters": 5,
    "value": 0.6,
    "model": "mixture",
}
SIZES = [
    ([{"estimate": "other"}], "sample_sizes[0].estimate: needed an estimate of"),
    ([{}, {}], 'sample_sizes[1].estimate: needed each once, got "kappa" again'),
    ([{"prevalences": [0.5, 0.5]}], "sample_sizes[0].prevalences: needed one of each"),
    ([{"n_items": 1}], "sample_sizes[0].n_items: needed a whole number at least 2"),
    ([{"model": "beta"}], "sample_sizes[0].model: needed one of"),
    ([{"model": "table", "table": []}], "sample_sizes[0].table: needed the joint"),
    ([{"table": [[1 / 16] * 4] * 4}], 'sample_sizes[0].table: needed model = "table"'),
    ([{"value": 2.0}], "sample_sizes[0].value: needed a number at least -1"),
    ([{"assurance": 80}], "sample_sizes[0].assurance: needed a number at least 0"),
    (
        [{"prevalences": [0.25, 0.25, 0.25, 0.9]}],
        "sample_sizes[0].prevalences: needed numbers with sum 1, got sum 1.65",
    ),
]


JUDGE: dict[str, Any] = {
    "id": "machine",
    "judge": "R3",
    "session": "test",
    "epsilon": 0.2,
    "min_items": 2,
}
JUDGES = [
    ({"humans": ["R1"]}, "judges[0].humans: needed two raters of the session or more"),
    ({"humans": ["R1", "R3"]}, "judges[0].humans: needed two raters of the session"),
    ({"id": "kappa"}, 'judges[0].id: "kappa" is also an estimate of'),
    ({"judge": "R4"}, "judges[0].judge: needed a rater of the session (R1, R2, R3)"),
    ({"session": "pre", "humans": ["R1", "R2"]}, "judges[0].session: needed a session"),
    ({"min_items": 3}, "judges[0].min_items: needed at most 2"),
    ({"epsilon": 2}, "judges[0].epsilon: needed a number at least 0"),
]


def with_judge(keys: dict[str, Any]) -> dict[str, Any]:
    document = changed("analysis", "judges", to=[JUDGE | keys])
    document["raters"].append({"id": "R3"})
    document["sessions"][0]["raters"].append("R3")
    return document


def cases() -> list[tuple[dict[str, Any], str]]:
    """Protocols with one mistake each, and how its sentence begins."""
    every = [
        (changed("occasions", to=table), f"occasions.{problem}")
        for table, problem in OCCASIONS
    ]
    every += [
        (
            changed("sessions", 1, to=VALID["sessions"][1] | keys),
            f"sessions[1].{problem}",
        )
        for keys, problem in SESSIONS
    ]
    for keys, problem in QUESTIONS:
        question = {key: v for key, v in (WHOLE | keys).items() if v is not None}
        asked = {"id": "q", "title": "Q", "when": "session", "questions": [question]}
        document = changed("questionnaires", to=[asked])
        every.append((document, f"questionnaires[0].questions[0].{problem}"))
    every += [
        (changed("presentation", to=table), f"presentation.{problem}")
        for table, problem in PRESENTATION
    ]
    every += [
        (with_values({name: value}), f"raters[0].fields.{name}: {reason}")
        for name, value, reason in VALUES
    ]
    every += [
        (changed("rater_fields", to={name: field}), f"rater_fields.{reason}")
        for name, field, reason in DECLARATIONS
    ]
    every += [
        (
            changed("analysis", "sample_sizes", to=[SIZE | size for size in sizes]),
            f"analysis.{problem}",
        )
        for sizes, problem in SIZES
    ]
    every += [(with_judge(keys), f"analysis.{problem}") for keys, problem in JUDGES]
    every += [
        (
            changed("report", "gates", to=[{"require": "kappa.n >= 5", "why": why}]),
            "report.gates[0].why: needed one line without control",
        )
        for why in ("odd \u0001 sign", "two\nlines")
    ]
    return every


def with_values(values: dict[str, Any]) -> dict[str, Any]:
    return changed("raters", 0, "fields", to=values) | {"rater_fields": FIELDS}


@pytest.mark.parametrize(("document", "problem"), cases())
def test_what_is_wrong_is_said_once(
    document: dict[str, Any], problem: str, tmp_path: Path
) -> None:
    (said,) = problems_of(document, tmp_path)
    assert said.startswith(problem)
    if said.startswith(("raters", "sessions")):
        assert "(id " in said


def test_a_date_stands_with_or_without_quotes(tmp_path: Path) -> None:
    path = write(with_values({"since": "2001-02-03"}), tmp_path)
    quoted = read_protocol(path)
    edit(path, '"2001-02-03"', "2001-02-03")
    assert protocol_hash(read_protocol(path)) == protocol_hash(quoted)
