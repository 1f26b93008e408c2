"""masrel agree: what it prints of its estimates, form by form."""

import csv
import hashlib
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import masrel as package
from masrel.agreement import COEFFICIENTS, strength
from masrel.intervals import estimate
from masrel.ratings import read_ratings
from tests.cli.process import Caller, Done

TABLE_V = Path(__file__).parents[2] / "studies/hess2012/ratings/published.csv"
WIDE = "patient,Kim,Lee,Ann\nA,1,1+,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\n"
TEXT = "item,A,B\nx,low,mid\ny,high,high\nz,low,low\nw,mid,mid\n"
PERFECT = "item,A,B\n1,1,1\n2,2,2\n3,3,3\n4,1,1\n"
SESSIONS = "session,item,rater,grade,source\n" + "".join(
    f"{session},{item},{rater},{(item * rater) % 3},simulated\n"
    for session in ("first", "second")
    for item in range(4)
    for rater in range(3)
)


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    return written(tmp_path, WIDE)


def written(folder: Path, text: str, name: str = "ratings.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def document(done: Done) -> dict:
    assert done.code == 0, done.err
    return json.loads(done.out)


def table(done: Done) -> list[dict[str, str]]:
    assert done.code == 0, done.err
    return list(csv.DictReader(io.StringIO(done.out)))


# The record.


def test_a_record_says_what_was_computed_from_what(masrel: Caller, wide: Path) -> None:
    call = ("--target", "items", "--interval", "bootstrap", "--seed", 3)
    more = ("--resamples", 500, "--level", 0.9, "--words", "altman")
    made = document(masrel("agree", wide, *call, *more, "--json", "-"))
    assert made["masrel"] == package.__version__
    assert made["file"] == str(wide)
    assert made["sha256"] == hashlib.sha256(wide.read_bytes()).hexdigest()
    assert made["options"] == {
        "coefficients": ["percent_agreement", "fleiss_kappa"],
        "weights": "identity",
        "target": "items",
        "interval": "bootstrap",
        "level": 0.9,
        "resamples": 500,
        "seed": 3,
        "words": "altman",
        "by": None,
    }
    assert made["scale"]["grades"] == ["0", "1", "1+", "2", "3", "4"]
    assert made["scale"]["values"] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert made["read"]["raters"] == ["Kim", "Lee", "Ann"]
    assert made["read"]["scale"]["declared"] is False


def test_estimates_are_called_what_the_register_calls_them(
    masrel: Caller, wide: Path
) -> None:
    call = ("agree", wide, "--coefficients", "all")
    made = document(masrel(*call, "--json", "-"))["estimates"]
    rows = table(masrel(*call, "--csv"))
    for one, row in zip(made, rows, strict=True):
        entry = COEFFICIENTS[one["coefficient"]]
        assert (row["coefficient"], row["title"]) == (entry.name, entry.title)
        assert row["weights"] == one["weights"]
        assert not one["coefficient"].startswith("icc") or row["weights"] == "identity"


def test_what_is_null_has_its_reason(masrel: Caller, tmp_path: Path) -> None:
    path = written(tmp_path, "item,A,B\n1,1,4\n2,4,1\n3,2,3\n4,3,2\n")
    call = ("--coefficients", "all", "--target", "items", "--interval", "analytic")
    for one in document(masrel("agree", path, *call, "--json", "-"))["estimates"]:
        said = " ".join(one["notes"])
        for key in ("value", "standard_error", "observed", "chance"):
            assert one[key] is not None or one["reason"] is not None or key in said
        interval = one["interval"]
        if interval is None:
            assert one["reason"] is not None or "no interval: " in said
            continue
        for end in ("low", "high"):
            known = interval[end] is not None or interval["reason"] is not None
            assert known or f"interval.{end}: null" in said


def test_an_infinite_end_is_null_and_said(masrel: Caller, tmp_path: Path) -> None:
    path = written(tmp_path, "item,A,B\n1,2,2\n2,5,4\n3,2,3\n")
    call = ("--coefficients", "icc_ak", "--json", "-")
    (one,) = document(masrel("agree", path, *call))["estimates"]
    assert one["interval"]["low"] is None
    assert "interval.low: null, there is no bound" in one["notes"]
    shown = masrel("agree", path, *call[:2]).out
    assert "−∞" in shown


# A table as CSV and LaTeX.


def test_the_columns_of_a_csv(masrel: Caller, tmp_path: Path) -> None:
    path = written(tmp_path, SESSIONS)
    names = (
        "coefficient,title,weights,value,standard_error,median,low,high,level,method,"
        "target,n_items,n_raters"
    )
    call = ("agree", path, "--by", "session", "--target", "raters", "--csv")
    head = masrel(*call).out.splitlines()[0]
    assert head == f"session,{names},data"
    head = masrel(*call, "--words", "fleiss").out.splitlines()[0]
    assert head == f"session,{names},words,data"


@pytest.mark.parametrize(("target", "name"), [("items", "icc_c1"), ("both", "icc_a1")])
def test_an_icc_has_an_interval_for_one_target(
    masrel: Caller, tmp_path: Path, target: str, name: str
) -> None:
    call = ("agree", written(tmp_path, SESSIONS), "--by", "session", "--target")
    first, *_ = table(masrel(*call, target, "--coefficients", name, "--csv"))
    shown = [first[key] for key in ("level", "method", "target")]
    assert shown == ["0.95", "F distribution", target]
    for other in {"items", "raters", "both"} - {target}:
        done = masrel(*call, other, "--coefficients", name)
        assert f'which is "{target}", and it has no other; got "{other}"' in done.err
        assert (done.code, done.out) == (2, "")
    # among all that fit it is shown as what it is
    rows = table(masrel(*call, "raters", "--coefficients", "all", "--csv"))
    assert {r["target"] for r in rows if r["coefficient"] == name} == {target}


def latex(masrel: Caller, folder: Path) -> str:
    path = written(folder, SESSIONS.replace("first", "50%_{&}~#$^\\"), "a_b&c%.csv")
    call = ("agree", path, "--by", "session", "--coefficients", "all", "--words")
    return masrel(*call, "altman", "--target", "items", "--latex", "--explain").out


def test_latex_has_a_label_and_says_what_it_needs(
    masrel: Caller, tmp_path: Path
) -> None:
    out = latex(masrel, tmp_path)
    assert out.startswith("% needs \\usepackage{booktabs}\n")
    assert out.count("\\label{tab:agreement}") == 1
    assert out.index("\\caption") < out.index("\\label") < out.index("tabular")
    begun = re.findall(r"\\begin\{(\w+)\}", out)
    assert begun == re.findall(r"\\end\{(\w+)\}", out)[::-1]
    body = re.sub("(?m)^%.*\n", "", out)  # below the comments every % is escaped
    assert re.findall(r"(?<!\\)[%#]", body) == []
    assert "--" not in re.sub(r" -- (?=[&\\])", "", body)  # a dash for what is absent
    assert body.isascii() or set(re.findall(r"[^\x00-\x7f]", body)) <= set("–")


def compiled(folder: Path, text: str) -> str:
    """Return the log of pdflatex, or skip where there is none."""
    engine = shutil.which("pdflatex")
    if engine is None:
        pytest.skip("pdflatex is not installed")
    page = written(
        folder,
        "\\documentclass{article}\\usepackage{booktabs,longtable}\n"
        f"\\begin{{document}}\n{text}Table~\\ref{{tab:agreement}}\n\\end{{document}}\n",
        "page.tex",
    )
    done = subprocess.run(
        [engine, "-halt-on-error", "-interaction=nonstopmode", page.name],
        cwd=folder, capture_output=True, check=False,
    )  # fmt: skip
    log = done.stdout.decode("utf-8", "replace")
    assert done.returncode == 0, log[-2000:]
    return log


@pytest.mark.slow
def test_latex_compiles(masrel: Caller, tmp_path: Path) -> None:
    compiled(tmp_path, latex(masrel, tmp_path))


# After the end of a line LaTeX reads [ and * as its own; > and | are other letters in
# its fonts.
GROUPS = ["[0, 1)", "*", "a>b|c", "José", "Łukasz", "θ\u0307, ẋ, ē, ω\u0302"]


def test_latex_of_many_groups_is_a_table_of_pages(
    masrel: Caller, tmp_path: Path
) -> None:
    groups = [*GROUPS, *map(str, range(20))]
    rows = [f'"{g}",{i},{i % 2},{i // 2 % 2}' for g in groups for i in range(4)]
    path = written(tmp_path, "\n".join(["ward,item,A,B", *rows]) + "\n")
    out = masrel("agree", path, "--by", "ward", "--latex").out
    assert out.startswith("% needs \\usepackage{booktabs,longtable}\n")
    assert "lualatex" not in out
    begun = re.findall(r"\\begin\{(\w+)\}", out)
    assert begun == re.findall(r"\\end\{(\w+)\}", out)[::-1] == ["longtable"]
    marked = r"$\dot{\theta}$, \.{x}, \={e}, $\hat{\omega}$ &"
    for name in ("{[}0, 1) &", "{*} &", "a$>$b$|$c &", marked):
        assert out.count(f"\n{name}") == 2
    assert out.count("\\toprule") == 2  # on the first page, and on all others


@pytest.mark.slow
def test_latex_of_many_groups_compiles(masrel: Caller, tmp_path: Path) -> None:
    groups = [*GROUPS, *map(str, range(60))]
    rows = [f'"{g}",{i},{i % 2},{i // 2 % 2}' for g in groups for i in range(4)]
    path = written(tmp_path, "\n".join(["ward,item,A,B", *rows]) + "\n")
    call = ("agree", path, "--by", "ward", "--each-category", "--symmetry", "--latex")
    log = compiled(tmp_path, masrel(*call).out)
    pages = re.search(r"\((\d+) pages", log)
    assert pages is not None
    assert int(pages[1]) > 3
    assert "Float too large" not in log


def test_latex_names_letters_that_pdflatex_lacks(
    masrel: Caller, tmp_path: Path
) -> None:
    path = written(tmp_path, "item,Ωμ,名\n1,a,b\n2,b,b\n3,a,a\n")
    call = ("agree", path, "--latex", "--by", "ward")
    assert "lualatex" not in masrel("agree", path, "--latex").out
    text = "ward,item,A,B\n" + "".join(f"名ά,{i},{i % 2},{i // 2}\n" for i in range(4))
    path.write_text(text, encoding="utf-8")
    second = masrel(*call).out.splitlines()[1]
    assert second == "% needs lualatex and a font with ά 名"


# Notes below a table.


def notes(done: Done) -> list[str]:
    """Return the lines below a table."""
    lines = done.out.splitlines()
    rule = next(k for k, line in enumerate(lines) if line.startswith("---"))
    rows = [k for k, line in enumerate(lines) if k > rule and re.search(r" \d+$", line)]
    return lines[rows[-1] + 1 :]


def test_an_interval_takes_one_line_and_explain_more(
    masrel: Caller, tmp_path: Path
) -> None:
    rows = [f"{i},{i % 5},{i % 7 % 5},{i % 11 % 5}" for i in range(30)]
    path = written(tmp_path, "\n".join(["item,A,B,C", *rows]) + "\n")
    call = ("agree", path, "--target", "items", "--interval", "jackknife")
    assert notes(masrel(*call)) == [
        "SE: delta method, items as the sample.",
        "95 % CI, item jackknife, t(29): generalises to other items like these.",
    ]
    explained = " ".join(notes(masrel(*call, "--explain")))
    assert "from leaving out one item at a time" in explained
    assert "95 % of the intervals" in explained


def test_notes_are_no_longer_than_the_table(masrel: Caller, wide: Path) -> None:
    for target in ("items", "raters", "both"):
        done = masrel("agree", wide, "--target", target, "--coefficients", "all")
        below = "\n".join(notes(done))
        # gaps add the variances of ICC, one-way and two-way
        assert len(below) < 1.3 * (len(done.out) - len(below))
        assert "given these ratings" not in below
        assert "chosen for" not in below


# Items 1 to 4 of each clinic have one rating, of A; the others have two or three.
SPARSE = "clinic,item,A,B,C\n" + "".join(
    f"{clinic},{clinic}{k},{k % 2},{'' if k < 5 else k % 2},{'' if k < 9 else k % 3}\n"
    for clinic, items in (("North", range(1, 11)), ("South", range(1, 12)))
    for k in items
)


def test_items_without_a_pair_of_ratings_are_told(
    masrel: Caller, tmp_path: Path
) -> None:
    sparse = written(tmp_path, SPARSE)
    call = ("agree", sparse, "--raters", "A,B,C")
    done = masrel(*call)
    n_items, n_paired = 10 + 11, 6 + 7
    note = f"{n_paired} of {n_items} items have two ratings or more."
    assert note in done.out.splitlines()
    assert all(
        (e["n_items"], e["n_items_paired"]) == (n_items, n_paired)
        for e in document(masrel(*call, "--json", "-"))["estimates"]
    )
    sentence = masrel(*call, "--sentence")
    assert f"{n_items} items ({n_paired} with two ratings or more)" in sentence.out
    assert note not in sentence.out + sentence.err
    note = "Items that have two ratings or more: 6 of 10 (North), 7 of 11 (South)."
    assert note in masrel(*call, "--by", "clinic").out.splitlines()
    assert "two ratings" not in masrel("agree", written(tmp_path, WIDE, "w.csv")).out


def test_a_note_names_rows_that_follow_each_other_by_the_first_and_the_last(
    masrel: Caller, tmp_path: Path
) -> None:
    sparse = written(tmp_path, SPARSE)
    call = ("agree", sparse, "--raters", "A,B,C", "--coefficients", "all")
    text = " ".join(masrel(*call, "--target", "both").out.split())
    assert "Percent agreement to Krippendorff's α: 3 raters: below 5 " in text
    assert "Kendall's W; Robinson's A: no interval: " in text
    call = ("agree", sparse, "--by", "clinic", "--target", "items")
    by = " ".join(masrel(*call, "--interval", "jackknife").out.split())
    for clinic, df in (("North", 5), ("South", 6)):
        assert f"Clinic {clinic}: 95 % CI, item jackknife, t({df}): " in by


def test_standard_errors_are_explained_where_there_are_any(
    masrel: Caller, wide: Path
) -> None:
    call = ("agree", wide, "--coefficients")
    assert "SE: " not in masrel(*call, "icc_a1,kendall_w").out
    assert "SE: " in masrel(*call, "icc_a1,gwet_ac").out


@pytest.mark.parametrize(("columns", "most"), [(None, 88), ("60", 60), ("300", 100)])
def test_notes_are_as_wide_as_the_screen(
    masrel: Caller,
    wide: Path,
    monkeypatch: pytest.MonkeyPatch,
    columns: str | None,
    most: int,
) -> None:
    if columns is not None:
        monkeypatch.setenv("COLUMNS", columns)
        monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    call = ("agree", wide, "--target", "items", "--explain")
    widths = [len(line) for line in notes(masrel(*call))]
    assert most - 20 < max(widths) <= most
    assert max(map(len, masrel(*call, "--csv").err.splitlines())) > 100


# Words.


def word_of(done: Done) -> str:
    (row,) = table(done)
    return row["words"]


@pytest.mark.parametrize(
    ("target", "interval"),
    [
        *(("items", kind) for kind in ("auto", "analytic", "jackknife", "bootstrap")),
        *(("raters", kind) for kind in ("auto", "jackknife", "bootstrap")),
        *(("both", kind) for kind in ("auto", "jackknife")),
    ],
)
@pytest.mark.parametrize("level", [0.8, 0.95])
def test_a_word_follows_the_interval_that_is_shown(
    masrel: Caller, target: str, interval: str, level: float
) -> None:
    # the lower end of an interval at 90 % leaves 5 % below
    call = ("agree", TABLE_V, "--coefficients", "gwet_ac", "--words", "landis_koch")
    more = ("--target", target, "--interval", interval, "--level", level)
    ratings = read_ratings(TABLE_V)
    with warnings.catch_warnings(action="ignore"):
        at_90 = estimate(
            "gwet_ac",
            ratings.parts[0].counted,
            target=target,  # type: ignore[arg-type]
            method=interval,  # type: ignore[arg-type]
            level=0.9,
            rng=0,
        ).interval
    assert at_90 is not None
    assert word_of(masrel(*call, *more, "--csv")) == strength(at_90.low)
    assert "by its interval (one-sided)" in masrel(*call, *more, "--csv").err


def test_a_bound_gives_the_word_at_its_whole_level(
    masrel: Caller, tmp_path: Path
) -> None:
    # its lower end, 0.340, is exceeded with 95 %; that at 90 % would be higher
    path = written(tmp_path, PERFECT)
    call = ("--coefficients", "fleiss_kappa", "--target", "items", "--words", "altman")
    (row,) = table(masrel("agree", path, *call, "--csv"))
    assert row["method"].endswith("one-sided")
    assert row["words"] == strength(float(row["low"]), scale="altman") == "fair"
    # without an interval there is only an error of 0, which is no certainty
    done = masrel("agree", path, *call[:2], *call[4:], "--csv")
    assert word_of(done) == "undefined"
    assert "undefined where the SE is 0" in " ".join(done.err.split())


def test_a_word_without_its_interval_is_undefined(
    masrel: Caller, tmp_path: Path
) -> None:
    path = written(tmp_path, PERFECT)
    call = ("--coefficients", "gwet_ac", "--target", "items", "--interval", "analytic")
    assert word_of(masrel("agree", path, *call, "--words", "altman", "--csv")) == (
        "undefined"
    )


def test_icc_has_words_by_its_interval_and_others_by_a_normal_law(
    masrel: Caller, wide: Path
) -> None:
    call = ("agree", wide, "--words", "cicchetti", "--coefficients")
    done = masrel(*call, "icc_a1,gwet_ac,percent_agreement", "--csv")
    assert [row["words"] for row in table(done)] == ["poor", "poor", ""]
    law = "by its interval (one-sided), or by a normal law around the estimate where"
    assert law in done.err
    assert "by a normal law around the estimate;" in masrel(
        *call, "gwet_ac"
    ).out.replace("\n ", "")


# Sentences.


def test_a_sentence_is_ready_for_a_paper(masrel: Caller) -> None:
    call = ("agree", TABLE_V, "--target", "raters", "--sentence")
    done = masrel(*call)
    lines = done.out.splitlines()
    assert lines[1].startswith("Fleiss' κ = .63, 95 % CI [")
    assert lines[1].endswith("] (rater jackknife), 4 items, 8 raters.")
    assert "0." not in done.out
    assert "generalises to other raters like these" in done.err
    assert "SE: " not in done.err
    plain = masrel("agree", TABLE_V, "--sentence", "--coefficients", "icc_ck,gwet_ac")
    assert re.match(r"ICC\(C,k\) = \.\d\d, 95 % CI \[", plain.out)
    assert ", SE = ." in plain.out.splitlines()[1]
    assert "SE: " in plain.err


def test_sentences_of_what_is_undefined_or_one_sided(
    masrel: Caller, tmp_path: Path
) -> None:
    path = written(tmp_path, "item,A,B\nx,1,1\ny,1,1\n")
    out = masrel("agree", path, "--sentence").out.splitlines()
    assert out[0] == "Percent agreement = 1.00, SE = .00, 2 items, 2 raters."
    assert out[1].startswith("Fleiss' κ is undefined (0/0: chance agreement is 1")
    path = written(tmp_path, PERFECT)
    out = masrel("agree", path, "--sentence", "--target", "items").out.splitlines()
    bound = "95 % credible lower bound .34 (Dirichlet-multinomial posterior)"
    assert out[1] == f"Fleiss' κ = 1.00, {bound}, 4 items, 2 raters."
    more = ("--target", "items", "--interval", "analytic")
    out = masrel("agree", path, "--sentence", *more).out.splitlines()
    assert "Fleiss' κ = 1.00, SE = .00, no 95 % CI (the standard error is 0" in out[1]


def test_a_sentence_names_weights_group_and_simulated_data(
    masrel: Caller, tmp_path: Path
) -> None:
    path = written(tmp_path, SESSIONS)
    call = ("--coefficients", "gwet_ac", "--weights", "linear", "--by", "session")
    first, second = masrel("agree", path, *call, "--sentence").out.splitlines()
    start = "SIMULATED DATA. Session {}: Gwet's AC (linear weights) = "
    assert first.startswith(start.format("first"))
    assert second.startswith(start.format("second"))


def test_a_sentence_has_the_word_it_earns(masrel: Caller) -> None:
    call = ("agree", TABLE_V, "--target", "raters", "--words", "landis_koch")
    word = table(masrel(*call, "--csv"))[1]["words"]
    done = masrel(*call, "--sentence")
    percent, kappa = done.out.splitlines()
    assert f", at least {word} after Landis and Koch (1977), 4 items" in kappa
    assert "at least" not in percent
    assert "by its interval (one-sided)" in done.err


@pytest.mark.parametrize("form", [("--csv",), ("--latex",), ("--json", "-")])
def test_a_sentence_has_stdout_to_itself(
    masrel: Caller, wide: Path, form: tuple[str, ...]
) -> None:
    done = masrel("agree", wide, "--sentence", *form)
    assert (done.code, done.out) == (2, "")
    assert "want the same stdout" in done.err


# The offer of an interval.


def offer(done: Done) -> tuple[str, list[str]]:
    """Return what the last line offers, and the command."""
    line = done.err.splitlines()[-1]
    words, command = line.split(": masrel ")
    return words, shlex.split(command)


def test_the_command_that_is_offered_gives_an_interval(
    masrel: Caller, tmp_path: Path
) -> None:
    path = written(tmp_path, SESSIONS, "Ann's ratings.csv")
    call = ("agree", str(path), "--by", "session", "--categories", "0, 1,2", "--csv")
    words, command = offer(masrel(*call))
    assert words == "no interval; for other items like these"
    assert command == [*call, "--target", "items"]
    done = masrel(*command)
    assert all(row["low"] for row in table(done))
    assert "no interval" not in done.err


def test_the_offer_works_where_coefficients_were_named(
    masrel: Caller, wide: Path
) -> None:
    words, command = offer(
        masrel(*("agree", wide, "--coefficients"), "icc_a1,gwet_ac,icc_c1", "--csv")
    )
    assert words.endswith("(without ICC(A,1))")  # its interval is for raters, too
    names = [row["coefficient"] for row in table(masrel(*command))]
    assert names == ["gwet_ac", "icc_c1"]
    _, command = offer(masrel("agree", "--", wide))
    assert masrel(*command).code == 0


def test_nothing_is_offered_for_what_came_through_a_pipe(
    masrel: Caller, wide: Path
) -> None:
    assert "no interval" in masrel("agree", wide).err
    reading, writing = os.pipe()
    os.write(writing, wide.read_bytes())
    os.close(writing)
    done = masrel("agree", f"/dev/fd/{reading}")
    os.close(reading)
    assert (done.code, done.err) == (0, "")


def test_nothing_is_offered_where_all_is_there(masrel: Caller, wide: Path) -> None:
    for names in ("icc_1,icc_ak", "kendall_w"):
        assert "--target" not in masrel("agree", wide, "--coefficients", names).err
    wide.write_text("item,A\n1,2\n2,3\n", encoding="utf-8")  # nothing to compare
    done = masrel("agree", wide)
    assert "undefined: no item has ratings of two raters." in done.out
    assert "SE: " not in done.out
    assert done.err == ""


# The register, and what was probably meant.


def test_the_register_is_listed_without_a_file(masrel: Caller) -> None:
    done = masrel("agree", "--coefficients", "list")
    assert (done.code, done.err) == (0, "")
    names = [line.split("  ")[0] for line in done.out.splitlines()[2:]]
    assert names == list(COEFFICIENTS)
    for words in ("Fleiss' κ", "2 or more", "ICC(A,1)", "any", "none"):
        assert words in done.out


def test_a_coefficient_can_be_asked_for_by_another_name(
    masrel: Caller, wide: Path
) -> None:
    assert "bennett_s, randolph_kappa" in masrel("agree", "--coefficients", "list").out
    rows = table(masrel("agree", wide, "--coefficients", "maxwell_re", "--csv"))
    same = table(masrel("agree", wide, "--coefficients", "brennan_prediger", "--csv"))
    assert rows == same


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("randolf_kappa", "randolph_kappa"),
        ("flies_kappa", "fleiss_kappa"),
        ("fleiss", "fleiss_kappa"),
        ("Cohen's kappa", "cohen_kappa"),
        ("alpha", "krippendorff_alpha"),
    ],
)
def test_an_unknown_coefficient_is_guessed(
    masrel: Caller, wide: Path, typed: str, meant: str
) -> None:
    done = masrel("agree", wide, "--coefficients", typed)
    assert (done.code, done.out) == (2, "")
    assert f"did you mean {meant}?" in done.err


