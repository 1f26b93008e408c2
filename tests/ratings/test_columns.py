"""Columns that are more than raters and items: frequencies, criteria, and others."""

from pathlib import Path
from typing import Any

import pytest

from masrel.agreement import count_ratings
from masrel.errors import ParameterError, RatingsError
from tests.ratings.by_hand import read

# ---- rows that stand for several items ----

PAIRS = "Kim,Lee,Freq\nyes,yes,5\nyes,no,2\nno,yes,0\nno,,1\n"
ROW_NAMES = ",Freq,right,left,sex\n1,3,1,1,f\n2,1,2,1,f\n3,2,1,1,m\n4,0,3,2,m\n"


@pytest.mark.parametrize(
    ("text", "options", "parts", "record"),
    [
        (
            PAIRS,
            {},
            [{(0, -1): 1, (1, 0): 2, (1, 1): 5}],
            {
                "n_items": 8,
                "n_raters": 2,
                "n_ratings": 15,
                "n_missing": 1,
                "missing": {"": 1},
                "grades": {"no": 3, "yes": 12},
                "raters": ["Kim", "Lee"],
                "frequency": "Freq",
                "ignored": [],
            },
        ),
        (PAIRS.replace("Kim,", "item,"), {}, None, {"raters": ["item", "Lee"]}),
        # row names are no raters, whether they number all rows or those of a group
        *(
            (
                text,
                {"by": "sex"},
                [{(0, 0): 3, (1, 0): 1}, {(0, 0): 2}],
                {"raters": ["right", "left"], "n_items": 6},
            )
            for text in (ROW_NAMES, ROW_NAMES.replace("\n3,2", "\n1,2"))
        ),
        (
            "cell,Kim,Lee,n\na,1,1,3\nb,2,1,1\n",
            {"item": "cell", "frequency": "n"},
            [{(0, 0): 3, (1, 0): 1}],
            {},
        ),
    ],
)
def test_frequencies(
    tmp_path: Path,
    text: str,
    options: dict[str, Any],
    parts: list[dict[tuple[int, ...], int]] | None,
    record: dict[str, Any],
) -> None:
    file = read(tmp_path, text, **{"frequency": "Freq", **options})
    assert {key: file.read[key] for key in record} == record
    counted = [count_ratings(part.ratings) for part in file.parts]
    met = [
        dict(zip(map(tuple, c.codes.tolist()), c.freq, strict=True)) for c in counted
    ]
    assert parts is None or met == parts


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        *(
            (PAIRS.replace("no,2", f"no,{cell}"), {}, "line 3, column 'Freq'.*from 0")
            for cell in ("2.5", "-1", "two", "", "1e13")
        ),
        ("A,B,Freq\n1,1,0\n1,2,0\n", {}, "--frequency.*none"),
        (f"{PAIRS}Total,,8\n", {}, "line 6 is the sum"),
        (PAIRS, {"frequency": "count"}, "--frequency: there is no column 'count'"),
        (PAIRS, {"raters": ["Kim,Freq"]}, "--raters, --frequency|--frequency, --rat"),
        *(
            (PAIRS, options, "--frequency: ")
            for options in (
                {"rater": "Kim"},
                {"counts": True},
                {"table": True},
                {"session": "Kim"},
                {"clusters": "Kim"},
                {"repeated": "first"},
            )
        ),
        (PAIRS, {"stream": True}, "--frequency: needs the whole file"),
    ],
)
def test_frequencies_that_are_refused(
    tmp_path: Path, text: str, options: dict[str, Any], words: str
) -> None:
    with pytest.raises((RatingsError, ParameterError), match=words):
        read(tmp_path, text, **{"frequency": "Freq", **options})


# ---- columns that are no raters ----

GRADES = ["1,1,2", "2,2,2", "1,2,1", "3,3,3", "1,1,2"]
SAME = ["1", "2", "1", "3", "2"]  # also grades, which alone would not be noticed
FLAGS = ["1", "1", "0", "1", "0"]


def beside(name: str, cells: list[str], raters: str = "Kim,Lee,Ann") -> str:
    columns = zip("abcde", GRADES, cells, strict=True)
    rows = (f"{item},{row},{cell}" for item, row, cell in columns)
    return "\n".join([f"patient,{raters},{name}", *rows])


