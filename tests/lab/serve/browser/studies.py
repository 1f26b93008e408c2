"""Studies for browsers: on the real clock, with hands that are quick."""

import tomllib
from pathlib import Path
from typing import Any

import tomli_w

from masrel.lab.conduct import allot_schedules
from masrel.lab.protocol import StudyPaths, copy_template, read_protocol

# A busy machine is late, which is no fault of the pages.
PATIENT = {
    "jump_limit_deg": 5.0,
    "missed_ticks_limit": 100_000,
    "missed_replies_limit": 20,
    "missed_replies_per_100_limit": 100,
    "stale_limit_ms": 50.0,
    "watchdog_ms": 100.0,
    "torque_rate_limit_nm_s": 100_000.0,
    "end_ramp_ms": 20.0,
}
QUICK = {"mean_speed_deg_s": 150.0, "speed_sd_deg_s": 0.0}

OCCASIONS = {
    "instructions": "Stretch the arm once, as fast as you would a patient's.",
    "practice": ["HM1"],
    "break_after": 2,
    "break_minutes": 0.5,
}
REALISM = {
    "id": "realism",
    "title": "How real it felt",
    "when": "session",
    "questions": [
        {
            "id": "score",
            "text": "How real was it?",
            "type": "visual-analogue",
            "low_label": "not at all",
            "high_label": "as a patient",
        },
        {
            "id": "years",
            "text": "How many years have you worked with patients?",
            "type": "whole",
            "low": 0,
            "high": 60,
        },
        {
            "id": "hand",
            "text": "Which hand did you use?",
            "type": "choice",
            "choices": ["right", "left", "both"],
        },
        {
            "id": "remark",
            "text": "What else did you notice?",
            "type": "text",
            "required": False,
        },
    ],
}


def make_study(
    root: Path,
    *,
    template: str = "small",
    n_raters: int = 2,
    n_models: int | None = None,
    **changes: Any,
) -> StudyPaths:
    """Write a study whose schedules are drawn; `changes` are tables of its protocol."""
    paths = StudyPaths(root)
    copy_template(template, root)
    protocol = tomllib.loads(paths.protocol.read_text(encoding="utf-8"))
    protocol["models"] = protocol["models"][:n_models]
    raters = [f"R{number}" for number in range(1, 1 + n_raters)]
    protocol["raters"] = [{"id": rater} for rater in raters]
    protocol["sessions"] = [{"id": "test", "raters": raters}]
    protocol["analysis"]["estimates"] = [
        line
        for line in protocol["analysis"]["estimates"]
        if line["kind"] == "inter-rater" and line["interval"] != "posterior"
    ]
    protocol["device"] |= PATIENT
    protocol["simulated_raters"] |= QUICK
    protocol["stretch"] = {"start_deg": 120.0, "end_deg": 146.0}
    protocol["presentation"] = {"stretches": 1}
    for name, table in changes.items():
        kept = protocol.get(name)
        is_table = isinstance(table, dict) and isinstance(kept, dict)
        protocol[name] = {**kept, **table} if is_table else table
    paths.protocol.write_text(tomli_w.dumps(protocol), encoding="utf-8")
    allot_schedules(paths, read_protocol(paths.protocol))
    return paths
