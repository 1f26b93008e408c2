"""Figures of a report: all of their data are in them, and nothing is cut off."""

import io
import re
from cProfile import Profile
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from masrel.lab.analysis import Speed, Speeds, SpeedSummary, analyze
from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed, outline
from masrel.lab.protocol import read_protocol, scale_of
from masrel.lab.ratings import read_study_ratings
from masrel.lab.report._document import write_report
from masrel.plots import draw
from masrel.plots._drawn_values import Drawn
from tests.benchmarks.many_ratings import many_ratings

WIDEST_IN = 9.5  # inches of a page of a report

Panel = tuple[Any, ...]


def speeds(n_raters: int) -> Drawn:
    numbers = np.random.default_rng(1).normal(85.0, 10.0, (4, n_raters, 5))
    raters = [f"R{number}" for number in range(n_raters)]
    shared: dict[str, Any] = {"session": "test"}
    values = tuple(
        Speed(model=f"HM{model}", rater=rater, mean_speed_deg_s=value, **shared)
        for model, of_model in enumerate(numbers)
        for rater, of_rater in zip(raters, of_model, strict=True)
        for value in of_rater.tolist()
    )
    shared |= {"n": 2, "mean": 85.0, "sd": 10.0, "least": 60.0, "most": 110.0}
    by_model = tuple(SpeedSummary(name=f"HM{model}", **shared) for model in range(4))
    shown = Speeds(values=values, by_model=by_model, by_rater=(), n_missing=0)
    drawer = "masrel.lab.report._study_figures:speed_figure"
    return Drawn(drawer, (shown, raters, 60.0))


def panel(n_stretches: int, *, has_band: bool, is_graded: bool = False) -> Panel:
    motion = ConstantSpeed(start=0.5, end=2.5, speed=2.0)
    stretch = outline(STANDARD_MODELS["HM1"], motion, n_points=50)
    ends = np.outer(np.arange(1.0, 5.0), stretch.time)
    band = {"time": stretch.time, "angle": ends, "torque": ends}
    lines = "HM1\n50 to 90 deg/s", [stretch] * n_stretches, [is_graded] * n_stretches
    return (*lines, ["R1"] * n_stretches, band) if has_band else (*lines, [], None)


def traces(*panels: Panel, view: str = "time") -> Drawn:
    drawer = "masrel.lab.report._stretch_figures:trace_figure"
    return Drawn(drawer, (panels, view))


CONTENTS: dict[str, Drawn] = {
    "speeds": speeds(2),
    "speeds of many": speeds(200),
    "traces": traces(panel(2, has_band=False)),
    "bands": traces(*(panel(3, has_band=True),) * 2),
    "over the angle": traces(panel(2, has_band=False), view="angle"),
    "small panels": traces(*(panel(3, has_band=True),) * 5, view="small"),
}


def texts_of(svg: bytes) -> list[str]:
    """The texts of a figure, whose letters are paths."""
    return re.findall(r"<!-- (.*?) -->", svg.decode("utf-8"), re.DOTALL)


@pytest.mark.parametrize("name", CONTENTS)
def test_a_figure_fits_its_page_in_the_same_bytes_whatever_a_reader_has_set(
    name: str,
) -> None:
    profile, forms = Profile(), ("png", "svg", "inline")
    files = profile.runcall(draw, CONTENTS[name], stamp="SIMULATED DATA", forms=forms)
    # once of pixels and once of lines, whatever is made of these
    calls = {getattr(of.code, "co_qualname", ""): of for of in profile.getstats()}
    assert calls["Figure.draw"].callcount == 2
    with mpl.rc_context({"font.size": 20.0, "svg.hashsalt": "other"}):
        assert draw(CONTENTS[name], stamp="SIMULATED DATA", forms=forms) == files
    assert texts_of(files["svg"]).count("SIMULATED DATA") == 1
    assert b"<dc:date>" not in files["svg"]
    assert b"Software" not in files["png"]
    image = Image.open(io.BytesIO(files["png"]))
    shown = np.asarray(image)
    edges = (shown[:2], shown[-2:], shown[:, :2], shown[:, -2:])
    assert all((edge == 255).all() for edge in edges)  # nothing is cut off
    size = re.search(rb'width="([\d.]+)pt" height="([\d.]+)pt"|$', files["svg"])
    assert size is not None
    inches = np.array(size.groups(), dtype=float) / 72.0
    assert inches[0] <= WIDEST_IN
    expected = np.divide(image.size, image.info["dpi"])
    np.testing.assert_allclose(inches, expected, atol=0.005)


def test_above_thirty_raters_a_figure_no_longer_grows_with_them() -> None:
    few, many, more = (
        len(draw(speeds(n), stamp="", forms=("svg",))["svg"]) for n in (30, 31, 200)
    )
    assert few > 2 * many
    assert more < 1.05 * many


def test_a_stretch_that_a_grade_rests_on_is_drawn_otherwise() -> None:
    plain, wide = (
        draw(traces(panel(1, has_band=False, is_graded=graded)), stamp="")["svg"]
        for graded in (False, True)
    )
    assert plain.count(b"stroke-width: 1.5") == 2  # of the catch, by time and by angle
    assert wide.count(b"stroke-width: 3.3") == 2


def test_a_small_grid_of_panels_names_what_it_shades() -> None:
    texts = texts_of(draw(CONTENTS["small panels"], stamp="", forms=("svg",))["svg"])
    assert texts.count("R1") == 3 * 5
    assert "middle 90 %" in texts


def report_of(root: Path, n_raters: int, n_models: int, n_repeats: int) -> Path:
    many_ratings(root, n_raters, n_models, n_repeats)
    protocol = read_protocol(root / "protocol.toml")
    file = root / "ratings" / "ratings.csv"
    ratings = read_study_ratings(file, scale_of(protocol))
    return write_report(
        protocol, ratings, analyze(protocol, ratings), root / "report"
    ).html


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
def test_the_page_of_many_raters_shows_a_few_and_the_files_have_all(
    tmp_path: Path,
) -> None:
    page = report_of(tmp_path / "study", 32, 2, 1).read_text(encoding="utf-8")
    folder = tmp_path / "study" / "report" / "tables"
    for name, n_rows, n_columns in (
        ("speeds_by_rater", 32 + 7, 8),
        ("peak_torque", 2, 4 + 32 + 1),
        ("grades_test", 2, 2 + 32 + 1),
    ):
        head, *rows = (folder / f"{name}.csv").read_text(encoding="utf-8").splitlines()
        assert len(rows) == n_rows
        assert head.count(",") + 1 == n_columns
    sessions = (folder / "sessions.csv").read_text(encoding="utf-8")
    assert "R031, R032" in sessions
    assert "R001, R002, …, R032<" in page
    assert "(lower quartile)" in page
    assert ">R017<" not in page


@pytest.mark.slow
def test_a_report_of_ten_thousand_ratings_stays_small(tmp_path: Path) -> None:
    page = report_of(tmp_path / "study", 200, 10, 5)
    assert page.stat().st_size <= 1.5e6