@pytest.mark.parametrize(
    "name",
    [
        *("majority", "majority_vote", "MajorityVote", "gold", "Gold label", "gt"),
        *(
            "goldStandard",
            "consensus",
            "consensus score",
            "adjudicated",
            "Ground truth",
        ),
        *("truth", "reference", "final_label", "true.label", "total", "Total score"),
        *(
            "sum",
            "mean",
            "Mean rating",
            "average",
            "median",
            "SD",
            "agree",
            "Agreement?",
        ),
        *("confidence", "Kim_conf", "conf.Lee", "KimConfidence", "certainty of Ann"),
        *("Freq", "frequency", "count", "n", "weights", "age", "Comment", "group"),
    ],
)
def test_a_column_of_such_a_name_is_no_rater(tmp_path: Path, name: str) -> None:
    text = beside(name, SAME)
    with pytest.raises(RatingsError, match=f"--ignore '?{name.split()[0]}") as refused:
        read(tmp_path, text)
    assert "--raters Kim,Lee,Ann" in str(refused.value)
    assert read(tmp_path, text, ignore=name).read["raters"] == ["Kim", "Lee", "Ann"]
    for options in ({"raters": ["Kim", name]}, {"reference": name}):
        file = read(tmp_path, text, **options)
        assert name in file.read["raters"]
        assert not file.warnings


@pytest.mark.parametrize(
    ("text", "is_refused"),
    [
        *(
            (beside(name, SAME), False)
            for name in ("Max", "Goldie", "n1", "rater_2", "Meaney", "Confucius", "M")
        ),
        (beside("n", SAME, "k,l,m"), False),
        *(
            (beside(name, cells), is_refused)
            for name in ("match 1", "agreed all 3", "disagreement_12")
            for cells, is_refused in ((FLAGS, True), (SAME, False))
        ),
        # no grade in common with the others
        (beside("hand", ["left", "right", "left", "left", "right"]), True),
        (beside("bpm", ["61", "72", "83", "74", "61"]), True),
        (beside("p", ["0.1", "1.5", "0.9", "2.5", "0.4"]), True),
        (beside("Oh", ["4", "", "", "", ""]), False),  # two grades too few to tell
        ("item,Kim,Lee\nA,TRUE,yes\nB,FALSE,no\nC,TRUE,no\n", True),
        ("item,Kim,Lee\nA,a,b\nB,c,d\n", False),
        ("item,Kim,Lee\nA,a;b,b;a\nB,b;c,c;b\nC,a;b,c;b\n", False),
        # measurements seldom are the same twice
        ("item,X,Y,Z\nA,1.1,1.2,61\nB,2.2,2.1,72\nC,3.3,3.4,83\n", False),
    ],
)
def test_which_columns_are_no_raters(
    tmp_path: Path, text: str, is_refused: bool
) -> None:
    if is_refused:
        with pytest.raises(
            RatingsError, match=r"not look like raters|spell them alike"
        ):
            read(tmp_path, text)
    raters = text.splitlines()[0].split(",")[1:]
    file = read(tmp_path, text, **({"raters": raters} if is_refused else {}))
    assert file.read["raters"] == raters


@pytest.mark.parametrize("first", ["patient", "id"])
@pytest.mark.parametrize("name", ["model", "judge", "annotator", "rating"])
def test_columns_of_raters_that_have_usual_names(
    tmp_path: Path, first: str, name: str
) -> None:
    text = beside(name, SAME).replace("patient", first)
    with pytest.raises(RatingsError, match=r"--item|--raters"):
        read(tmp_path, text)
    for options in ({"known": (name,)}, {"reference": name}):
        file = read(tmp_path, text, **options)
        assert file.read["raters"] == ["Kim", "Lee", "Ann", name]
        assert file.read["item"] == [first]


DIFFERENT = beside("n", SAME).replace("e,1,1,2", "e,2,1,2")


@pytest.mark.parametrize(
    ("text", "options", "code"),
    [
        # row names are no names of items, and a first column that is one of grades
        (ROW_NAMES, {"ignore": "Freq"}, None),
        (ROW_NAMES, {"ignore": "Freq,sex"}, None),
        (ROW_NAMES, {"no_item": True}, None),
        (ROW_NAMES, {"raters": "right,left"}, None),
        (ROW_NAMES, {"raters": "right,left", "ignore": "Freq,sex"}, "frequency"),
        (PAIRS, {}, None),
        (PAIRS, {"no_item": True, "ignore": "Freq"}, None),
        (DIFFERENT, {}, None),
        (DIFFERENT, {"ignore": "n"}, "frequency"),
        (beside("n", SAME), {"ignore": "n"}, ""),
        (DIFFERENT.replace("3,3,3,3", "3,3,3,.5"), {"ignore": "n"}, ""),
    ],
)
def test_frequencies_that_are_not_said(
    tmp_path: Path, text: str, options: dict[str, Any], code: str | None
) -> None:
    if code is None:
        with pytest.raises(RatingsError, match=r"add --frequency (Freq|n);"):
            read(tmp_path, text, **options)
    else:
        codes = [finding.code for finding in read(tmp_path, text, **options).warnings]
        assert codes == [code] * bool(code)


