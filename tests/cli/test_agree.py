"""masrel agree: the agreement table of any file of ratings."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

TABLE_V = Path(__file__).parents[2] / "studies/hess2012/ratings/published.csv"

WIDE = "patient,Kim,Lee,Ann\nA,1,1+,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\n"


def agree(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    call = [sys.executable, "-m", "masrel", "agree", *map(str, arguments)]
    return subprocess.run(
        call, capture_output=True, text=True, check=False, encoding="utf-8"
    )


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    path = tmp_path / "wide.csv"
    path.write_text(WIDE, encoding="utf-8")
    return path


def test_table_v_gives_its_kappa_to_the_last_digit() -> None:
    done = agree(TABLE_V, "--json", "-")
    assert done.returncode == 0
    found = {e["coefficient"]: e for e in json.loads(done.stdout)["estimates"]}
    assert found["fleiss_kappa"]["value"] == pytest.approx(0.626083678854127, abs=1e-15)
    # 81 of 112 pairs of raters agree: 21 + 16 + 28 + 16, of 28 pairs a model
    assert found["percent_agreement"]["value"] == 81 / 112
    assert found["fleiss_kappa"]["interval"] is None


def test_a_kappa_loads_no_interval_and_no_figure(wide: Path) -> None:
    code = (
        "import sys; from masrel.cli import cli; "
        f"cli(['agree', {str(wide)!r}], standalone_mode=False); "
        "print([m for m in ('scipy', 'emcee', 'matplotlib', 'statsmodels', "
        "'masrel.intervals', 'masrel.lab.hess') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"
