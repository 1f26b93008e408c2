"""A report as LaTeX and as DOCX: the same tables and figures, and the same bytes."""

import os
import re
import shutil
import stat
import subprocess
import sys
import sysconfig
from collections import Counter
from pathlib import Path

import docx
import msgspec
import pytest

import masrel
from masrel.lab.protocol import copy_template
from tests.cli.process import Caller
from tests.files import edit, published_study

SETPRIV = shutil.which("setpriv")
TITLE = "κ & 5 % of A_b #1 ± [x] {y} ~ ^"
FORMATS = ("html", "markdown", "latex", "docx")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The published study with a hostile title, asking for all formats."""
    title = f"title = {msgspec.json.encode(TITLE).decode()}"
    sections = f'sections = ["design", "grades", "methods"]\nformats = {list(FORMATS)}'
    root = tmp_path_factory.mktemp("formats") / "study"
    return published_study(root, f"\n[report]\n{title}\n{sections}\n")


@pytest.fixture(scope="module")
def folder(study: Path) -> Path:
    build(study, study / "report", {})
    return study / "report"


def build(study: Path, folder: Path, variables: dict[str, str], *options: str) -> None:
    call = [sys.executable, "-m", "masrel", "report", str(study), "-o", str(folder)]
    cache = ["--cache", f"{folder}-cache"]
    environment = {**os.environ, **variables}
    subprocess.run(
        [*call, *cache, *options], env=environment, check=True, capture_output=True
    )


def test_every_format_has_the_same_tables_and_figures(folder: Path) -> None:
    latex = (folder / "report.tex").read_text(encoding="utf-8")
    word = docx.Document(str(folder / "report.docx"))
    n_tables = len(list((folder / "tables").iterdir()))
    figures = list((folder / "figures").glob("*.png"))
    assert n_tables > 2
    assert figures
    assert latex.count("\\begin{longtable}") == len(word.tables) == n_tables
    n_figures = len(figures)
    assert latex.count("\\includegraphics") == len(word.inline_shapes) == n_figures
    assert all(f"{{figures/{file.name}}}" in latex for file in figures)
    # headings, captions, heads of tables and texts for pictures
    styles = Counter(paragraph.style.name for paragraph in word.paragraphs)
    assert styles["Heading 1"] == 4
    assert styles["Table Caption"] + styles["Image Caption"] == n_tables + n_figures
    assert all(len(s._inline.docPr.get("descr")) > 30 for s in word.inline_shapes)
    assert all("w:tblHeader" in table.rows[0]._tr.xml for table in word.tables)
    # the title is escaped
    assert word.paragraphs[0].text == TITLE
    title = r"\(\kappa\) \& 5 \% of A\_b \#1 \(\pm\) "
    assert title in " ".join(latex.split())
    manifest = msgspec.json.decode((folder / "manifest.json").read_bytes())
    assert re.fullmatch(r"[\d.]+", manifest["pandoc"])


def test_without_pandoc_its_formats_are_refused_in_a_sentence(
    study: Path, tmp_path: Path
) -> None:
    # an interpreter whose packages are all but pandoc's
    packages = tmp_path / "packages"
    packages.mkdir()
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if not entry.name.startswith("pypandoc"):
            (packages / entry.name).symlink_to(entry)
    root = Path(masrel.__file__).parents[1]
    call = ["-S", "-m", "masrel", "report", str(study), "-o", str(tmp_path / "out")]
    python_path = os.pathsep.join(map(str, (root, packages)))
    done = subprocess.run(
        [sys.executable, *call],
        env={**os.environ, "PYTHONPATH": python_path, "PATH": ""},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == (
        "masrel: latex and docx: need pandoc; install it with: pip install "
        "'masrel[docx]'\n"
    )
    assert not (tmp_path / "out").exists()


def test_a_pandoc_that_fails_is_said_in_a_sentence(study: Path, tmp_path: Path) -> None:
    old = tmp_path / "pandoc"
    old.write_text(
        "#!/bin/sh\n[ $1 = --version ] && echo pandoc 1.9 || { echo no >&2; exit 6; }\n"
    )
    old.chmod(0o755)
    # a process of its own: which pandoc it was is found once a process
    call = [
        "-m",
        "masrel",
        "report",
        study,
        "-o",
        tmp_path / "out",
        "--format",
        "latex",
    ]
    done = subprocess.run(
        [sys.executable, *call],
        env={**os.environ, "PYPANDOC_PANDOC": str(old)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].endswith(f"3.0 or newer; {old} ended with: no")


def test_tables_too_wide_for_paper_are_in_parts(tmp_path: Path) -> None:
    root = tmp_path / "study"
    copy_template("hess2012", root)
    names = [f"rater {nth} of the north" for nth in range(1, 9)]
    for file in ("protocol.toml", "ratings/published.csv"):
        text = (root / file).read_text(encoding="utf-8")
        for nth, name in enumerate(names, start=1):
            text = re.sub(rf"\bR{nth}\b", name.replace(" ", "_"), text)
        (root / file).write_text(text, encoding="utf-8")
    build(root, tmp_path / "report", {}, "--format", "docx", "--only", "grades")
    word = docx.Document(str(tmp_path / "report" / "report.docx"))
    heads = [[cell.text for cell in table.rows[0].cells] for table in word.tables]
    assert len(heads) > 1
    assert all(head[0] == "Model" for head in heads)
    raters = [name for head in heads for name in head if name.startswith("rater")]
    assert len(raters) == 8


@pytest.fixture(scope="module")
def every_section(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("sections") / "study"
    copy_template("hess2012", root)
    protocol = root / "protocol.toml"
    text = protocol.read_text(encoding="utf-8")
    title = f"title = {msgspec.json.encode(TITLE).decode()}"
    protocol.write_text(re.sub(r"(?m)^title = .*$", lambda _: title, text), "utf-8")
    build(root, root / "report", {}, "--format", "latex")
    return root / "report"


ENGINES = [
    pytest.param(
        engine,
        marks=pytest.mark.skipif(shutil.which(engine) is None, reason="not installed"),
    )
    for engine in ("pdflatex", "lualatex")
]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_latex_of_every_section_fits_its_page(every_section: Path, engine: str) -> None:
    done = subprocess.run(
        [engine, "-halt-on-error", "-interaction=nonstopmode", "report.tex"],
        cwd=every_section, capture_output=True, check=False,
    )  # fmt: skip
    log = done.stdout.decode("utf-8", "replace")
    assert done.returncode == 0, log[-2000:]
    assert "Overfull" not in log
    assert "Missing character" not in log


def test_a_format_that_is_not_made_again_goes(
    masrel: Caller, study: Path, tmp_path: Path
) -> None:
    root = tmp_path / "study"
    shutil.copytree(study, root)
    edit(root / "protocol.toml", f"formats = {list(FORMATS)}", 'formats = ["html"]')
    done = masrel("report", root, "--format", "latex", "--quiet")
    assert done.code == 0, done.err
    pages = [root / "report" / name for name in ("report.html", "report.tex")]
    assert done.out.split() == [str(page) for page in pages]
    assert not (root / "report" / "report.docx").exists()
    assert masrel("report", root, "--check", "--quiet").code == 1
    masrel("report", root, "--quiet")
    assert [page.exists() for page in pages] == [True, False]
    assert masrel("report", root, "--check", "--quiet").code == 0


@pytest.mark.slow
@pytest.mark.skipif(SETPRIV is None, reason="nothing here takes root's privileges")
def test_a_foreign_environment_changes_no_byte_and_is_not_written_to(
    study: Path, folder: Path, tmp_path: Path
) -> None:
    package = tmp_path / "site" / "masrel"
    shutil.copytree(
        Path(masrel.__file__).parent, package, ignore=shutil.ignore_patterns("*.pyc")
    )
    for path in (package.parent, *package.parent.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    # root itself may write anywhere but without this capability
    bare = [str(SETPRIV), "--bounding-set=-dac_override", "--inh-caps=-dac_override"]
    probe = subprocess.run([*bare, "touch", package / "written"], check=False)
    assert probe.returncode != 0
    settings = tmp_path / "matplotlibrc"
    templates = tmp_path / "pandoc" / "templates"
    templates.mkdir(parents=True)
    (templates / "default.latex").write_text("mine")
    settings.write_text("font.size: 30\nsavefig.dpi: 30\nsvg.fonttype: path\n")
    environment = os.environ | {
        "LANG": "de_DE.UTF-8",
        "LC_ALL": "C",
        "TZ": "Asia/Seoul",
        "HOME": str(tmp_path),
        "XDG_DATA_HOME": str(tmp_path),
        "MPLBACKEND": "module://matplotlib_inline.backend_inline",
        "MATPLOTLIBRC": str(settings),
        "PYTHONHASHSEED": "7",
        "PYTHONPATH": str(package.parent),
    }
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    other = tmp_path / "other"
    call = ["-P", "-m", "masrel", "report", str(study), "-o", str(other)]
    call += ["--cache", str(tmp_path / "cache")]
    subprocess.run(
        [*bare, "sh", "-c", 'umask 077; exec "$@"', "sh", sys.executable, *call],
        env=environment, check=True, capture_output=True,
    )  # fmt: skip
    made, expected = (
        {f.relative_to(of): f.read_bytes() for f in of.rglob("*") if f.is_file()}
        for of in (other, folder)
    )
    assert len(made) > 8
    assert made == expected
    assert stat.S_IMODE((other / "report.html").stat().st_mode) == 0o600
