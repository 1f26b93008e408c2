"""Files with faults that programs, people and disks make: an answer or one sentence.

Seeded mutations of the corpus and of files of other shapes never end in a traceback or
a silent guess.
"""

import json
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.cli.process import Caller, Done

DOOR = Path(__file__).parent / "door"
TEXT = (".csv", ".txt", ".dat", ".jsonl")
N_QUICK, N_ALL = 40, 200

PAIRS = "item,Kim,Lee\na,1,2\nb,2,2\nc,1,1\nd,3,3\ne,2,1\n"
ITEMS = {"a": {"Kim": "x", "Lee": "x"}, "b": {"Kim": "y", "Lee": "x"}}


@dataclass(frozen=True, slots=True)
class Base:
    """A file, and how it is read."""

    name: str
    data: bytes
    options: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return " ".join((self.name, *self.options))


def made(name: str, text: str, *options: str) -> Base:
    return Base(name, text.encode(), options)


def corpus() -> list[Base]:
    """Files of the corpus that are text, each read as its first case says."""
    cases = json.loads((DOOR / "cases.json").read_text(encoding="utf-8"))["cases"]
    first = {case["file"]: case["options"] for case in reversed(cases)}
    return [
        Base(name, (DOOR / "files" / name).read_bytes(), tuple(options))
        for name, options in first.items()
        if name.endswith(TEXT)
    ]


BASES = [
    *corpus(),
    made("pairs.csv", PAIRS),
    made(
        "freq.csv", "Kim,Lee,Freq\nu,u,40\nu,v,9\nv,u,0\nv,v,45\n", "--frequency=Freq"
    ),
    made("title.csv", f"Table 1. Tone\n\n{PAIRS}\nSource: ward 4\n", "--skip=2"),
    made("two.csv", f"item,Rater,\n,Kim,Lee\n{PAIRS[13:]}", "--header=1,2"),
    made("steps.csv", 'item,Kim,Lee\na,"1,200",900\nb,700,"1,100"\n', "--thousands=,"),
    made(
        "mm.csv", "item;Kim;Lee\na;5 mm;6 mm\nb;7,5 mm;7 mm\n", "--units", "--decimal=,"
    ),
    made("sets.csv", "item,Kim,Lee\na,x;y,x\nb,y,y\nc,x,x;y\n", "--metric=jaccard"),
    made("bars.csv", "item,Kim,Lee\na,x|y,x\nb,y,y\n", "--set-separator=|"),
    made("spans.csv", "doc,rater,start,end,label\nd,K,0,5,P\nd,L,0,5,P\nd,K,9,12,Q\n"),
    made(
        "criteria.csv",
        "item,a_Kim,a_Lee,b_Kim,b_Lee\n1,1,2,5,5\n2,2,2,4,5\n3,1,1,4,4\n",
    ),
    made("sides.csv", ",Lee u,Lee v\nKim u,5,1\nKim v,2,4\n", "--table"),
    made("long.csv", "item,rater,grade\na,Kim,1\na,Lee,2\nb,Kim,1\nb,Lee,1\n"),
    made("one.csv", "item,n\na,1\nb,2\n"),
    made("items.json", json.dumps(ITEMS)),
    made(
        "list.json",
        json.dumps(
            [
                {
                    "id": k,
                    "annotations": [
                        {"annotator": r, "label": g} for r, g in of.items()
                    ],
                }
                for k, of in ITEMS.items()
            ]
        ),
    ),
]

# ---- what changes a file ----

BITS = [
    *(b",", b";", b"\t", b'"', b"'", b"\n", b"\r", b"\0", b" ", b"#", b"%", b"{", b"]"),
    *(b"NA", b"?", b"99", b"-9", b"nan", b"inf", b"1e999", b"0x1", b"1,5", b"1.234"),
    *(
        b"\xff",
        b"\xc3\xa9",
        b"\xe2\x80\x8b",
        b"=1+1",
        b"null",
        b"TRUE",
        b"total",
        b"5 mm",
    ),
]
COLUMNS = "gold majority notes Freq agree conf Mean Lee n start total".split()
MORE = [
    *([], [], [], ["--transpose"], ["--no-header"], ["--counts"], ["--no-item"]),
    *(["--stream"], ["--table"], ["--target", "items"], ["--explain"], ["--units"]),
    *(["--each-category"], ["--by", "site"], ["--repeated", "first"], ["--skip", "1"]),
]
Mutate = Callable[[bytes, random.Random], bytes]


