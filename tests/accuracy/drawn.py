"""Hard tables at random, for property tests."""

from hypothesis import strategies as st

from tests.accuracy.cases import METRICS, MOST, WEIGHTS, Case

# as many small counts as large ones, and large ones next to powers of ten
counts = (
    st.integers(0, 5)
    | st.integers(0, 15).map(lambda digits: 10**digits)
    | st.integers(0, MOST)
    | st.integers(MOST - 3, MOST)
)
values = st.sampled_from([0, 0.1, 0.5, 1, 1.5, 2, 3, 7, 10, 100, -1])


@st.composite
def scales(draw: st.DrawFn, n: int) -> tuple[float, ...]:
    """Draw 1 to n, or values at unequal distances, some of which weights do not fit."""
    if draw(st.booleans()):
        return tuple(range(1, n + 1))
    met = draw(st.lists(values, min_size=n, max_size=n, unique=True))
    return tuple(sorted(met))


def _case(draw: st.DrawFn, n_categories: int, **ratings: object) -> Case:
    return Case(
        group="drawn",
        name="drawn",
        n_categories=n_categories,
        values=draw(scales(n_categories)),
        **ratings,  # type: ignore[arg-type]
    )


@st.composite
def tables(draw: st.DrawFn) -> Case:
    """Two raters' tables with cells from 0 to the largest."""
    q = draw(st.integers(1, 4))
    row = st.lists(counts, min_size=q, max_size=q)
    return _case(draw, q, table=draw(st.lists(row, min_size=q, max_size=q)))


@st.composite
def tables_near_zero(draw: st.DrawFn) -> Case:
    """Four cells that are nearly alike: coefficients within 1e-12 of 0 and below."""
    most = draw(st.integers(10, MOST - 10))
    a, b, c, d = draw(st.lists(st.integers(-3, 3), min_size=4, max_size=4))
    return _case(draw, 2, table=[[most + a, most + b], [most + c, most + d]])


@st.composite
def tables_near_one(draw: st.DrawFn) -> Case:
    """A diagonal that outweighs the rest, with p_e near 1 where only one cell does."""
    q = draw(st.integers(2, 3))
    rest = st.integers(0, 2)
    most = st.integers(10**6, MOST) | rest
    table = [[draw(most if k == m else rest) for m in range(q)] for k in range(q)]
    return _case(draw, q, table=table)


@st.composite
def counted(draw: st.DrawFn) -> Case:
    """Items of any number of raters, from none to four million."""
    # of more an item alone outweighs all others beyond the digits of a float
    q = draw(st.integers(1, 4))
    some = st.integers(0, 5) | st.integers(0, 6).map(lambda digits: 10**digits)
    row = st.lists(some | st.integers(0, 10**6), min_size=q, max_size=q)
    return _case(draw, q, counts=draw(st.lists(row, min_size=1, max_size=5)))


@st.composite
def rated(draw: st.DrawFn) -> Case:
    """Two to four raters with gaps; an item may occur a hundred thousand times."""
    q, r = draw(st.integers(1, 4)), draw(st.integers(2, 4))
    code = st.integers(0, q - 1)
    if draw(st.booleans()):
        code = code | st.none()
    row = st.tuples(*[code] * r)
    times = st.sampled_from([1, 1, 2, 3, 7, 1000, 100_000])
    rows = draw(st.lists(st.tuples(row, times), min_size=1, max_size=6))
    return _case(draw, q, rows=rows)


weights = st.sampled_from([*WEIGHTS, *METRICS])
