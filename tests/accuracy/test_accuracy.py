"""The program that compares packages, on a few small cases."""

import subprocess
import sys
from pathlib import Path

import pytest

from docs.make.accuracy.__main__ import Line, compare, off, parts
from docs.make.accuracy.figure import draw
from docs.make.accuracy.page import page
from docs.make.accuracy.peers import Answer, ask
from tests.accuracy.cases import DEGENERATE, ORDINARY
from tests.accuracy.exactness import relative


@pytest.fixture(scope="module")
def lines() -> list[Line]:
    return [
        compare(*part, ["statsmodels"])
        for case in (ORDINARY[1], *DEGENERATE)
        for part in parts(case)
    ]


def test_the_page_has_a_row_for_every_coefficient_of_a_case(lines: list[Line]) -> None:
    text = page(lines, {"masrel": "0"})
    cases = text.split("## Case by case")[1]
    rows = [row for row in cases.splitlines() if row.startswith("|")]
    assert len(rows) == len(lines) + 2 * 2  # two groups, each with a head and a bar
    assert "$" not in text


def test_the_figure_is_drawn(lines: list[Line], tmp_path: Path) -> None:
    draw(lines, tmp_path / "accuracy.png")
    assert (tmp_path / "accuracy.png").stat().st_size > 10_000


def test_nothing_that_is_undefined_has_an_error(lines: list[Line]) -> None:
    undefined = [line for line in lines if line.true.value is None]
    assert undefined
    for line in undefined:
        assert line.values["masrel"].note == "nan"
        assert line.has_reason


def test_a_peer_is_held_to_what_it_offers() -> None:
    of_pairs, rated = ORDINARY[1], ORDINARY[0]
    cohen = ask("statsmodels", of_pairs, "cohen_kappa", "identity")
    assert cohen.value == pytest.approx(0.4, rel=1e-15)
    assert cohen.over_n
    nothing = ask("statsmodels", rated, "gwet_ac", "identity")
    assert nothing == Answer(note="not offered")
    gaps = next(case for case in DEGENERATE if case.name == "an item without ratings")
    assert ask("statsmodels", gaps, "fleiss_kappa", "identity").note == (
        "crash: AssertionError"
    )


def test_a_standard_error_over_n_is_compared_with_one_over_n() -> None:
    line = compare(ORDINARY[1], "cohen_kappa", "identity", ["statsmodels"])
    assert line.errors["statsmodels"].relative < 1e-15
    over_n = ask("statsmodels", ORDINARY[1], "cohen_kappa", "identity")
    assert over_n.standard_error is not None
    # √(49/50) of the one over n - 1
    apart = relative(over_n.standard_error, line.true.standard_error)
    assert apart == pytest.approx(1 - 0.98**0.5)


def test_in_place_of_zero_there_are_no_units() -> None:
    assert off(1e-17, 0).absolute == 1e-17
    assert off(0.0, 0).absolute == 0


def test_peers_are_imported_when_they_are_asked() -> None:
    names = ("statsmodels", "irrCAC", "sklearn", "krippendorff", "matplotlib")
    check = (
        "import sys, docs.make.accuracy.__main__\n"
        f"assert not {{*{names}}} & {{name.split('.')[0] for name in sys.modules}}"
    )
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", check], cwd=root, check=True)
