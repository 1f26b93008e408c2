"""A note names its rows, unless it holds for all that it could be of."""

from masrel.tables._row_notes import NotedRow, row_notes


def row(title: str, *texts: str, interval: tuple[str, ...] | None = ()) -> NotedRow:
    return NotedRow(title=title, group="", texts=texts, interval_texts=interval)


def test_a_note_of_an_estimate_names_the_rows_that_alone_have_intervals() -> None:
    rows = [row("A", "few raters"), row("B", interval=None)]
    assert row_notes(rows, None) == ("A: few raters.",)


def test_a_note_of_every_interval_names_no_rows() -> None:
    rows = [row("A", interval=("95 % CI",)), row("B", interval=None)]
    assert row_notes(rows, None) == ("95 % CI.",)
    rows = [row("A", interval=("95 % CI",)), row("B")]
    assert row_notes(rows, None) == ("A: 95 % CI.",)


def test_the_same_of_an_estimate_and_of_an_interval_is_two_notes() -> None:
    rows = [row("A", "x"), row("B", interval=("x",)), row("C", interval=("x",))]
    assert row_notes(rows, None) == ("A: x.", "B; C: x.")
