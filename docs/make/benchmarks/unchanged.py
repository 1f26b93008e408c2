"""``masrel report`` where nothing has changed, beside ``doit`` and as many files.

``python -m docs.make.benchmarks.unchanged [--quick]`` writes its part of
``docs/evidence/benchmarks.md``. Times are processor seconds of processes, turn by turn.
"""

import argparse
import importlib.metadata
import json
import platform
import statistics
import sys
import tempfile
from pathlib import Path

import masrel
from docs.make.benchmarks.parts import write_part
from docs.make.benchmarks.verification import processor_s
from masrel.lab.protocol import copy_template

DOCS = Path(__file__).parents[2]
TURNS = 21
# One task that has copied inputs to outputs, and has nothing left to do
TASKS = """
import json, pathlib
names = json.loads(pathlib.Path("names.json").read_text())
def task_report():
    return {"file_dep": names["in"], "targets": names["out"], "actions": ["true"]}
"""


def files_read(study: Path) -> list[Path]:
    """The files of a study, each of which its report may be made from."""
    outputs = (study / ".masrel_cache", study / "report")
    files = [path for path in sorted(study.rglob("*")) if path.is_file()]
    return [p for p in files if not any(p.is_relative_to(of) for of in outputs)]


def tasks(folder: Path, read: list[Path], written: list[Path]) -> None:
    """A folder in which doit has done a task with copies of these files."""
    names: dict[str, list[str]] = {"in": [], "out": []}
    for kind, files in (("in", read), ("out", written)):
        (folder / kind).mkdir(parents=True)
        for number, file in enumerate(path for path in files if path.is_file()):
            copy = folder / kind / str(number)
            copy.write_bytes(file.read_bytes())
            names[kind].append(f"{kind}/{number}")
    (folder / "names.json").write_text(json.dumps(names))
    (folder / "dodo.py").write_text(TASKS)


def row(name: str, study: Path, turns: int) -> str:
    """A line of the table: one study, unchanged."""
    report = (sys.executable, "-m", "masrel", "report", str(study), "--quiet")
    cold = processor_s(*report)
    written = [path for path in (study / "report").rglob("*") if path.is_file()]
    read = files_read(study)
    tasks(study.with_suffix(".tasks"), read, written)
    file = study.with_suffix(".tasks") / "dodo.py"
    doit = (sys.executable, "-m", "doit", "-f", str(file))
    for command in (report, doit):
        processor_s(*command)
    seconds = [(processor_s(*report), processor_s(*doit)) for _ in range(turns)]
    ours, theirs = (statistics.median(each) for each in zip(*seconds, strict=True))
    ratios = [one / other for one, other in seconds]
    low, middle, high = statistics.quantiles(ratios, n=4)
    cells = (
        f"{name}: {len(read)} files read, {len(written)} written",
        f"{cold:.2f} s",
        f"{ours:.3f} s",
        f"{theirs:.3f} s",
        f"{middle:.2f} ± {(high - low) / 2:.2f}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Make the studies, measure, and write the part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few turns, no page")
    turns = 5 if (quick := parser.parse_args().quick) else TURNS
    with tempfile.TemporaryDirectory() as folder:
        published = Path(folder).resolve() / "published"
        copy_template("hess2012", published)
        rows = [row("published", published, turns)]
        made = Path(folder).resolve() / "demo"
        demo = (sys.executable, "-m", "masrel", "demo", str(made), "--quiet")
        processor_s(*demo, "--study", "hess2012")
        rows.append(row("the demo's", made / "study", turns))
    print("\n".join(rows))
    if quick:
        return
    lines = [
        "## A report that is current",
        "",
        "`python -m docs.make.benchmarks.unchanged` repeats this part: `masrel report "
        "STUDY` again where nothing has changed, beside `doit` with one task that is "
        "up to date and has as many files to read and as many written, each a process "
        f"of its own, in turn; medians of {turns} turns of processor time, ± is half "
        "the distance of the quartiles of the ratios. masrel hashes every file of "
        "the study and of the report, and its own code; doit looks at sizes and times "
        "of those read.",
        "",
        f"{platform.machine()}, Python {platform.python_version()}; "
        f"masrel {masrel.__version__}, doit {importlib.metadata.version('doit')}.",
        "",
        "| study | first build | unchanged | doit | ratio |",
        "|---|---|---|---|---|",
        *rows,
    ]
    write_part(DOCS / "evidence/benchmarks.md", "unchanged", lines)


if __name__ == "__main__":
    main()