@pytest.mark.parametrize(
    ("typed", "option"),
    [
        ("mcnemar", "--symmetry"),
        ("fleiss_kappa,Stuart-Maxwell", "--symmetry"),
        ("bland_altman", "--limits-of-agreement"),
    ],
)
def test_a_table_that_is_asked_for_as_a_coefficient_is_named(
    masrel: Caller, wide: Path, typed: str, option: str
) -> None:
    done = masrel("agree", wide, "--coefficients", typed)
    assert (done.code, done.out) == (2, "")
    assert f"{option} has that table" in done.err


def test_what_could_be_many_is_not_guessed(masrel: Caller, wide: Path) -> None:
    for typed in ("kappa", "icc", "qqqqqq", "", "all,fleiss_kappa"):
        assert "did you mean" not in masrel("agree", wide, "--coefficients", typed).err


def test_verbs_and_options_are_guessed(masrel: Caller, wide: Path) -> None:
    assert "Did you mean 'agree'?" in masrel("agre", wide).err
    said = masrel("agree", wide, "--weigths", "x").err
    assert re.search(r"Did you mean '?--weights", said)
    done = masrel("qqq")
    assert (done.code, done.out) == (2, "")
    assert "No such command 'qqq'." in done.err


def test_a_shell_completes_verbs_and_options(wide: Path) -> None:
    def completed(*words: str) -> str:
        env = {
            **os.environ,
            "_MASREL_COMPLETE": "bash_complete",
            "COMP_WORDS": shlex.join(words),
            "COMP_CWORD": str(len(words) - 1),
        }
        code = "import sys; sys.argv = ['masrel']; from masrel.cli import main; main()"
        call = [sys.executable, "-c", code]
        done = subprocess.run(
            call, capture_output=True, text=True, env=env, check=False
        )
        return done.stdout

    assert "plain,agree" in completed("masrel", "ag")
    assert "plain,--coefficients" in completed("masrel", "agree", str(wide), "--co")
    assert "plain,items" in completed("masrel", "agree", str(wide), "--target", "i")


