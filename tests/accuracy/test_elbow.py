"""The section about the joint model, from a few scenes."""

from pathlib import Path

import numpy as np
import pytest
from tqdm import tqdm

from docs.make.accuracy import elbow
from tests.lab.elbow.exactness import errors
from tests.lab.elbow.scenes import corner_cases


@pytest.fixture(scope="module")
def text() -> str:
    with tqdm(disable=True) as bar:
        random = {
            (kind, False): elbow.solved(kind, wide=False, n_seeds=3, bar=bar)
            for kind in ("constant", "minimum jerk")
        }
    name = "very fast"
    scene = corner_cases()[name]
    return elbow.section(random, {name: errors(*scene, np.random.default_rng(5))})


def test_the_section_has_a_row_for_every_kind_and_case(text: str) -> None:
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == (2 + 2) + (2 + 1)  # each table with a head and a bar
    assert "Of 6 random scenes and 1 built ones, all are within" in text


def test_the_section_is_kept_where_it_stands(text: str, tmp_path: Path) -> None:
    page = tmp_path / "accuracy.md"
    assert elbow.written_section(page) == ""
    page.write_text("# Accuracy\n\nOther things.\n", encoding="utf-8")
    assert elbow.written_section(page) == ""
    page.write_text("# Accuracy\n\nOther things.\n" + text, encoding="utf-8")
    assert elbow.written_section(page) == text


def test_the_page_holds_the_section() -> None:
    assert "python -m docs.make.accuracy.elbow" in elbow.written_section(elbow.PAGE)