@pytest.mark.parametrize(
    ("text", "options", "code"),
    [
        ("essay,Kim,Lee\n1,1,2\n2,2,2\n3,1,1\n4,2,1\n", {}, ""),  # rows numbered
        ("x,Kim,Lee\n1,1,1\n2,2,3\n3,3,2\n", {}, None),  # or ranks
        ("x,Kim,Lee\n1,1,1\n2,2,3\n3,3,2\n", {"item": "x"}, ""),
        ("x,1,2\nA,1,2\nB,2,2\nC,1,1\n", {}, None),  # grades or raters as names
        ("x,1,2\nA,1,2\nB,2,2\nC,1,1\n", {"item": "x"}, ""),
        ("x,1,2\nA,1,2\nB,2,2\nC,1,1\n", {"raters": "1,2"}, ""),
        ("item,A,B\np,2,0\nq,1,1\n", {}, "counts"),  # too few to tell
        ("item,A,B\np,2,0\nq,1,1\nr,0,2\ns,0,2\n", {}, None),
        ("item,A,B\np,2,0\nq,1,1\nr,0,2\ns,0,2\n", {"raters": "A,B"}, ""),
        ("item,A,B\nsum,1,1\nit,1,2\nrun,2,2\n", {}, "summary"),  # words
        ("item,A,B\nit,1,2\nrun,2,2\nsum,1,1\n", {}, None),
        ("item,A,B\np,a,1\nq,b,0\nr,a,1\n", {"ignore": "B"}, ""),
        # a column of items is no second line of names
        (",p,q,r,s\nA,x,a,a,a\nB,x,a,b,a\n", {"transpose": True}, ""),
    ],
)
def test_rows_and_names_that_are_none(
    tmp_path: Path, text: str, options: dict[str, Any], code: str | None
) -> None:
    if code is None:
        with pytest.raises(RatingsError):
            read(tmp_path, text, **options)
    else:
        codes = [finding.code for finding in read(tmp_path, text, **options).warnings]
        assert codes == [code] * bool(code)


# ---- spans, and sides of tables ----

SPANS = "doc,annotator,start,end,label\n"


@pytest.mark.parametrize(
    ("text", "options", "is_refused"),
    [
        *(
            (f"{SPANS}d1,K,0,5,x\nd1,L,0,5,x\nd2,K,3,7,y\nd2,L,3,9,y\n", options, True)
            for options in (
                {},
                {"item": "doc"},
                {"item": ["doc", "start"]},
                {"item": "doc", "rater": "annotator", "grade": "label"},
            )
        ),
        ("doc,who,Begin,End,type\na,K,0,5,x\na,L,1,5,x\n", {}, True),
        ("t,coder,char_start,charEnd,label\na,K,0,5,x\na,L,1,5,x\n", {}, True),
        # parts that raters have in common, and names that mean something else
        (f"{SPANS}d1,K,0,5,x\nd1,L,0,5,x\nd2,K,3,7,y\n", {"item": "doc"}, False),
        (f"{SPANS}d1,K,7,5,x\nd1,L,0,5,x\n", {"item": "doc"}, False),
        (f"{SPANS}d1,K,a,b,x\nd1,L,a,c,x\n", {"item": "doc"}, False),
        ("patient,start,end\na,1,1\nb,1,2\nc,2,2\n", {}, False),
    ],
)
def test_spans(
    tmp_path: Path, text: str, options: dict[str, Any], is_refused: bool
) -> None:
    if is_refused:
        with pytest.raises(RatingsError, match="spans"):
            read(tmp_path, text, **options)
    else:
        assert read(tmp_path, text, **options).read["n_raters"] == 2