# Grades without an order.


def test_text_without_an_order_has_no_numbers(masrel: Caller, tmp_path: Path) -> None:
    path = written(tmp_path, TEXT)
    done = masrel("agree", path, "--coefficients", "all", "--json", "-")
    made = document(done)
    names = {one["coefficient"] for one in made["estimates"]}
    assert {"fleiss_kappa", "gwet_ac", "cohen_kappa"} <= names
    assert not any(COEFFICIENTS[name].needs_order for name in names)
    (note,) = made["notes"]
    assert note.startswith("Left out: the six forms of ICC, Kendall's W and Robinson's")
    declared = ("--categories", "low,mid,high", "--coefficients", "all", "--json", "-")
    made = document(masrel("agree", path, *declared))
    assert "icc_a1" in {one["coefficient"] for one in made["estimates"]}
    assert made["notes"] == []


@pytest.mark.parametrize("name", ["icc_a1", "kendall_w", "robinson_a"])
def test_a_coefficient_that_needs_an_order_says_so(
    masrel: Caller, tmp_path: Path, name: str
) -> None:
    path = written(tmp_path, TEXT)
    done = masrel("agree", path, "--coefficients", f"gwet_ac,{name}")
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        f"masrel: {name}: needs grades that are numbers or --categories with every "
        "grade in order, the grades met are text: high, low, mid\n"
    )
