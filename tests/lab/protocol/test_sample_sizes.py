"""``[[analysis.sample_sizes]]``: of a line of the plan, and no part of older hashes."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from masrel.errors import ProtocolError
from masrel.lab.protocol import presented_hash, protocol_hash, read_protocol
from tests.lab.protocol.documents import VALID, changed, write

PATH = ("analysis", "sample_sizes")
SIZE: dict[str, Any] = {
    "estimate": "kappa",
    "n_items": 30,
    "n_raters": 5,
    "value": 0.6,
    "model": "mixture",
}


def grades() -> int:
    return len(VALID["scale"]["grades"])


def test_a_size_enters_the_hash_of_the_plan_and_of_no_schedule(tmp_path: Path) -> None:
    old = read_protocol(write(VALID, tmp_path))
    new = read_protocol(write(changed(*PATH, to=[SIZE]), tmp_path))
    assert new.analysis.sample_sizes[0].n_items == 30
    assert protocol_hash(new) != protocol_hash(old)
    assert presented_hash(new) == presented_hash(old)
    analysis = msgspec.structs.replace(new.analysis, sample_sizes=())
    assert protocol_hash(msgspec.structs.replace(new, analysis=analysis)) == (
        protocol_hash(old)
    )


@pytest.mark.parametrize(
    ("sizes", "problem"),
    [
        ([{"estimate": "other"}], "sample_sizes[0].estimate: needed an estimate of"),
        ([{}, {}], 'sample_sizes[1].estimate: needed each once, got "kappa" again'),
        ([{"prevalences": [0.5, 0.6]}], "sample_sizes[0].prevalences: needed "),
        ([{"n_items": 1}], "sample_sizes[0].n_items: needed a whole number at least 2"),
        ([{"model": "beta"}], "sample_sizes[0].model: needed one of"),
        ([{"model": "table", "table": []}], "sample_sizes[0].table: needed the joint"),
        ([{"table": [[1.0]]}], 'sample_sizes[0].table: needed model = "table"'),
        ([{"value": 2.0}], "sample_sizes[0].value: needed a number at least -1"),
        ([{"assurance": 80}], "sample_sizes[0].assurance: needed a number at least 0"),
    ],
)
def test_a_problem_names_its_key(
    tmp_path: Path, sizes: list[dict[str, Any]], problem: str
) -> None:
    made = [{**SIZE, **size} for size in sizes]
    with pytest.raises(ProtocolError) as error:
        read_protocol(write(changed(*PATH, to=made), tmp_path))
    assert f"analysis.{problem}" in str(error.value)


def test_shares_are_of_the_grades_and_sum_to_one(tmp_path: Path) -> None:
    wrong = [1.0 / grades()] * (grades() - 1) + [0.9]
    made = [{**SIZE, "prevalences": wrong}]
    with pytest.raises(ProtocolError, match="needed numbers with sum 1, got sum"):
        read_protocol(write(changed(*PATH, to=made), tmp_path))
