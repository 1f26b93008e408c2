"""masrel latent: tables, JSON and figure of the latent-trait model."""

import csv
import io
import json
from pathlib import Path

import pytest

from masrel.intervals import latent_trait
from tests.cli.process import Caller

SAMPLER = "masrel.intervals.latent._sampler"

WIDE = "patient,Kim,Lee,Ann\nA,1,1+,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\n"
NUMBERS = "patient,Kim,Lee,Ann\nA,1,2,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\n"
SESSIONS = "session,item,rater,grade,source\n" + "".join(
    f"{session},{item},{rater},{(item + (item * rater) % 2) % 4},simulated\n"
    for session in ("first", "second")
    for item in range(4)
    for rater in range(3)
)


@pytest.fixture(autouse=True)
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a second of sampling pass as converged."""
    monkeypatch.setattr(f"{SAMPLER}.MIN_ESS", 50.0)
    monkeypatch.setattr(f"{SAMPLER}.MAX_R_HAT", 1.3)
    monkeypatch.setattr(f"{SAMPLER}._WARM_UP", (20, 20, 20))
    monkeypatch.setattr("masrel.intervals.latent._sampler._N_CHAINS", 16)
    monkeypatch.setattr(
        "masrel.intervals.latent._trait.latent_trait.__kwdefaults__",
        {**(latent_trait.__kwdefaults__ or {}), "n_steps": 50},
    )


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    file = tmp_path / "wide.csv"
    file.write_text(WIDE, encoding="utf-8")
    return file


def test_json_and_csv_keep_every_digit_and_repeat(masrel: Caller, wide: Path) -> None:
    done = masrel("latent", wide, "--items", "fixed", "--json", "-", "--seed", 3)
    found = json.loads(done.out)
    assert [of["name"] for of in found["raters"]] == ["Kim", "Lee", "Ann"]
    assert found["kappa"]["interval"]["target"] == "raters"
    assert found["seed"] == found["other"]["seed"] == 3
    assert len(found["grades"]) == 4
    assert found["other"]["other"] is None
    printed = masrel("latent", wide, "--items", "fixed", "--csv", "--seed", 3)
    rows = list(csv.DictReader(io.StringIO(printed.out)))
    assert rows[0]["what"] == "kappa"
    assert "Neighbouring thresholds" in printed.err
    assert float(rows[0]["median"]) == found["kappa"]["value"]
    assert float(rows[0]["other_low"]) == found["other"]["kappa"]["interval"]["low"]


def test_the_figure_shows_items_thresholds_and_raters(
    masrel: Caller, tmp_path: Path
) -> None:
    file, figure = tmp_path / "study.csv", tmp_path / "scale.svg"
    file.write_text(SESSIONS, encoding="utf-8")
    asked = ("latent", file, "--items", "fixed", "--only", "second", "--one-prior")
    done = masrel(*asked, "--categories", "0,1,2,3", "--quiet", "--figure", figure)
    assert done.code == 0
    assert done.err == f"figure: {figure}\n"
    assert done.out.startswith("SIMULATED DATA. ")
    drawn = figure.read_text("utf-8")  # in which a comment says what is drawn
    for words in ("SIMULATED DATA", "severity", "2 | 3", "bias of raters"):
        assert words in drawn


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (WIDE.replace("1+", "x"), (), "--categories with every grade in order"),
        (SESSIONS, (), "has 2 sessions (first, second); choose one with --only"),
        (SESSIONS, ("--only", "third"), "holds no session third"),
        (NUMBERS, ("--level", "95"), "level: needs a number in (0, 1), got 95"),
        (NUMBERS, ("--seed", "-1"), "--seed: needs at least 0"),
        (NUMBERS, ("--figure", "scale.jpg"), "--figure: needs a name that ends in"),
        (NUMBERS, ("--json", "-", "--csv"), "both write to standard output"),
        (NUMBERS, ("--json", "no/such.json"), "--json: needs a folder that exists"),
        (NUMBERS, ("--figure", "no/such.png"), "--figure: needs a folder that exists"),
        ("patient,Kim,Lee\nA,1,1\nB,2,2\n", (), "no two raters disagree"),
        ("patient,Kim,Lee\nA,1,2\n", (), "needs two items"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(
    masrel: Caller, tmp_path: Path, text: str, options: tuple[str, ...], said: str
) -> None:
    file = tmp_path / "ratings.csv"
    file.write_text(text, encoding="utf-8")
    # not --quiet: no bar is shown of a call that is refused
    done = masrel("latent", file, "--items", "fixed", *options)
    assert done.code == 2
    assert done.out == ""
    assert said in done.err
    assert done.err.count("\n") == 1
