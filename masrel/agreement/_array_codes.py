"""Arrays and frames of labels as codes: positions in the scale."""

import contextlib
import itertools
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._labels import (
    Codes,
    Label,
    check_categories,
    code_type,
    is_missing,
    labels_met,
    lookup,
    sets_as_text,
)
from masrel.errors import RatingsError

Array = NDArray[Any]
_Coder = Callable[[Array], Array]

_BLOCK = 1 << 16  # labels coded at once, so that they stay in the cache
_MANY_LABELS = 4096  # in the first block, from which on all are sorted
_WIDEST = 1 << 16  # span of whole numbers for which a table of codes is made


def array_codes(
    labels: Array, declared: tuple[Label, ...] | None
) -> tuple[Codes, tuple[Label, ...]]:
    """Turn an array of labels into codes."""
    # Takes labels (n_items, n_raters)
    kind = labels.dtype.kind
    is_text = declared is not None and isinstance(declared[0], str)
    is_other = declared is not None and is_text != (kind == "U")
    if kind not in "iufU" or is_other or (kind == "f" and _has_giant(declared)):
        return _object_codes(labels, declared)
    plain = _plain(labels)
    if declared is not None:
        return _codes(labels, plain, declared), declared
    # As a rule the first block has every label: the rest is then read only once.
    first = plain[next(_blocks(plain))]
    known = _labels_met(first, labels.dtype)
    if len(known) > _MANY_LABELS:
        return _sorted_codes(labels)
    try:
        return _codes(labels, plain, known), known
    except RatingsError:
        known = _labels_met(plain, labels.dtype)
        return _codes(labels, plain, known), known


def _has_giant(declared: tuple[Label, ...] | None) -> bool:
    # a whole number that no float holds
    return declared is not None and any(
        isinstance(label, int) and abs(label) > sys.float_info.max for label in declared
    )


def _sorted_codes(labels: Array) -> tuple[Codes, tuple[Label, ...]]:
    # so many labels that sorting all ratings is the fastest way to number them
    flat = labels.ravel()
    met, codes = np.unique(flat, return_inverse=True)
    codes = codes.astype(code_type(met.size)).reshape(labels.shape)
    if met.dtype.kind == "f" and met.size and np.isnan(met[-1]):
        codes[codes == met.size - 1] = _MISSING
        met = met[:-1]
    return codes, tuple(met.tolist())


def _codes(labels: Array, plain: Array, known: tuple[Label, ...]) -> Codes:
    codes = np.empty(labels.shape, dtype=code_type(len(known)))
    coder = _coder(plain, labels.dtype, known)
    for rows in _blocks(labels):
        codes[rows] = coder(plain[rows])
        if codes[rows].min() == _UNKNOWN:
            i, j = np.argwhere(codes[rows] == _UNKNOWN)[0].tolist()
            position: dict[object, int] = dict.fromkeys(known, 0)
            lookup(labels[rows][i, j].item(), position, rows.start + i, j)
    return codes


