"""``masrel spans``: whether observers mark the same parts of texts or recordings."""

from collections import Counter
from hashlib import sha256
from pathlib import Path

import click

from masrel._input import refuse
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    call_text,
    grouped,
    level_option,
    output_options,
    write_output,
)
from masrel.cli._paths import InputFile
from masrel.ratings._findings import Reading


@click.command("spans", cls=GroupedHelp)
@click.argument("file", type=InputFile(exists=True, path_type=Path))
@click.option(
    "--document",
    metavar="COL",
    help="Column of the documents. Without it there is one document.",
)
@click.option("--observer", metavar="COL", help="Column of the observers.")
@click.option(
    "--label",
    metavar="COL",
    help="Column of the labels; an empty label means that nothing was found.",
)
@click.option("--begin", metavar="COL", help="Column of the place where a span begins.")
@click.option("--end", metavar="COL", help="Column of the first place after a span.")
@click.option("--length", metavar="COL", help="Column of the lengths of documents.")
@click.option("--text", metavar="COL", help="Column of the texts, instead of lengths.")
@grouped(
    "reading",
    Reading,
    click.option("--delimiter", default="auto", metavar="CHAR", help="Separator."),
    click.option("--encoding", metavar="NAME", help="Encoding of the text."),
    click.option("--sheet", metavar="NAME", help="Sheet of a workbook."),
    click.option(
        "--from",
        "source",
        type=click.Choice(["label-studio"]),
        help="Tool that exported the file; a folder is read as brat's.",
    ),
)
@click.option(
    "--step",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Unit of places, such as 0.001 to count seconds in milliseconds.",
)
@level_option
@click.option(
    "--show",
    metavar="DOCUMENT",
    help="Document to draw. Default: the one with most spans.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints '
    "nothing else.",
    figure="Draw the spans of a document to this .png, .svg or .pdf file.",
    html="Write a self-contained page.",
    csv="Print the table as CSV, with all digits.",
    latex="Print the table as LaTeX.",
)
def spans(
    file: Path,
    reading: Reading,
    step: float | None,
    level: float,
    show: str | None,
    output: OutputOptions,
    **columns: str | None,
) -> None:
    """Measure how well observers agree on the spans in FILE.

    FILE is a table with one row per span, an export of Label Studio (--from), or a
    folder of brat with one folder per annotator. Krippendorff's unitizing alpha is for
    all observers together, F1 for every two.
    """
    from masrel.analysis._file_estimates import placed
    from masrel.analysis._file_spans import span_answer
    from masrel.pages._answer_page import spans_page
    from masrel.plots._drawn_values import Drawn
    from masrel.ratings._reader import read_spans
    from masrel.tables._answer_tables import answer_documents, answer_table

    rows, lengths, off = read_spans(file, reading, columns, step)
    with placed(str(file)):
        answer = span_answer(rows, lengths, off, level)
    table = answer_table(
        answer,
        bands=None,
        detail="brief",
        items="documents",
        in_sentences=False,
        data="foreign",
    )
    n_spans = Counter(row[0] for row in rows if row[2])
    chosen = show or max(n_spans, key=n_spans.__getitem__, default=None)
    refuse(
        (chosen not in n_spans, f"{file}: needs a document with spans, got {chosen}")
    )
    drawn = Drawn(
        "masrel.plots._spans_figure:spans_picture",
        (
            [row[1:] for row in rows if row[0] == chosen],
            lengths.get(f"{chosen}"),
            chosen,
        ),
    )
    digest = sha256(
        b"".join(of.read_bytes() for of in sorted(file.rglob("*.ann")) or [file])
    ).hexdigest()
    write_output(
        output,
        document=lambda: {
            "file": str(file),
            "sha256": digest,
            "options": {"step": step, "level": level, **reading.record(), **columns},
            "notes": [*answer.notes],
            "estimates": answer_documents(answer, None),
        },
        text=lambda: table,
        figure=lambda: drawn,
        html=lambda: spans_page(
            table, drawn, {"Command": call_text(), f"SHA-256 of {file.name}": digest}
        ),
        notes=answer.notes,
        width=88,
    )
