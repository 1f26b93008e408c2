"""masrel agree --figure: what is drawn, where to, and what is refused."""

from pathlib import Path

import pytest

from tests.architecture.test_imports import loaded_after
from tests.cli.process import Caller

TABLE_V = Path(__file__).parents[2] / "studies/hess2012/ratings/published.csv"
STARTS = {".png": b"\x89PNG\r\n\x1a\n", ".svg": b"<?xml", ".pdf": b"%PDF"}


@pytest.mark.parametrize("suffix", [".png", ".svg", ".PDF"])
def test_the_ending_says_what_is_written_and_one_line_says_where(
    masrel: Caller, tmp_path: Path, suffix: str
) -> None:
    file, again = tmp_path / f"kappa{suffix}", tmp_path / f"again{suffix}"
    done = masrel("agree", TABLE_V, "--target", "items", "--figure", file)
    assert done.code == 0
    assert done.err == f"figure: {file}\n"
    assert file.read_bytes().startswith(STARTS[suffix.lower()])
    masrel("agree", TABLE_V, "--target", "items", "--figure", again)
    assert again.read_bytes() == file.read_bytes()


@pytest.mark.parametrize("draws", [False, True])
def test_only_a_figure_loads_what_draws(tmp_path: Path, draws: bool) -> None:
    figure = ["--figure", str(tmp_path / "kappa.svg")] if draws else []
    call = ["agree", str(TABLE_V), "--target", "items", *figure]
    loaded = loaded_after(f"from masrel.cli import cli\ncli({call!r})")
    assert ("matplotlib" in loaded) == draws


def test_the_figure_says_what_the_table_says(masrel: Caller, tmp_path: Path) -> None:
    file = tmp_path / "all.svg"
    wanted = ("--coefficients", "all", "--target", "both")
    masrel("agree", TABLE_V, *wanted, "--figure", file)
    svg = file.read_text("utf-8")  # in which a comment says what is drawn
    assert "0.626 [0.214, 1.000]" in svg
    assert "intervals for other items and raters" in svg
    assert svg.count("<!-- other items -->") == 3  # of ICC(C,1), ICC(C,k) and W alone
    assert "95 % confidence interval" in svg
    masrel("agree", TABLE_V, *wanted[:3], "items", "--figure", file)
    svg = file.read_text("utf-8")
    assert "95 % credible interval" in svg
    assert "posterior density" in svg
    assert "resamples" not in svg
    assert "SIMULATED" not in svg


def test_the_axis_has_the_population_that_all_intervals_are_for(
    masrel: Caller, tmp_path: Path
) -> None:
    file = tmp_path / "icc.svg"
    call = ("--coefficients", "icc_a1", "--target", "items")
    masrel("agree", TABLE_V, *call, "--figure", file)
    svg = file.read_text("utf-8")
    # the one interval of ICC(A,1) is not for the items that were asked for alone
    assert "intervals for other items and raters" in svg
    assert "<!-- other items and raters -->" not in svg