def _blocks(labels: Array) -> Iterator[slice]:
    rows = max(1, _BLOCK // labels.shape[1])
    for start in range(0, len(labels), rows):
        yield slice(start, min(start + rows, len(labels)))


def _plain(labels: Array) -> Array:
    # Text of one or two letters is compared as whole numbers, many times faster.
    if labels.dtype.kind == "U" and labels.dtype.itemsize in (4, 8):
        whole = np.uint32 if labels.dtype.itemsize == 4 else np.uint64
        return np.ascontiguousarray(labels).view(whole)
    return labels


def _labels_met(plain: Array, dtype: np.dtype[Any]) -> tuple[Label, ...]:
    if dtype.kind in "iu" and (span := _span(plain)) is not None:
        return _whole_numbers_met(plain, *span)
    met = np.empty(0, dtype=plain.dtype)
    for rows in _blocks(plain):
        block = plain[rows]
        if met.size:
            at = np.minimum(np.searchsorted(met, block), met.size - 1)
            block = block[met[at] != block]
        if block.size:
            met = np.union1d(met, block)
            if met.dtype.kind == "f":
                met = met[~np.isnan(met)]
    if dtype.kind == "U" and met.dtype.kind == "u":
        met = met.view(dtype)
    return tuple(sorted(met.tolist()))


def _span(plain: Array) -> tuple[int, int] | None:
    # least and greatest whole number, if a table can have a place for each between
    lowest, highest = int(plain.min()), int(plain.max())
    return (lowest, highest) if highest - lowest < _WIDEST else None


def _whole_numbers_met(plain: Array, lowest: int, highest: int) -> tuple[Label, ...]:
    met = np.zeros(highest - lowest + 1, dtype=bool)
    for rows in _blocks(plain):
        met[_offsets(plain[rows], lowest)] = True
        if met.all():  # as a rule after the first block
            break
    return tuple(lowest + place for place in np.flatnonzero(met).tolist())


def _offsets(block: Array, lowest: int) -> Array:
    # block - lowest, which need not fit the small integers of the block
    if block.dtype.kind == "u":
        offsets: Array = block - block.dtype.type(lowest)
        return offsets
    return np.subtract(block, lowest, dtype=np.int64)


def _coder(plain: Array, dtype: np.dtype[Any], known: tuple[Label, ...]) -> _Coder:
    # a function of a block of labels to its codes
    if dtype.kind in "iu" and (span := _span(plain)) is not None:
        return _table_coder(*span, known)
    if not known:
        return lambda block: np.full(block.shape, _MISSING)
    if dtype.kind == "f":
        return _float_coder(np.array(known, dtype=np.float64))
    # a label that the type of the array cannot hold is not in it
    if dtype.kind == "U":
        fits = [len(str(label)) * 4 <= dtype.itemsize for label in known]
    else:
        held = np.iinfo(dtype)
        fits = [_is_whole(label, int(held.min), int(held.max)) for label in known]
    codes = np.flatnonzero(fits)
    fitting = [known[code] for code in codes.tolist()]
    if dtype.kind == "U":
        values = np.array(fitting, dtype=dtype)
        values = values.view(plain.dtype) if plain.dtype.kind == "u" else values
    else:
        values = np.array([int(label) for label in fitting], dtype=dtype)
    order = np.argsort(values, kind="stable")
    return _search_coder(values[order], codes[order])


def _is_whole(label: Label, lowest: int, highest: int) -> bool:
    # as it is and not as a float, which large integers do not fit
    number = label if isinstance(label, int) else float(label)
    return lowest <= number <= highest and number == int(number)


def _table_coder(lowest: int, highest: int, known: tuple[Label, ...]) -> _Coder:
    table = np.full(highest - lowest + 1, _UNKNOWN, dtype=code_type(len(known)))
    for code, label in enumerate(known):
        if _is_whole(label, lowest, highest):
            table[int(label) - lowest] = code
    if (table == np.arange(table.size)).all():
        if table.dtype == np.int8:  # modulo 256 the small difference stays what it is
            low = np.int64(lowest).astype(np.int8)
            return lambda block: np.subtract(block.astype(np.int8), low)
        return lambda block: _offsets(block, lowest)
    return lambda block: table[_offsets(block, lowest)]


def _float_coder(known: Array) -> _Coder:
    order = np.argsort(known)
    slow = _search_coder(known[order], order)
    if (np.abs(known) > 2**53).any():  # also infinite: no table
        return slow
    lowest, span = known[order[0]], known[order[-1]] - known[order[0]]
    if not (span < _WIDEST and (known == np.floor(known)).all()):
        return slow
    table = np.full(int(span) + 1, _UNKNOWN, dtype=code_type(len(known)))
    table[(known - lowest).astype(np.intp)] = np.arange(len(known))

    def coder(block: Array) -> Array:
        absent = np.isnan(block)
        place = np.where(absent, 0.0, block - lowest)
        with np.errstate(invalid="ignore"):  # infinite, or beyond whole numbers
            whole = place.astype(np.intp)
        if (whole != place).any() or whole.min() < 0 or whole.max() > span:
            return slow(block)
        return np.where(absent, _MISSING, table[whole])

    return coder


def _search_coder(values: Array, codes: NDArray[np.intp]) -> _Coder:
    def coder(block: Array) -> Array:
        at = np.minimum(np.searchsorted(values, block), values.size - 1)
        result = np.where(values[at] == block, codes[at], _UNKNOWN)
        if block.dtype.kind == "f":
            result[np.isnan(block)] = _MISSING
        return result

    if values.size == 0:
        return lambda block: np.full(block.shape, _UNKNOWN)
    return coder


def _object_codes(
    labels: Array, declared: tuple[Label, ...] | None
) -> tuple[Codes, tuple[Label, ...]]:
    rows, known = labels.tolist(), declared
    if known is None:
        with contextlib.suppress(RatingsError):
            known = labels_met(itertools.chain.from_iterable(rows))
    if known is None:
        rows, known = sets_as_text(rows)
    flat = list(itertools.chain.from_iterable(rows))
    position: dict[object, int] = {label: code for code, label in enumerate(known)}
    position[None] = _MISSING
    try:
        codes = [position[label] for label in flat]
    except (KeyError, TypeError):  # nan, or a label of no category
        width = labels.shape[1]
        codes = [
            _MISSING
            if is_missing(label)
            else lookup(label, position, *divmod(i, width))
            for i, label in enumerate(flat)
        ]
    return np.array(codes, dtype=code_type(len(known))).reshape(labels.shape), known


_MISSING, _UNKNOWN = -1, -2


def frame_codes(
    frame: Any, declared: tuple[Label, ...] | None
) -> tuple[Codes, tuple[Label, ...], bool]:
    """Turn a DataFrame of labels into codes, without importing pandas."""
    # Takes frame (n_items, n_raters)
    if len(frame.shape) != 2:
        raise RatingsError(
            "ratings: needs two dimensions (items, raters), got shape "
            f"{' × '.join(map(str, frame.shape))}"
        )
    if 0 in frame.shape:
        raise RatingsError(
            "ratings: needs at least one item and one rater, got shape "
            f"{frame.shape[0]} × {frame.shape[1]}"
        )
    if not hasattr(frame, "iloc"):  # not pandas, whose own types are told apart here
        codes, known = array_codes(np.asarray(frame.to_numpy()), declared)
        return codes, known, declared is not None
    if all(hasattr(dtype, "categories") for dtype in frame.dtypes):
        return _categorical_codes(frame, declared)
    plain = all(isinstance(d, np.dtype) and d.kind in "iuf" for d in frame.dtypes)
    codes, known = array_codes(frame.to_numpy(None if plain else object), declared)
    return codes, known, declared is not None


def _categorical_codes(
    frame: Any, declared: tuple[Label, ...] | None
) -> tuple[Codes, tuple[Label, ...], bool]:
    columns = [frame.iloc[:, j].array for j in range(frame.shape[1])]
    of_columns = [column.categories.tolist() for column in columns]
    ordered = all(column.ordered for column in columns)
    if declared is None and ordered and all(c == of_columns[0] for c in of_columns):
        declared = check_categories(of_columns[0])
    known = declared
    if known is None:
        # categories nobody was given are not labels met
        known = labels_met(
            labels[code]
            for column, labels in zip(columns, of_columns, strict=True)
            for code in np.unique(column.codes[column.codes >= 0]).tolist()
        )
    position: dict[object, int] = {label: code for code, label in enumerate(known)}
    codes = np.empty(frame.shape, dtype=code_type(len(known)))
    for j, (column, labels) in enumerate(zip(columns, of_columns, strict=True)):
        table = [position.get(label, _UNKNOWN) for label in labels] + [_MISSING]
        codes[:, j] = np.array(table)[column.codes]
        if codes[:, j].min() == _UNKNOWN:
            i = int(np.argmin(codes[:, j]))
            lookup(labels[int(column.codes[i])], position, i, j)
    return codes, known, declared is not None
