"""Figures and pages of many raters, stretches and models: counted, not timed."""

import io
import os
import re
import subprocess
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from PIL import Image

from masrel.lab.analysis import analyze
from masrel.lab.protocol import read_protocol
from masrel.lab.ratings import read_study_ratings
from masrel.lab.report import write_report
from masrel.lab.report._figure_data import (
    GradeCounts,
    GradeGrid,
    SpeedColumn,
    SpeedDots,
    TraceBand,
    TraceColumns,
    TracePanel,
)
from masrel.plots import draw
from masrel.plots._drawn_values import Content, Form
from masrel.plots._style import STYLE
from tests.benchmarks.many_ratings import many_ratings
from tests.lab.internal.report.test_figures import DRAWINGS

ROOT = Path(__file__).parents[4]
LONG = "Anna-Katharina Freifrau von und zu Hohenstein-Ardeck"
WIDEST_IN = 9.5  # inches of a page of a report


def drawn(content: Content) -> tuple[Figure, dict[Form, bytes]]:
    """The figure as it was drawn, and its files."""
    figures: list[Figure] = []
    plain = Figure.draw

    def noted(figure: Figure, renderer: object) -> None:
        figures.append(figure)
        plain(figure, renderer)  # type: ignore[arg-type]

    with mock.patch.object(Figure, "draw", noted):
        files = draw(content, stamp="SIMULATED DATA")
    (figure,) = set(figures)
    return figure, files


def n_artists(figure: Figure) -> int:
    return len(figure.findobj(Artist))


def speeds(n_raters: int) -> SpeedDots:
    numbers = np.random.default_rng(1).normal(85.0, 10.0, (4, n_raters, 5))
    columns = tuple(
        SpeedColumn(
            model=f"HM{model}",
            session="test",
            speeds=tuple(map(tuple, of_model.tolist())),
            mean=85.0,
        )
        for model, of_model in enumerate(numbers)
    )
    raters = tuple(f"R{number}" for number in range(n_raters))
    return SpeedDots(columns=columns, raters=raters, slowest=60.0)


def traces(n_panels: int, n_stretches: int, *, has_angle: bool) -> TraceColumns:
    time = np.linspace(0.0, 1.0, 50)
    phase = np.repeat([0, 1, 2], [20, 20, 10])
    stretch = (time, 30 + 100 * time, 5 * time, phase)
    ends = np.outer(np.arange(1.0, 5.0), time)
    band = TraceBand(
        time=time, angle=ends, torque=ends, shares=(0.05, 0.25, 0.75, 0.95)
    )
    panel = TracePanel(
        title="HM1\n50 to 90 deg/s",
        stretches=(stretch,) * n_stretches,
        names=("R1",) * n_stretches,
        band=band,
    )
    return TraceColumns(panels=(panel,) * n_panels, has_angle=has_angle)


MANY: dict[str, Content] = {
    "counts": GradeCounts(
        models=(LONG, "HM2"),
        intended=("1", None),
        scale=("0", "1", "2"),
        counts=((0, 190, 10), (0, 0, 0)),
    ),
    "counts of many grades": GradeCounts(
        models=("HM1",),
        intended=(None,),
        scale=tuple(map(str, range(101))),
        counts=(tuple(range(101)),),
    ),
    "speeds of many": speeds(200),
    "bands": traces(2, 3, has_angle=True),
    "small panels": traces(5, 3, has_angle=False),
    "long names": GradeGrid(
        models=(LONG, "HM2"),
        raters=(LONG, f"Dr. {LONG}"),
        intended=("1", None),
        grades=((("1",), ("0",)), ((), ("2", "1"))),
        scale=("0", "1", "2"),
    ),
}


@pytest.mark.parametrize("name", [*MANY, "forest", "pairs"])
def test_a_figure_fits_its_page_and_its_page_fits_it(name: str) -> None:
    figure, files = drawn((MANY | DRAWINGS)[name])
    assert figure.get_figwidth() <= WIDEST_IN
    shown = np.asarray(Image.open(io.BytesIO(files["png"])))
    edges = (shown[:2], shown[-2:], shown[:, :2], shown[:, -2:])
    assert all((edge == 255).all() for edge in edges)  # nothing is cut off
    size = re.search(rb'width="([\d.]+)pt" height="([\d.]+)pt"|$', files["svg"])
    assert size is not None
    points = [float(length) for length in reversed(size.groups())]
    assert shown.shape[:2] == pytest.approx([at / 72.0 * 200.0 for at in points], abs=1)


def test_above_thirty_raters_a_figure_no_longer_grows_with_them() -> None:
    (few, _), (many, files), (more, others) = (drawn(speeds(n)) for n in (30, 31, 200))
    assert n_artists(few) < 1.2 * n_artists(many)
    assert n_artists(many) == n_artists(more)
    assert len(others["svg"]) < 1.05 * len(files["svg"])


def test_a_small_grid_of_panels_names_what_it_shades(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    svg = draw(MANY["small panels"], stamp="", forms=("svg",))["svg"]
    assert svg.count(b">R1<") == 3 * 5
    assert b">middle 90 %<" in svg


@pytest.mark.slow
def test_a_figure_is_the_same_in_any_environment(tmp_path: Path) -> None:
    code = (
        "import hashlib\n"
        "from masrel.plots import draw\n"
        "from tests.lab.internal.report.test_figures_at_scale import MANY\n"
        "for form, data in draw(MANY['bands'], stamp='from: é').items():\n"
        "    print(form, hashlib.sha256(data).hexdigest())\n"
    )
    settings = tmp_path / "matplotlibrc"
    settings.write_text("font.size: 20\nsavefig.dpi: 50\naxes.grid: True\n")
    home = tmp_path / "home"
    home.mkdir(mode=0o500)
    plain = {"PATH": os.environ["PATH"], "PYTHONPATH": str(ROOT)}
    strange = plain | {
        "HOME": str(home),
        "LANG": "tr_TR.UTF-8",
        "LC_ALL": "de_DE.UTF-8",
        "MATPLOTLIBRC": str(settings),
        "MPLBACKEND": "module://not.there",
        "SOURCE_DATE_EPOCH": "1",
        "TZ": "Pacific/Kiritimati",
    }
    first, second = (
        subprocess.run(
            [sys.executable, "-c", code], env=env, cwd=tmp_path, text=True,
            check=True, stdout=subprocess.PIPE,
        ).stdout
        for env in (plain | {"HOME": os.environ.get("HOME", "/")}, strange)
    )  # fmt: skip
    assert first.startswith("png ")
    assert first == second


def report_of(root: Path, n_raters: int, n_models: int, n_repeats: int) -> Path:
    many_ratings(root, n_raters, n_models, n_repeats)
    protocol = read_protocol(root / "protocol.toml")
    file = root / "ratings" / "ratings.csv"
    ratings = read_study_ratings(file, protocol.scale)
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
        (file,) = folder.glob(f"{name}-*.csv")
        head, *rows = file.read_text(encoding="utf-8").splitlines()
        assert len(rows) == n_rows
        assert head.count(",") + 1 == n_columns
    (sessions,) = folder.glob("sessions-*.csv")
    assert "R031, R032" in sessions.read_text(encoding="utf-8")
    assert "R001, R002, …, R032<" in page
    assert "(lower quartile)" in page
    assert ">R017<" not in page


@pytest.mark.slow
def test_a_report_of_ten_thousand_ratings_stays_small(tmp_path: Path) -> None:
    page = report_of(tmp_path / "study", 200, 10, 5)
    assert page.stat().st_size <= 5e6
