"""Tables of ratings at random: gaps, rare categories, text and numbers."""

from dataclasses import dataclass

from tests.golden.call import Stream

N_TABLES = 500

LABELS = (["no", "yes"], ["a", "b", "c"], ["0", "1", "1+", "2"], list("VWXYZ"))
NUMBERS = ([0, 1], [1, 2, 4], [0.0, 0.5, 1.0, 3.0], [1, 2, 3, 4, 5])


@dataclass(frozen=True, slots=True)
class Drawn:
    """A table of ratings, or of counts of raters."""

    rows: list[list[object]]
    categories: list | None
    is_counts: bool

    @property
    def pairs(self) -> list[list[list[object]]]:
        """Every second rater as the retest of the one before."""
        n_pairs = len(self.rows[0]) // 2
        return [[row[2 * k : 2 * k + 2] for row in self.rows] for k in range(n_pairs)]


def drawn(seed: int) -> Drawn:
    """Table `seed` of the set; every fifth is of counts."""
    stream = Stream(f"table {seed}")
    of = (NUMBERS if seed % 2 else LABELS)[stream.below(4)]
    n_items = 1 + stream.below(40 if stream.chance(0.6) else 8)
    shares = shares_of(stream, len(of))
    if seed % 5 == 4:
        return Drawn(_counts(stream, n_items, shares), None, True)
    gaps = stream.uniform(0.05, 0.4) if stream.chance(0.4) else 0.0
    n_raters = 2 + (0 if stream.chance(0.3) else stream.below(5))
    faithful = stream.one_of([0.2, 0.5, 0.7, 0.9, 1.0])
    rows = [
        _row(stream, of, shares, (n_raters, faithful, gaps)) for _ in range(n_items)
    ]
    return Drawn(
        rows, list(of) if stream.chance(0.4 if seed % 2 else 0.8) else None, False
    )


def shares_of(stream: Stream, n: int) -> list[float]:
    # how often each category is the true one; one in three tables is very uneven
    power = 6.0 if stream.chance(0.33) else 1.0
    parts = [stream.uniform(0.05, 1.0) ** power for _ in range(n)]
    return [part / sum(parts) for part in parts]


def pick(stream: Stream, shares: list[float]) -> int:
    left = stream.uniform(0.0, 1.0)
    for k, share in enumerate(shares[:-1]):
        left -= share
        if left < 0.0:
            return k
    return len(shares) - 1


def _row(
    stream: Stream, of: list, shares: list[float], raters: tuple[int, float, float]
) -> list[object]:
    n_raters, faithful, gaps = raters
    truth = pick(stream, shares)
    row = []
    for _ in range(n_raters):
        k = truth if stream.chance(faithful) else pick(stream, shares)
        row.append(None if stream.chance(gaps) else of[k])
    return row


def _counts(stream: Stream, n_items: int, shares: list[float]) -> list[list[object]]:
    # raters in each category; half of the tables have items of fewer raters
    n_raters, ragged = 2 + stream.below(5), stream.chance(0.5)
    rows = []
    for _ in range(n_items):
        n = 1 + stream.below(n_raters) if ragged else n_raters
        truth, row = pick(stream, shares), [0] * len(shares)
        for _ in range(n):
            row[truth if stream.chance(0.6) else pick(stream, shares)] += 1
        rows.append(row)
    return rows
