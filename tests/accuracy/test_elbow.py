"""The section about the joint model, from a few scenes."""

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


def test_the_page_holds_the_section() -> None:
    assert "python -m docs.make.accuracy.elbow" in elbow.written_section(elbow.PAGE)
