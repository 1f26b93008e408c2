"""Files as other programs leave them are read right, warned of, or refused.

The expected values were computed with exact fractions, without masrel.
"""

import json
import re
import unicodedata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from tests.cli.process import Caller, Done

DOOR = Path(__file__).parent / "door"
CASES = json.loads((DOOR / "cases.json").read_text(encoding="utf-8"))["cases"]
NEEDS = {".xlsx": "python_calamine", ".parquet": "pyarrow"}
ICC = {"ICC(A,1)": "icc_a1", "ICC(C,1)": "icc_c1"}


def plain(name: object) -> str:
    return unicodedata.normalize("NFC", str(name)).strip()


def by_value(grades: dict[str, int]) -> dict[object, int]:
    def key(grade: str) -> object:
        try:
            return float(grade)
        except ValueError:
            return plain(grade)

    return {key(grade): n for grade, n in grades.items()}


def estimates_agree(expected: dict[str, Any], estimates: list[dict[str, Any]]) -> bool:
    by_name = {}
    for estimate in estimates:
        name = estimate["coefficient"]
        by_name[ICC.get(estimate["weights"], name)] = estimate
    coefficients = expected["coefficients"]
    first = by_name[next(iter(coefficients))]
    first = by_name.get("percent_agreement", first)
    return all(
        by_name[name]["value"] == (None if v is None else pytest.approx(v, abs=1e-9))
        for name, v in coefficients.items()
    ) and all(
        first[count] == expected[count]
        for count in ("n_items", "n_raters")
        if count in expected
    )


def is_answered(expected: dict[str, Any], done: Done) -> bool:
    if done.code != 0:
        return False
    document = json.loads(done.out)
    read, estimates = document["read"], document["estimates"]
    if "groups" in expected:
        return all(
            estimates_agree(
                of_group, [e for e in estimates if group in map(str, e.values())]
            )
            for group, of_group in expected["groups"].items()
        )
    return (
        estimates_agree(expected, estimates)
        and read["n_missing"] == expected.get("n_missing", read["n_missing"])
        and by_value(read["grades"]) == by_value(expected.get("grades", read["grades"]))
        and sorted(map(plain, read["raters"]))
        == sorted(map(plain, expected.get("raters", read["raters"])))
    )


def outcomes(case: dict[str, Any], done: Done) -> list[bool]:
    """Whether each of the outcomes that a case allows, or needs, is that of a call."""
    message = done.err.replace(case["file"], "FILE")

    def is_there(regex: str) -> bool:
        return re.search(regex, message, re.IGNORECASE | re.MULTILINE) is not None

    held = []
    if "expected" in case:
        held.append(is_answered(case["expected"], done))
    if "expected_warning" in case:
        held.append(done.code == 0 and all(map(is_there, case["expected_warning"])))
    if "expected_refusal" in case:
        is_one_line = len(message.splitlines()) == 1
        held.append(
            done.code == 2
            and is_one_line
            and all(map(is_there, case["expected_refusal"]))
        )
    assert held, "the case expects nothing"
    return held


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_files_of_other_programs(case: dict[str, Any], masrel: Caller) -> None:
    file = DOOR / "files" / case["file"]
    module = NEEDS.get(file.suffix)
    if module is not None and find_spec(module) is None:
        pytest.skip(f"{module} is not installed")
    options = list(case["options"])
    expected = case.get("expected", {})
    expected = next(iter(expected.get("groups", {"": expected}).values()))
    if "coefficients" in expected and "--coefficients" not in options:
        options += ["--coefficients", ",".join(expected["coefficients"])]
    done = masrel("agree", file, *options, "--json", "-")
    held = outcomes(case, done)
    assert any(held) if case.get("either") else all(held), done


def test_the_judge_can_fail() -> None:
    case = {"file": "a.csv", "expected_refusal": ["--item"], "expected_warning": ["x"]}
    refused = Done(code=2, out="", err="masrel: a.csv: --item names it\n")
    assert outcomes(case, refused) == [False, True]
    two_lines = Done(code=2, out="", err="masrel: --item\nmore\n")
    assert outcomes(case, two_lines) == [False, False]
    done = Done(
        code=0,
        out=json.dumps(
            {
                "estimates": [
                    {"coefficient": "fleiss_kappa", "weights": "identity", "value": 0.5}
                ],
                "read": {"n_missing": 0, "grades": {"1": 2}, "raters": ["A"]},
            }
        ),
        err="",
    )
    right = {"coefficients": {"fleiss_kappa": 0.5}, "grades": {"1.0": 2}}
    assert is_answered(right, done)
    assert not is_answered({**right, "raters": ["B"]}, done)
    assert not is_answered({"coefficients": {"fleiss_kappa": 0.4}}, done)
