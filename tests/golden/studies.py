"""Cases of the command line: agree, analyze, grading, latent and the two reports."""

import csv
import hashlib
import io
import json
import re
import shlex
import tomllib
from functools import partial
from pathlib import Path

from masrel.lab.protocol import copy_template
from tests.golden.call import STUDIES, Case, Stream, folder, masrel, without_paths

PUBLISHED = STUDIES / "hess2012" / "ratings" / "published.csv"
IN_PERSON = STUDIES / "hess2012" / "ratings" / "in_person.csv"

WIDE = "patient,Kim,Lee,Ann\nA,1,1+,1\nB,2,NA,2\nC,1,1,2\nD,3,3,3\nE,0,1,1\n"
NUMBERS = "case,a,b,c\n1,2,2,3\n2,4,4,4\n3,1,2,1\n4,3,3,\n5,5,4,5\n6,2,2,2\n"

MODELS = ("HM1", "HM2", "HM3", "HM4", *(f"D{k:02}" for k in range(1, 13)))
GRADES = ("0", "1", "1+", "2", "3", "4")

OPTIONS: tuple[tuple[object, ...], ...] = (
    (),
    ("--target", "items"),
    ("--target", "raters"),
    ("--target", "both"),
    ("--weights", "linear", "--target", "items"),
    ("--weights", "quadratic", "--target", "raters"),
    ("--weights", "ordinal", "--level", 0.9, "--target", "items"),
    ("--categories", "0,1,1+,2,3,4", "--weights", "linear"),
    ("--target", "items", "--interval", "analytic", "--words", "landis_koch"),
    ("--target", "items", "--interval", "bootstrap", "--resamples", 500),
    ("--target", "raters", "--interval", "bootstrap", "--seed", 3),
    ("--target", "items", "--interval", "posterior"),
    ("--target", "both", "--interval", "jackknife", "--words", "altman"),
)
"""Options of agree."""

FORMS = (("--csv",), ("--latex",), ())

LATENT = (
    ("fixed", ("--items", "fixed", "--one-prior")),
    ("random", ("--items", "random", "--one-prior", "--seed", 5, "--level", 0.9)),
)


def cases() -> list[Case]:
    """All of them; those that sample or draw figures are slow."""
    made = [
        Case("agree", f"{name}-{k:02}", partial(_agree, file, options))
        for name, file in _files().items()
        for k, options in enumerate(OPTIONS)
    ]
    made += [Case("agree", f"forms-{name}", partial(_forms, name)) for name in _files()]
    made += [Case("agree", "sessions", _sessions), Case("agree", "refused", _refused)]
    made += [Case("analyze", "published", _published)]
    made += [Case("analyze", f"drawn-{n}", partial(_analyze, n)) for n in range(6)]
    made += [Case("grading", "published", partial(_grading, 0, "published"))]
    made += [
        Case("grading", f"drawn-{n}", partial(_grading, n, "drawn")) for n in range(4)
    ]
    made += [
        Case("transcripts", name, partial(_transcripts, lines))
        for name, lines in TRANSCRIPTS["lines"].items()
    ]
    made += [Case("latent", name, partial(_latent, o), slow=True) for name, o in LATENT]
    return made + [
        Case("demo", study, partial(_demo, study), slow=True)
        for study in ("hess2012", "small")
    ]


TRANSCRIPTS = tomllib.loads(
    (Path(__file__).parent / "transcripts.toml").read_text("utf-8")
)


def _transcripts(lines: list[str]) -> dict[str, object]:
    with folder():
        for name, text in TRANSCRIPTS["files"].items():
            Path(name).write_text(text, "utf-8")
        results = {line: masrel(*shlex.split(line)) for line in lines}
    for result in results.values():
        result.get("json", {}).pop("masrel", None)  # the version
    return results


def _files() -> dict[str, Path | str]:
    return {"published": PUBLISHED, "wide": "wide.csv", "numbers": "numbers.csv"}


def _work() -> object:
    return folder(wide__csv=WIDE, numbers__csv=NUMBERS, long__csv=_drawn(0))


def _columns(file: Path | str) -> tuple[object, ...]:
    return () if isinstance(file, str) else ("--item", "model")


def _agree(file: Path | str, options: tuple[object, ...]) -> dict:
    with _work():
        every = ("--coefficients", "all") if "posterior" not in options else ()
        call = ("agree", file, *_columns(file), *options)
        return {
            "usual": masrel(*call, "--json", "-"),
            "all": masrel(*call, *every, "--json", "-"),
        }


def _forms(name: str) -> dict:
    made, file = {}, _files()[name]
    with _work():
        for form in FORMS:
            for target in ("items", "raters"):
                call = ("agree", file, *_columns(file), "--target", target, *form)
                some = ("--coefficients", "percent_agreement,gwet_ac,conger_kappa")
                made[" ".join([target, *form])] = masrel(*call, *some)
    return made