def lines_of(data: bytes) -> list[bytes]:
    return data.splitlines(keepends=True) or [b""]


def flipped(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data) + 1)
    return data[:place] + bytes([rng.randrange(256)]) + data[place + 1 :]


def shorter(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data) + 1)
    return data[:place] + data[place + rng.choice([1, 1, 2, 9]) :]


def longer(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data) + 1)
    return data[:place] + rng.choice(BITS) + data[place:]


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def with_lines(data: bytes, rng: random.Random) -> bytes:
    """A line again, or gone, or at another place."""
    lines = lines_of(data)
    line = rng.choice(lines)
    if rng.random() < 2 / 3:
        lines.remove(line)
    if rng.random() < 2 / 3:
        lines.insert(rng.randrange(len(lines) + 1), line)
    return b"".join(lines)


def separated(data: bytes, rng: random.Random) -> bytes:
    return data.replace(
        *rng.choice([(b",", b";"), (b",", b"\t"), (b";", b","), (b",", b"|")])
    )


def with_cell(data: bytes, rng: random.Random) -> bytes:
    lines, mark = lines_of(data), rng.choice([b",", b";", b"\t"])
    place = rng.randrange(len(lines))
    cells = lines[place].rstrip(b"\r\n").split(mark)
    cells[rng.randrange(len(cells))] = rng.choice([*BITS, b"", b'"a\nb"', b"x" * 300])
    lines[place] = mark.join(cells) + b"\n"
    return b"".join(lines)


def with_column(data: bytes, rng: random.Random) -> bytes:
    values = [rng.choice(COLUMNS), *rng.choices("0 1 2 yes 0.5 hello".split(), k=999)]
    return b"".join(
        line.rstrip(b"\r\n") + b"," + value.encode() + b"\n"
        for line, value in zip(lines_of(data), values, strict=False)
    )


MUTATIONS: list[Mutate] = [
    *(flipped, flipped, shorter, longer, longer, cut, with_lines, with_lines),
    *(separated, with_cell, with_cell, with_column),
]


def call(masrel: Caller, folder: Path, base: Base, *more: str) -> Done:
    path = folder / base.name
    path.write_bytes(base.data)
    return masrel("agree", path, *base.options, *more, "--json", "-")


def numbers(done: Done) -> Any:
    """What is estimated, but for errors of rounding, or the code of a refusal."""
    if done.code != 0:
        return done.code
    return [
        (of["coefficient"], of["n_items"], of["value"] and round(of["value"], 12))
        for of in json.loads(done.out)["estimates"]
    ]


def check_ended(done: Done) -> None:
    """An answer whose ratings add up, or one sentence and nothing else."""
    if done.code == 2:
        assert (done.out, len(done.err.splitlines())) == ("", 1), done.err
        return
    assert done.code == 0, done
    read = json.loads(done.out)["read"]
    assert sum(read["grades"].values()) == read["n_ratings"] > 0
    if read["layout"] == "wide" and not read["n_repeated"]:
        n_cells = read["n_ratings"] + read["n_missing"]
        assert n_cells == read["n_items"] * read["n_raters"]


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(seed, marks=[pytest.mark.slow] * (seed >= N_QUICK))
        for seed in range(N_ALL)
    ],
)
def test_a_mutation_is_answered_or_refused(
    seed: int, tmp_path: Path, masrel: Caller
) -> None:
    rng = random.Random(seed)
    base = rng.choice(BASES)
    data = base.data
    for mutate in rng.choices(MUTATIONS, k=rng.choice([1, 1, 1, 2, 3])):
        data = mutate(data, rng)
    mutated, more = Base(base.name, data, base.options), rng.choice(MORE)
    done = call(masrel, tmp_path, mutated, *more)
    check_ended(done)
    if done.code == 0 and "--stream" in more:
        assert numbers(call(masrel, tmp_path, mutated)) == numbers(done)
