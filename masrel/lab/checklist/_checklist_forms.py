"""A checklist as a page, as Markdown, or as a document of a word processor."""

from collections import Counter
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

from masrel._files import write_file
from masrel.errors import ParameterError
from masrel.lab.checklist._filling import Checklist
from masrel.lab.checklist._guidelines import ChecklistItem, State
from masrel.lab.report._pandoc import converted

_HEADINGS = ("Item", "Asks for", "State", "What the record says", "Files")

_STATES: dict[State, str] = {
    "filled": "filled from the record",
    "in part": "filled in part",
    "authors": "for the authors alone",
}


def write_checklist(checklist: Checklist, path: Path) -> None:
    """Write a checklist as a file whose form its ending says.

    Parameters
    ----------
    checklist : Checklist
        What `fill_checklist` returned.
    path : Path
        A file that ends in ``.html``, ``.md`` or ``.docx``. The same checklist gives
        the same bytes.

    Raises
    ------
    ParameterError
        If the ending is another, the file is a study's primary record, or pandoc
        is needed and is not installed.
    OSError
        If the file cannot be written.
    """
    if path.suffix not in _FORMS:
        raise ParameterError(
            f"output: needed a file that ends in {', '.join(_FORMS)}, got {path}"
        )
    write_file(path, _FORMS[path.suffix](checklist))


def checklist_markdown(checklist: Checklist) -> str:
    """Return a checklist as Markdown.

    Parameters
    ----------
    checklist : Checklist
        What `fill_checklist` returned.

    Returns
    -------
    str
        A section for each item, then the files with their hashes.
    """
    lines = [f"# {_plain(checklist.study)}", ""]
    lines += [f"{_plain(text)}\n" for text in _introduction(checklist)]
    for item in checklist.items:
        lines += [f"## {item.number}. {_plain(item.topic)}", ""]
        lines += [f"*{_STATES[item.state]}*", ""]
        lines += [f"- {_plain(fact)}" for fact in item.facts]
        lines += [f"- **Authors:** {_plain(item.to_add)}"] * bool(item.to_add)
        lines += ["", f"Files: {names}"] if (names := _numbers(checklist, item)) else []
        lines.append("")
    lines += ["## Files", ""]
    lines += [
        f"{number}. {_plain(file)}: `{digest}`"
        for number, (file, digest) in enumerate(checklist.files.items(), start=1)
    ]
    return "\n".join([*lines, "", f"Made by masrel {checklist.masrel_version}.", ""])


_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def _plain(text: str) -> str:
    return " ".join(text.translate(_ESCAPES).split())


def _introduction(checklist: Checklist) -> tuple[str, ...]:
    head = f"{checklist.title}: {checklist.reference}. Topics are in our words."
    return (head, *checklist.notes, _summary(checklist))


def _summary(checklist: Checklist) -> str:
    counts = Counter(item.state for item in checklist.items)
    parts = [f"{counts[state]} {text}" for state, text in _STATES.items()]
    return f"Of {len(checklist.items)} items {', '.join(parts)}."


def _numbers(checklist: Checklist, item: ChecklistItem) -> str:
    # of the files an item names, such as "1, 3-24" where they follow each other
    places = list(checklist.files)
    ranges: list[list[int]] = []
    for number in sorted(places.index(file.as_posix()) + 1 for file in item.sources):
        if ranges and number == ranges[-1][-1] + 1:
            ranges[-1].append(number)
        else:
            ranges.append([number])
    return ", ".join(
        f"{each[0]}–{each[-1]}" if len(each) > 2 else ", ".join(map(str, each))
        for each in ranges
    )


def _html(checklist: Checklist) -> str:
    # Imported here: Markdown loads no templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("masrel.lab.checklist"),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    style = files("masrel.pages").joinpath("templates/page.css")
    return environment.get_template("checklist.html").render(
        list=checklist,
        headings=_HEADINGS,
        summary=_summary(checklist),
        style=style.read_text(encoding="utf-8"),
        files=lambda item: _numbers(checklist, item),
    )


_FORMS: dict[str, Callable[[Checklist], str | bytes]] = {
    ".html": _html,
    ".md": checklist_markdown,
    ".docx": lambda made: converted(checklist_markdown(made), "docx", pictures={}),
}