def _sessions() -> dict:
    call = ("agree", "long.csv", "--item", "model", "--by", "session")
    with _work():
        return {
            "json": masrel(*call, "--target", "items", "--json", "-"),
            "csv": masrel(*call, "--coefficients", "all", "--csv"),
            "mixed": masrel(*call[:-2]),
        }


def _refused() -> dict:
    with _work():
        return {
            "in person": masrel("agree", IN_PERSON),
            "text": masrel("agree", "wide.csv", "--categories", "1,2"),
            "name": masrel("agree", "wide.csv", "--coefficients", "kappa"),
            "latex": masrel("agree", "wide.csv", "--csv", "--latex"),
        }


def _drawn(seed: int) -> str:
    """Ratings of the models of hess2012, in the columns of its file."""
    stream = Stream(f"ratings {seed}")
    lines = ["session,rater,model,grade,mean_speed_deg_s,source"]
    sessions = {"test": 8, "retest": 3} if seed % 2 == 0 else {"test": 8}
    for session, n_raters in sessions.items():
        for rater in range(1, n_raters + 1):
            for m, model in enumerate(MODELS if seed % 3 else MODELS[:8]):
                place = 1.0 + (m % 4) + (0.9 + 0.2 * seed) * stream.normal()
                grade = GRADES[min(max(round(place), 0), 5)]
                speed = round(stream.uniform(60.0, 120.0), 1)
                lines.append(f"{session},R{rater},{model},{grade},{speed},simulated")
    return "\n".join(lines) + "\n"


def _published() -> dict:
    few = _only(PUBLISHED.read_text("utf-8"), ("R1", "R2", "R3"))
    with folder(few__csv=few) as here:
        study = _copied(here)
        return {
            "json": masrel("analyze", study, "--json", "-"),
            "csv": masrel("analyze", study, "--csv"),
            "text": masrel("analyze", study, "--json", "analysis.json"),
            "few": masrel("analyze", study, "--ratings", "few.csv", "--json", "-"),
            "none": masrel("analyze", STUDIES / "small"),
        }


def _copied(here: Path) -> Path:
    # what is computed of a study is written into it
    copy_template("hess2012", here / "study")
    return here / "study"


def _only(text: str, raters: tuple[str, ...]) -> str:
    rows = list(csv.reader(io.StringIO(text)))
    kept = [row for row in rows[1:] if row[1] in raters]
    return "\n".join(map(",".join, [rows[0], *kept])) + "\n"


def _analyze(seed: int) -> dict:
    with folder(ratings__csv=_drawn(seed)) as here:
        call = ("analyze", _copied(here), "--ratings", "ratings.csv")
        return {
            "json": masrel(*call, "--json", "-"),
            "csv": masrel(*call, "--csv"),
            "text": masrel(*call, "--json", "analysis.json"),
        }


def _grading(seed: int, kind: str) -> dict:
    text = _drawn(seed) if kind == "drawn" else PUBLISHED.read_text("utf-8")
    study = STUDIES / "hess2012"
    with folder(ratings__csv=text):
        call = ("grading", study, "--ratings", "ratings.csv", "--session", "test")
        return {
            "all": masrel(*call, "--json", "-"),
            "H and speed": masrel(*call, "--on", "H,speed", "--json", "-"),
            "standard": masrel(*call, "--models", "standard", "--json", "-"),
            "dummies": masrel(*call, "--models", "dummy", "--on", "L,H", "--json", "-"),
            "text": masrel(*call, "--on", "Q,speed", "--level", 0.9),
        }


def _latent(options: tuple[object, ...]) -> dict:
    with _work():
        file = PUBLISHED if "fixed" in options else "wide.csv"
        call = ("latent", file, *_columns(file), *options, "--quiet")
        return masrel(*call, "--json", "-")


def _demo(study: str) -> dict:
    with folder() as here:
        made: dict = {"call": masrel("demo", "out", "--study", study, "--quiet")}
        out = here / "out"
        files = [path for path in sorted(out.rglob("*")) if path.is_file()]
        made["sha256"] = {
            path.relative_to(out).as_posix(): hashlib.sha256(_bytes(path)).hexdigest()
            for path in files
        }
        made["texts"] = {
            path.relative_to(out).as_posix(): _readable(path)
            for path in files
            if path.suffix in (".csv", ".md", ".html", ".tex")
        }
        made["analysis"] = {
            path.name: json.loads(path.read_text("utf-8"))
            for path in files
            if path.name.startswith("analysis")
        }
    return made


def _bytes(path: Path) -> bytes:
    # logs without times of day and the hashes over them
    data = path.read_bytes()
    if path.suffix == ".jsonl":
        return re.sub(rb'"(time_utc|previous)": ?"[^"]*"', b"", data)
    return data


def _readable(path: Path) -> str:
    # pages without their figures
    text = without_paths(path.read_text("utf-8"))
    text = re.sub(r"<svg.*?</svg>", "<svg/>", text, flags=re.DOTALL)
    return re.sub(r"data:[\w/+]*;base64,[\w+/=]*", "data:", text)
