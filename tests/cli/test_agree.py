"""masrel agree: the agreement table of any file of ratings."""

import csv
import json
import shlex
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


def test_without_a_target_one_line_says_how_to_ask(wide: Path) -> None:
    done = agree(wide)
    assert done.returncode == 0
    assert done.stderr.count("\n") == 1
    command = f"masrel agree {shlex.quote(str(wide))} --target items"
    assert done.stderr == f"no interval; for other items like these: {command}\n"
    assert "0.529" in done.stdout


def test_long_and_wide_files_of_the_same_grades_agree(
    tmp_path: Path, wide: Path
) -> None:
    rows = list(csv.DictReader(WIDE.splitlines()))
    long = tmp_path / "long.csv"
    lines = [
        f"{row['patient']},{rater},{row[rater]}"
        for row in rows
        for rater in ("Kim", "Lee", "Ann")
    ]
    long.write_text("thing,who,mark\n" + "\n".join(lines) + "\n", encoding="utf-8")
    names = ("--item", "thing", "--rater", "who", "--grade", "mark")
    first = agree(wide, "--json", "-")
    second = agree(long, *names, "--json", "-")
    assert second.returncode == 0, second.stderr
    same = ("options", "scale", "notes", "estimates")
    of_long, of_wide = (json.loads(done.stdout) for done in (second, first))
    assert [of_long[key] for key in same] == [of_wide[key] for key in same]


def test_json_on_stdout_is_one_document_and_the_target_is_in_it(wide: Path) -> None:
    done = agree(wide, "--target", "raters", "--json", "-")
    (percent, _) = json.loads(done.stdout)["estimates"]
    assert percent["interval"]["target"] == "raters"
    # Without Kim, Lee or Ann: shares 1/3, 3/4 and 2/3. Their squared deviations sum
    # to 0.097, times 2/3 the error is 0.25, times t(2) = 4.30 more than 2/3 or 1/3.
    assert percent["interval"]["low"] == 0.0
    assert any("cut" in note for note in percent["interval"]["notes"])
    assert "told by its grade 1+" in done.stderr
    declared = agree(
        wide, "--target", "raters", "--categories", "0,1,1+,2,3,4", "--json", "-"
    )
    same = (json.loads(made.stdout)["estimates"] for made in (declared, done))
    assert next(same) == next(same)
    assert "Scale:" not in declared.stderr


def test_seeded_intervals_repeat(tmp_path: Path) -> None:
    # so many different items that not every resample can be taken
    path = tmp_path / "many.csv"
    rows = [f"{i},{i % 5},{i % 7 % 5},{i % 11 % 5},{i % 13 % 5}" for i in range(80)]
    path.write_text("\n".join(["item,A,B,C,D", *rows]) + "\n", encoding="utf-8")
    asked = (path, "--target", "items", "--interval", "bootstrap", "--json", "-")
    assert agree(*asked, "--seed", "4").stdout == agree(*asked, "--seed", "4").stdout
    assert agree(*asked, "--seed", "4").stdout != agree(*asked, "--seed", "5").stdout


def test_sessions_are_never_pooled_in_silence(tmp_path: Path) -> None:
    path = tmp_path / "two.csv"
    rows = ["session,item,rater,grade"]
    rows += [f"test,{i},{r},{g}" for i, r, g in [(1, "A", 1), (1, "B", 1)]]
    rows += [f"test,{i},{r},{g}" for i, r, g in [(2, "A", 2), (2, "B", 1)]]
    rows += [f"retest,{i},{r},{g}" for i, r, g in [(1, "A", 1), (1, "B", 2)]]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    done = agree(path)
    assert done.returncode == 2
    assert "--by session" in done.stderr
    each = agree(path, "--by", "session", "--json", "-")
    values = [
        (e["session"], e["value"])
        for e in json.loads(each.stdout)["estimates"]
        if e["coefficient"] == "percent_agreement"
    ]
    assert values == [("test", 0.5), ("retest", 0.0)]


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
