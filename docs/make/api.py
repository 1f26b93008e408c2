"""The page of everything that is exported, from ``__all__`` and first lines.

``python -m docs.make.api`` writes ``docs/reference/api.md``.
"""

import ast
import importlib
import inspect
from itertools import pairwise
from pathlib import Path

PAGE = Path(__file__).parents[1] / "reference" / "api.md"
MODULES = (
    "masrel",
    "masrel.agreement",
    "masrel.intervals",
    "masrel.audit",
    "masrel.planning",
    "masrel.judges",
    "masrel.ratings",
    "masrel.plots",
    "masrel.scales",
    "masrel.estimates",
    "masrel.errors",
    "masrel.lab",
    "masrel.lab.elbow",
    "masrel.lab.elbow.tone",
    "masrel.lab.elbow.identification",
    "masrel.lab.hess",
    "masrel.lab.hess.puck",
    "masrel.lab.recording",
)


def page() -> str:
    """Return the page: a table a module, a line a name."""
    lines = [
        "# Everything that is exported",
        "",
        "Made by `python -m docs.make.api` from what each package lists as its own. "
        "`help(name)` has the rest:",
        "parameters with shapes and units, every error, the source of the formula, an "
        "example that runs.",
        "",
        "Other packages of the laboratory serve its commands; their names may change.",
    ]
    for name in MODULES:
        module = importlib.import_module(name)
        constants = _documented_constants(name)
        lines += [
            "",
            f"## {name}",
            "",
            _first_line(module),
            "",
            "| name | |",
            "|---|---|",
        ]
        for entry in sorted(module.__all__, key=str.lower):
            text = constants.get(entry) or _first_line(getattr(module, entry))
            lines.append(f"| `{entry}` | {text.replace('|', chr(92) + '|')} |")
    return "\n".join(lines) + "\n"


def _first_line(thing: object) -> str:
    return (inspect.getdoc(thing) or "").partition("\n")[0]


def _documented_constants(name: str) -> dict[str, str]:
    # A constant has no docstring at run time: the text below its assignment is read.
    file = Path(str(importlib.import_module(name).__file__))
    files = sorted(file.parent.rglob("*.py")) if file.name == "__init__.py" else [file]
    texts = {}
    for source in files:
        body = ast.parse(source.read_text(encoding="utf-8")).body
        for statement, below in pairwise(body):
            match statement, below:
                case (
                    (
                        ast.Assign(targets=[ast.Name(id=target)])
                        | ast.AnnAssign(target=ast.Name(id=target))
                    ),
                    ast.Expr(value=ast.Constant(value=str(text))),
                ):
                    texts[target] = inspect.cleandoc(text).partition("\n")[0]
    return texts


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