@pytest.mark.parametrize(
    ("text", "raters", "grades"),
    [
        (",Omar yes,Omar no\nInes yes,5,1\nInes no,0,2\n", ["Ines", "Omar"], "no yes"),
        (",Omar: a,Omar: b\nb (Ines),0,2\na (Ines),5,1\n", ["Ines", "Omar"], "a b"),
        (",yes,no\nInes_yes,5,1\nInes_no,0,2\n", ["Ines", "columns"], "no yes"),
        (
            ",B not bad,B not good\nA not bad,5,1\nA not good,0,2\n",
            *(["A", "B"], "not_bad not_good"),
        ),
        (",yes,no\nyes,5,1\nno,0,2\n", [], "no yes"),
    ],
)
def test_sides_of_a_table_with_names_of_raters(
    tmp_path: Path, text: str, raters: list[str], grades: str
) -> None:
    file = read(tmp_path, text, table=True)
    assert file.read["raters"] == raters
    assert " ".join(g.replace(" ", "_") for g in sorted(file.scale.grades)) == grades
    counted = count_ratings(file.parts[0].ratings)
    assert sorted(counted.freq.tolist()) == [1, 2, 5]
    assert counted.freq[(counted.codes == 1).all(axis=1)].tolist() in ([5], [2])
    with pytest.raises(RatingsError, match="--table"):
        read(tmp_path, text)


# ---- criteria beside each other ----

BOTH = ["1,1,3,2", "2,2,1,1", "2,1,3,3", "3,3,2,1"]


def criteria(names: str, rows: list[str] = BOTH) -> str:
    lines = (f"e{k},{row}" for k, row in enumerate(rows))
    return "\n".join([f"essay,{names}", *lines])


OF_TONE = [["1", "1"], ["2", "2"], ["2", "1"], ["3", "3"]]
OF_GAIT = [["3", "2"], ["1", "1"], ["3", "3"], ["2", "1"]]
TURNED = "Ines.tone,Omar.tone,Ines.gait,Omar.gait"


@pytest.mark.parametrize(
    ("names", "options", "one"),
    [
        *(
            (names, {}, one)
            for names, one in (
                ("tone_Ines,tone_Omar,gait_Ines,gait_Omar", "tone_Ines,tone_Omar"),
                (TURNED, "Ines.tone,Omar.tone"),
                ("tone: R1,tone: R2,gait: R1,gait: R2", "'tone: R1,tone: R2'"),
                ("Q1_Ines,Q1_Omar,Q2_Ines,Q2_Omar", "Q1_Ines,Q1_Omar"),
            )
        ),
        # either part may be the rater
        *(
            (names, {"raters": raters}, f"({one}) reads .* ({other}) reads")
            for names, raters, one, other in (
                *(
                    ("tone_a,tone_o,gait_a,gait_o", "a,o", *both)
                    for both in (("tone_a,tone_o", "tone_a,gait_a"),)
                ),
                ("Tone1,Tone2,Gait1,Gait2", "1,2", "Tone1,Tone2", "Tone1,Gait1"),
            )
        ),
    ],
)
def test_criteria(
    tmp_path: Path, names: str, options: dict[str, Any], one: str
) -> None:
    text = criteria(names)
    with pytest.raises(RatingsError, match=f"--raters {one}"):
        read(tmp_path, text)
    if options:
        with pytest.raises(RatingsError, match="name the raters with --raters"):
            read(tmp_path, text, by_criterion=True)
    file = read(tmp_path, text, by_criterion=True, **options)
    assert [part.group for part in file.parts] == [
        part for part in ("tone", "gait", "Tone", "Gait", "Q1", "Q2") if part in names
    ]
    grades = (*file.scale.grades, None)
    assert [
        [[grades[code] for code in row] for row in part.ratings.codes.tolist()]
        for part in file.parts
    ] == [OF_TONE, OF_GAIT]
    assert file.read["by"] == "criterion"
    assert file.read["item"] == ["essay"]
    assert (file.read["n_items"], file.read["n_raters"]) == (4, 2)
    assert not file.warnings
    # all are raters if they are named so
    assert read(tmp_path, text, raters=names).read["n_raters"] == 4


@pytest.mark.parametrize(
    "names",
    [
        "R1_a,R2_b,R3_c,R4_d",
        "rater_1,rater_2,rater_3,rater_4",
        "expert_1,expert_2,novice_1,novice_2",
        "nurse A,nurse B,doctor A,doctor B",
        "R1,R2,S1,S2",
        "Dr. Kim,Dr. Lee,Dr. Oh,Prof. Ann",
        "site1_R1,site1_R2,site2_R3,site2_R4",
    ],
)
def test_raters_whose_names_are_no_criteria(tmp_path: Path, names: str) -> None:
    file = read(tmp_path, criteria(names))
    assert file.read["raters"] == names.split(",")
    with pytest.raises(RatingsError, match="--by-criterion: needed names of columns"):
        read(tmp_path, criteria(names), by_criterion=True)
