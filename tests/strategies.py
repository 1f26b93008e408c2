"""Tables of ratings for property tests."""

from hypothesis import strategies as st

LABELS = ("0", "1", "1+", "2", "3", "4")

Table = list[list[str | None]]


@st.composite
def tables(
    draw: st.DrawFn,
    *,
    n_raters: tuple[int, int] = (2, 6),
    missing: bool = True,
    max_items: int = 12,
) -> Table:
    """Draw some items, 12 at most, by some raters, over 2 to 6 categories."""
    columns = draw(st.integers(*n_raters))
    grades = st.sampled_from(LABELS[: draw(st.integers(2, len(LABELS)))])
    cell = st.none() | grades if missing else grades
    row = st.lists(cell, min_size=columns, max_size=columns)
    return draw(st.lists(row, min_size=1, max_size=max_items))
