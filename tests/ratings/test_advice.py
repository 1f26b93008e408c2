"""What a message about a file suggests is run on that file, and answers it.

A row of the table is a file, its first command, the message that comes, and every
suggestion in it with the ratings that are there if its words are true, or with the next
question, whose suggestions are run in turn: at most two questions to an answer.
"""

import io
import json
import re
import shlex
import zipfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

from masrel.cli.agree import agree
from masrel.ratings._findings import _TEXTS
from tests.cli.process import Caller, Done
from tests.ratings.by_hand import agreement

FLAGS = {
    name
    for of in agree.params
    if getattr(of, "is_flag", False)
    for name in (*of.opts, *of.secondary_opts)
}
# What stands behind an option in a sentence, and is no value of it.
WORDS = frozenset(
    "COL and as chooses compares computes counts estimates has if keeps leaves makes "
    "name names needs or reads says takes tells to with".split()
)
MORE = re.compile("{(advice|do|guess|hint|option|ways)}")  # which may be suggestions
Suggestion = tuple[str, str | None]  # an option, or "masrel", and its value
COMMANDS = "agree compare diagnose latent limits".split()


@dataclass(frozen=True, kw_only=True)
class Asked:
    """A file, what is asked of it, and what comes: a message and its suggestions.

    A suggestion is what is added to the command, with a value where the message has
    none. What it gives is ratings, items by raters, such as "11 12 2." or, with longer
    grades, "1+/2 3/."; such ratings of each group; values at places of the JSON; or the
    next question.
    """

    code: str | None  # of the text; None for one that is no finding of a file
    tries: "Mapping[str, Expected]"
    text: str | bytes | Callable[[], str | bytes] = ""
    name: str = "r.csv"
    options: str = ""  # of the first command


def label_studio() -> str:
    """Two fields of two texts by two people."""
    return json.dumps(
        [
            {
                "id": item,
                "annotations": [
                    {
                        "completed_by": who,
                        "result": [
                            {
                                "id": label,
                                "from_name": name,
                                "type": "choices",
                                "value": {"choices": [label]},
                            }
                            for name, label in zip(("a", "b"), labels, strict=True)
                        ],
                    }
                    for who, labels in enumerate(both)
                ],
            }
            for item, both in enumerate([("xu", "xv"), ("yu", "xu")])
        ]
    )


def samples() -> bytes:
    """Two items that two models are tested by, a folder each."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for model, values in (("a", (1, 1)), ("b", (0, 1))):
            rows = [
                {"doc_id": k, "filter": "none", "metrics": ["acc"], "acc": acc}
                for k, acc in enumerate(values)
            ]
            archive.writestr(f"{model}/s.jsonl", "\n".join(map(json.dumps, rows)))
    return data.getvalue()


def workbook() -> bytes:
    """Two sheets of ratings."""
    data, book = io.BytesIO(), pytest.importorskip("openpyxl").Workbook()
    for name, grades in (("first", "1121"), ("second", "3433")):
        sheet = book.create_sheet(name)
        for row in (("item", "Kim", "Lee"), ("a", *grades[:2]), ("b", *grades[2:])):
            sheet.append(row)
    book.remove(book.active)
    book.save(data)
    return data.getvalue()


Expected = str | Mapping[str, str | float | None] | Asked | None

# Of 8 items, Kim's grades are 10, 20 … and Lee's one more: the sums of squares are
# 8 400 of items, 4 of raters and 0 of the rest.
MEASURED = "item,Kim,Lee\n" + "".join(
    f"p{k},{10 * k},{10 * k + 1}\n" for k in range(1, 9)
)
# Four items on two days: Kim agrees with herself on three, Lee on all; by chance half.
DAYS = "item,rater,day,grade\n" + "".join(
    f"{item},{rater},{day},{grade}\n"
    for rater, both in (("Kim", ("1122", "1222")), ("Lee", ("1212", "1212")))
    for day, grades in zip("uv", both, strict=True)
    for item, grade in zip("abcd", grades, strict=True)
)
# Kim and Lee differ on three items, two one way. Of words, 5 / 6 agree by linear
# weights, and 23 / 36 by chance.
CHANGES = "item,Kim,Lee,Ann\na,1,1,1\nb,1,2,1\nc,1,2,1\nd,2,1,1\n"
CRITERIA = "item,tone_Kim,tone_Lee,gait_Kim,gait_Lee\na,1,1,2,2\nb,1,2,1,1\n"
WORDED = "item,Kim,Lee\na,mild,mild\nb,no,no\nc,severe,mild\n"
# True of no file where nothing tells the ratings apart.
TWICE = {"--by COL": None, "--session COL": None}
WIDE_TWICE = {**TWICE, "--rater COL": None, "--grade COL": None}

TABLE: dict[str, Asked] = {
    # ---- text ----
    "Western": Asked(
        code="encoding",
        text="item,José,Zoë\na,1,1\nb,2,1\n".encode("cp1252"),
        tries={"--encoding cp1252": "11 21"},
    ),
    "Western or Eastern": Asked(
        code="encoding",
        text="item,Kim,Lee\na,sévère,légère\nb,légère,légère\n".encode("cp1252"),
        tries={
            "--encoding cp1252": "sévère/légère légère/légère",
            "--encoding cp1250": "sévčre/légčre légčre/légčre",
        },
    ),
    "Cyrillic": Asked(
        code="encoding",
        text="item,Кузнецов,Петрова\na,да,нет\nb,нет,нет\n".encode("cp1251"),
        tries={"--encoding cp1251": "да/нет нет/нет"},
    ),
    "Japanese": Asked(
        code="encoding",
        text="item,Kim,Lee\na,軽い,軽い\nb,重い,軽い\n".encode("shift-jis"),
        tries={"--encoding shift-jis": "軽い/軽い 重い/軽い"},
    ),
    "two bytes": Asked(
        code="zero byte",
        text="item,Kim,Lee\na,1,1\nb,2,1\n".encode("utf-16-be"),
        tries={"--encoding utf-16-be": "11 21"},
    ),
    "two separators": Asked(
        code="two separators",
        text="item;a,Kim;b,Lee;c\nx;1,1;2,1;3\ny;1,1;2,2;3\n",
        tries={
            "--delimiter ,": "1;2/1;3 1;2/2;3",
            "--delimiter ';'": Asked(
                code="decimal comma",
                tries={
                    "--decimal ,": "1.1/2.1/3 1.1/2.2/3",
                    "--set-separator ,": "1/1;2/3 1/2/3",
                },
            ),
        },
    ),
    "colons": Asked(
        code="one column",
        text="item:Kim:Lee\na:1:1\nb:2:1\n",
        tries={"--delimiter :": "11 21"},
    ),
    "names again": Asked(
        code="names again",
        text="a,1,2\nb,2,1\na,1,2\n",
        tries={
            "--no-header": Asked(
                code="twice",
                tries={
                    **WIDE_TWICE,
                    "--no-item": None,
                    "--repeated first": "12 21",
                    "--repeated last": "12 21",
                    "--repeated mean": "12 21",
                },
            )
        },
    ),
    "no name": Asked(
        code="no name",
        text="a,,1\nb,2,1\nc,1,1\n",
        tries={"--no-header": ".1 21 11"},
    ),
    "same name": Asked(
        code="same name",
        text="a,1,1\nb,2,1\nc,1,1\n",
        tries={"--no-header": "11 21 11"},
    ),
    "titles": Asked(
        code="titles",
        text="Table 1. Tone\n\nitem,Kim,Lee\na,1,2\nb,2,2\n",
        tries={"--skip 2": "12 22"},
    ),
    "titles and two lines of names": Asked(
        code="titles",
        text="Table 1\n\nitem,Rater,\n,Kim,Lee\na,1,2\nb,2,2\nc,1,1\n",
        tries={"--header 3,4": "12 22 11"},
    ),
    "two lines of names, the upper merged": Asked(
        code="no name",
        text="item,Rater,\n,Kim,Lee\na,1,2\nb,2,2\nc,1,1\n",
        tries={"--header 1,2": "12 22 11"},
    ),
    "two lines of names": Asked(
        code="same name",
        text="item,Rater,Rater\n,Kim,Lee\na,1,2\nb,2,2\nc,1,1\n",
        tries={"--header 1,2": "12 22 11"},
    ),
    "a line of units": Asked(
        code="unnamed",
        text="item,Kim,Lee\n,mm,mm\na,1,2\nb,2,2\nc,1,1\nd,1,1\n",
        tries={"--header 1,2": "12 22 11 11"},
    ),
    "a second line of names": Asked(
        code="second header",
        text="item,Kim,Lee\nname,first,second\na,u,v\nb,u,u\nc,v,v\nd,u,v\n",
        tries={
            "--header 1,2": "uv uu vv uv",
            "--header 1": "first/second u/v u/u v/v u/v",
        },
    ),
    "columns of a survey": Asked(
        code="same name",
        text="ResponseId,Q1,Q1,V1,V2\na,x,y,1,1\nb,z,x,2,1\n",
        tries={"--raters V1,V2": "11 21"},
    ),
    # ---- workbooks, JSON, exports ----
    "names of as many raters as items": Asked(
        code="levels",
        name="r.json",
        text='{"Kim":{"a":1,"b":2},"Lee":{"a":1,"b":1}}',
        tries={"--raters Kim,Lee": "11 21", "--transpose": "12 11"},
    ),
    "sheets": Asked(
        code="sheets",
        name="r.xlsx",
        text=workbook,
        tries={"--sheet first": "11 21", "--sheet second": "34 33"},
    ),
    "an export": Asked(
        code="nested cell",
        name="r.json",
        text=label_studio,
        tries={
            "--from label-studio": Asked(
                code="fields", tries={"--grade a": "xx yx", "--grade b": "uv uu"}
            )
        },
    ),
    "an archive of several files": Asked(
        code="members",
        name="r.zip",
        text=samples,
        tries={"--from lm-eval": "10 11"},
    ),
    "an export of one of two tools": Asked(
        code="sources",
        name="r.json",
        text=json.dumps(
            [
                {
                    **{"doc_id": f"{run}{who}", "filter": "none", "metrics": ["f"]},
                    **{"f": grade, "run_id": run, "key": "f", "value": grade},
                    "feedback_source": {"type": "app", "user_name": who},
                }
                for who, both in (("Kim", "xy"), ("Lee", "xx"))
                for run, grade in zip("ab", both, strict=True)
            ]
        ),
        tries={"--from lm-eval": "x y x x", "--from langsmith": "xx yx"},
    ),
    "names in two levels": Asked(
        code="levels",
        name="r.json",
        text='{"Kim": {"a": 1, "b": 2}, "Lee": {"a": 1, "b": 1}}',
        tries={"--raters Kim,Lee": "11 21", "--transpose": "12 11"},
    ),
    # ---- columns ----
    "a name misspelt": Asked(
        code="no column",
        options="--item text --rater who --grade marks",
        text="text,who,mark\na,Kim,1\na,Lee,2\nb,Kim,1\nb,Lee,1\n",
        tries={"--grade mark": "12 11"},
    ),
    "two columns of items": Asked(
        code="role twice",
        text="item,case,rater,grade\n1,a,Kim,1\n1,a,Lee,1\n1,b,Kim,2\n1,b,Lee,1\n",
        tries={
            "--item case": "11 21",
            "--ignore item": "11 21",
        },
    ),
    "which column is what": Asked(
        code="unknown role",
        text="text,rater,mark,day\na,1,1,2\nb,2,2,1\n",
        tries={
            "--item text --grade mark": "1. .2",
            "--raters rater,mark,day": "112 221",
            "--transpose": "12 12 21",
        },
    ),
    "gold": Asked(
        code="no raters",
        text="item,Kim,Lee,gold\na,1,1,1\nb,2,1,2\nc,2,2,2\nd,1,1,1\n",
        tries={
            "--ignore gold": "11 21 22 11",
            "--raters Kim,Lee": "11 21 22 11",
            # κ of Kim and Lee: (3/4 − 34/64)/(1 − 34/64)
            "masrel diagnose --reference gold": {"estimates 1 value": 7 / 15},
        },
    ),
    "nothing in common": Asked(
        code="nothing in common",
        text="item,Kim,Lee\na,1,yes\nb,2,no\nc,2,no\nd,1,yes\n",
        tries={"--raters Kim,Lee": "1/yes 2/no 2/no 1/yes"},
    ),
    "patterns": Asked(
        code="frequency",
        text="Kim,Lee,Freq\nu,u,2\nu,v,1\nv,u,0\nv,v,3\n",
        tries={
            "--frequency Freq": "uu uu uv vv vv vv",
            "--ignore Freq --raters Kim,Lee": "uu uv vu vv",
        },
    ),
    "patterns with a name": Asked(
        code="frequency",
        text="cell,Kim,Lee,n\na,u,u,2\nb,u,v,1\n",
        options="--item cell",
        tries={
            "--frequency n": "uu uu uv",
            "--ignore n --raters Kim,Lee": "uu uv",
        },
    ),
    "a rating as names": Asked(
        code="rating as names",
        text="a,Kim,1\na,Lee,2\nb,Kim,2\nb,Lee,2\n",
        options="--item a --rater Kim --grade 1",
        tries={
            "--no-header": Asked(code="no column", tries={}),
            "--header 1": ".2 22",
        },
    ),
    "comments": Asked(
        code="comments",
        text="item,Kim,Lee,why,more\n"
        + "".join(
            f"{k},1,2,{'a' * (k % 23)} {'b' * (k // 23)},{'c' * k}\n"
            for k in range(1, 520)
        ),
        tries={"--raters Kim,Lee": "12 " * 519},
    ),
    "no names": Asked(
        code="grades as names",
        text="P1,1,2\nP2,2,2\nP3,1,1\n",
        tries={"--no-header": "12 22 11", "--raters 1,2": "22 11"},
    ),
    "numbers of raters": Asked(
        code="counts",
        text="item,1,2,3\na,3,0,0\nb,1,2,0\nc,0,0,3\nd,1,1,1\n",
        tries={
            "--counts": "111 122 333 123",
            "--raters 1,2,3": "300 120 003 111",
        },
    ),
    "a rater or items": Asked(
        code="first column",
        text="Kim,Lee,Ann\n1,1,2\n2,2,2\n3,1,1\n",
        tries={"--no-item": "112 222 311", "--item Kim": "12 22 11"},
    ),
    "a rater or items that are there twice": Asked(
        code="first column",
        text="Kim,Lee,Ann\n1,1,2\n2,2,2\n1,2,2\n",
        tries={
            "--no-item": "112 222 122",
            "--item Kim": Asked(
                code="twice",
                tries={
                    **WIDE_TWICE,
                    "--repeated first": "12 22",
                    "--repeated last": "22 22",
                    "--repeated mean": "1.5/2 2/2",
                },
            ),
        },
    ),
    "raters as rows": Asked(
        code="many raters",
        text=",p1,p2,p3,p4,p5\nKim,1,2,1,1,2\nLee,1,2,2,1,1\n",
        tries={"--transpose": "11 22 12 11 21"},
    ),
    "apart": Asked(
        code="apart",
        text="item,Kim,Lee,Ann\na,1.25,1.5,98\nb,2.125,2.5,97.5\nc,1.5,1.75,90\n",
        tries={
            "--ignore Ann": "1.25/1.5 2.125/2.5 1.5/1.75",
            "--raters Kim,Lee": "1.25/1.5 2.125/2.5 1.5/1.75",
        },
    ),
    "row numbers": Asked(
        code="numbered",
        text="item,text,rater,grade\n1,a,Kim,1\n2,a,Lee,1\n3,b,Kim,2\n4,b,Lee,1\n",
        tries={"--item text": "11 21"},
    ),
    # ---- tables of counts ----
    "two raters": Asked(
        code="contingency",
        text=",yes,no\nyes,2,1\nno,0,1\n",
        tries={
            "--table": "yes/yes yes/yes yes/no no/no",
            "--raters yes,no": "21 01",
        },
    ),
    "two raters by name": Asked(
        code="contingency",
        text=",Kim yes,Kim no\nLee yes,2,1\nLee no,0,1\n",
        tries={
            "--table": "yes/yes yes/yes yes/no no/no",
            "--raters 'Kim yes,Kim no'": "21 01",
        },
    ),
    "criteria": Asked(
        code="criteria",
        text=CRITERIA,
        tries={
            "--raters tone_Kim,tone_Lee": "11 12",
            "--by-criterion": {"tone": "11 12", "gait": "22 11"},
            "--raters tone_Kim,tone_Lee,gait_Kim,gait_Lee": "1122 1211",
        },
    ),
    "criteria or raters": Asked(
        code="criteria",
        text=CRITERIA.replace("Kim", "a").replace("Lee", "b"),
        tries={
            "--raters tone_a,tone_b": "11 12",
            "--raters tone_a,gait_a": "12 11",
            "--raters tone_a,tone_b,gait_a,gait_b": "1122 1211",
        },
    ),
    "who rates criteria": Asked(
        code="who rates",
        options="--by-criterion",
        text=CRITERIA.replace("Kim", "a").replace("Lee", "b"),
        tries={
            "--raters a,b": {"tone": "11 12", "gait": "22 11"},
            "--raters tone,gait": {"a": "12 11", "b": "12 21"},
        },
    ),
    "beside criteria": Asked(
        code="no criterion",
        options="--by-criterion",
        text="item,tone_Kim,tone_Lee,gait_Kim,gait_Lee,speed\n"
        "p,1,1,2,2,1\nq,1,2,1,1,2\n",
        tries={
            "--ignore speed": {"tone": "11 12", "gait": "22 11"},
            "--raters Kim,Lee": {"tone": "11 12", "gait": "22 11"},
        },
    ),
    "spans": Asked(
        code="span columns",
        text="part,start,end,rater,grade\n"
        "u,0,4,Kim,1\nu,0,4,Lee,1\nv,5,9,Kim,1\nv,5,9,Lee,2\n",
        tries={"--item part": "11 12"},
    ),
    "truth": Asked(
        code="truth",
        text="item,Kim,Lee\na,TRUE,1\nb,1,2\n",
        tries={"--categories FALSE,TRUE,1,2": "TRUE/1 1/2"},
    ),
    "sums beside": Asked(
        code="sum column",
        options="--counts",
        text="item,u,v,total\na,2,1,3\nb,3,0,3\nc,1,2,3\n",
        tries={
            "--ignore total": "uuv uuu uvv",
            "--raters u,v": "uuv uuu uvv",
        },
    ),
    "a category or items": Asked(
        code="category or item",
        options="--counts",
        text="u,v\n2,1\n3,0\n1,2\n",
        tries={"--no-item": "uuv uuu uvv", "--item u": "v .. vv"},
    ),
    "a table without names": Asked(
        code="rows of table",
        options="--table",
        text="u,v\n2,1\n0,1\n",
        tries={"--no-item": "uu uu uv vv"},
    ),
    "thousands of items": Asked(
        code="count",
        options="--table --no-item",
        text="u;v\n1.002;1\n0;1\n",
        tries={"--thousands .": "uu " * 1002 + "uv vv"},
    ),
    # ---- grades ----
    "no answer": Asked(
        code="looks missing",
        text="item,Kim,Lee\na,1,?\nb,2,1\n",
        tries={"--missing '?'": "1. 21", "--categories 1,2,?": "1? 21"},
    ),
    "decimal comma": Asked(
        code="decimal comma",
        text="item;Kim;Lee\na;1,5;2,5\nb;2,5;2,5\n",
        tries={
            "--decimal ,": "1.5/2.5 2.5/2.5",
            "--set-separator ,": "1;5/2;5 2;5/2;5",
        },
    ),
    "thousands or decimals": Asked(
        code="thousands",
        text='item,Kim,Lee\na,"1,200","1,300"\nb,"1,400","1,400"\n',
        tries={
            "--thousands ,": "1200/1300 1400/1400",
            "--decimal ,": "1.200/1.300 1.400/1.400",
        },
    ),
    "thousands": Asked(
        code="thousands read",
        text='item,Kim,Lee\na,"1,200","1,200"\nb,900,"1,400"\n',
        tries={"--thousands ,": "1200/1200 900/1400"},
    ),
    "plus": Asked(
        code="plus",
        text="item,Kim,Lee\na,1,+1\nb,2,1\n",
        tries={"--categories 1,2": "11 21", "--categories 1,1+,2": "1/1+ 2/1"},
    ),
    "other grade": Asked(
        code="other grade",
        options="--categories 1,2,3",
        text="item,Kim,Lee\na,1,?\nb,2,1\n",
        tries={"--missing '?'": "1. 21"},
    ),
    "units": Asked(
        code="units",
        text="item,Kim,Lee\na,5mm,6mm\nb,7mm,7mm\n",
        tries={
            "--units": "56 77",
            "--categories 5mm,6mm,7mm": "5mm/6mm 7mm/7mm",
        },
    ),
    "no unit": Asked(
        code="no unit",
        options="--units",
        text="item,Kim,Lee\na,5mm,x\nb,7mm,7mm\n",
        tries={"--missing x": "5. 77"},
    ),
    "measurements": Asked(
        code="measurements",
        text=MEASURED,
        tries={
            "--coefficients icc_a1": {"estimates 0 value": 1200 / 1201},
            "--metric interval": {"estimates 0 value": 1 - 15 / 16808},
        },
    ),
    "far": Asked(
        code="far",
        text="item,Kim,Lee\na,1,99\nb,2,1\nc,2,2\n",
        tries={"--missing 99": "1. 21 22"},
    ),
    "no number": Asked(
        code="no number",
        text="item,Kim,Lee\na,1,x\nb,2,1\nc,2,2\n",
        tries={"--missing x": "1. 21 22"},
    ),
    "number": Asked(
        code="number",
        text="item,Kim,Lee\na,yes,99\nb,no,yes\nc,no,no\n",
        tries={"--missing 99": "yes/. no/yes no/no"},
    ),
    # ---- ratings ----
    "one row a rating": Asked(
        code="twice",
        text="text,who,mark\na,Kim,1\na,Lee,2\nb,Kim,1\nb,Lee,1\n",
        tries={
            **WIDE_TWICE,
            "--rater who --grade mark": "12 11",
            "--no-item": None,
            **{
                f"--repeated {which}": Asked(
                    code="nothing in common",
                    tries={"--raters who,mark": ratings},
                )
                for which, ratings in (
                    ("first", "Kim/1 Kim/1"),
                    ("last", "Lee/2 Lee/1"),
                )
            },
            "--repeated mean": None,
        },
    ),
    "raters alone": Asked(
        code="twice",
        text="Kim,Lee,Ann\n1,1,2\n2,2,2\n4,1,2\n1,2,2\n",
        tries={
            **WIDE_TWICE,
            "--no-item": "112 222 412 122",
            "--repeated first": "12 22 12",
            "--repeated last": "22 22 12",
            "--repeated mean": "1.5/2 2/2 1/2",
        },
    ),
    "twice": Asked(
        code="twice",
        text="item,rater,grade,day\na,Kim,1,u\na,Lee,1,u\na,Kim,2,v\na,Lee,1,v\n",
        tries={
            "--by day": {"u": "11", "v": "21"},
            "--session day": Asked(
                code=None,
                tries={
                    "--by day": {"u": "11", "v": "21"},
                    "--retest": {"retest 1 value": None},
                },
            ),
            "--repeated first": "11",
            "--repeated last": "21",
            "--repeated mean": "1.5/1",
        },
    ),
    "means of words": Asked(
        code="means",
        options="--repeated mean",
        text="item,rater,grade\na,Kim,yes\na,Lee,no\na,Kim,no\nb,Kim,no\nb,Lee,no\n",
        tries={"--repeated first": "yes/no no/no", "--repeated last": "no/no no/no"},
    ),
    "numbered in each cluster": Asked(
        code="two clusters",
        options="--clusters ward",
        text="item,ward,rater,grade\n1,u,Kim,1\n1,v,Lee,1\n2,u,Kim,2\n2,u,Lee,1\n",
        tries={"--item ward,item": "1. .1 21"},
    ),
    # ---- what is asked of ratings ----
    "an order": Asked(
        code=None,
        options="--weights linear",
        text=WORDED,
        tries={
            "--categories no,mild,severe": {
                "estimates 0 value": 5 / 6,
                "estimates 1 value": 7 / 13,
            }
        },
    ),
    "a metric of sets": Asked(
        code=None,
        options="--metric jaccard",
        text="item,Kim,Lee\na,x+y,x\nb,y,y\nc,x+y,x+y\n",
        tries={"--set-separator +": {"estimates 0 value": 8 / 13}},
    ),
    "of two sessions": Asked(
        code=None,
        options="--coefficients pooled_kappa --repeated first",
        text=DAYS,
        tries={"--session day --retest": {"retest 3 value": 3 / 4}},
    ),
    "two sessions": Asked(
        code=None,
        options="--session day",
        text=DAYS,
        tries={
            "--by day": {"u": "11 12 21 22", "v": "11 22 21 22"},
            "--retest": {"retest 0 value": 1 / 2, "retest 1 value": 1.0},
        },
    ),
    "no session": Asked(
        code="twice",
        options="--retest",
        text=DAYS,
        tries={
            **TWICE,
            "--session day": {"retest 0 value": 1 / 2, "retest 1 value": 1.0},
            "--repeated first": None,
            "--repeated last": None,
            "--repeated mean": None,
        },
    ),
    "a test": Asked(
        code=None,
        options="--coefficients bowker",
        text=CHANGES,
        tries={
            "--coefficients percent_agreement --symmetry": Asked(
                code=None,
                tries={"--raters Kim,Lee": {"symmetry 2 statistic": 1 / 3}},
            )
        },
    ),
    "limits": Asked(
        code=None,
        options="--coefficients bland_altman",
        text=CHANGES,
        tries={
            "masrel limits": {"limits_with_mean 0 n_measurements": 12.0},
        },
    ),
    "clusters": Asked(
        code=None,
        options="--clusters ward --target raters",
        text="item,ward,Kim,Lee\na,u,1,1\nb,v,2,1\nc,w,2,2\n",
        tries={"--target items": "11 21 22"},
    ),
    "as a whole": Asked(
        code=None,
        options="--stream --transpose",
        text=",a,b\nKim,1,2\nLee,1,1\n",
        tries={"--no-stream": "11 21"},
    ),
}

# Findings whose texts name options, and no row of the table.
NO_ROW = {
    "unpacked": "says to unpack the file, and names no option",
    "zstd": "names a command of another program",
    "no step": "is of spans; tests/cli/test_spans.py does what it says",
    "facets of text": "is of facets; tests/cli/test_gstudy.py does what it says",
}


def words_of(command: str) -> list[Suggestion]:
    """The options of a command, or the command itself, each with its value."""
    parts, found = shlex.split(command), []
    while parts:
        first = parts.pop(0)
        found.append((first, None if first in FLAGS or not parts else parts.pop(0)))
    return found


def suggestions(message: str) -> set[Suggestion]:
    """The options and commands that a message suggests, each with its value if any."""
    # what is wrong is named first, and what is not wanted behind these words
    text = re.sub(r"(^|: )(--[\w-]+( [^\s:]+)?(, )?)+(:| needs) ", ": ", message)
    text = re.sub(r"\b(without|not among|got)\b[^;:]*", "", text)
    found: set[Suggestion] = set()
    # a value is one letter, or quoted, or ends before a sign; or there are several
    value = r"'[^']*'|\S(?=\s|$)|[^\s;:)]+(?<![,.])"
    several = r"(?:(?:, [\w-]+)* or (?!-)[\w-]+)?"
    for option, first, more in re.findall(
        rf"(--[a-z][a-z-]*|\bmasrel)(?: ({value})({several}))?", text
    ):
        if option == "masrel" and first not in COMMANDS:
            continue
        if option in FLAGS or first in WORDS or first[:2] in ("", "--"):
            found.add((option, None))
            continue
        values = [*shlex.split(first), *re.findall(r"[\w-]+", more)]
        found.update((option, value) for value in values if value != "or")
    return found


PATTERNS = {
    code: re.compile("(^|: )" + re.sub(r"\\{.*?\\}", ".*", re.escape(text)) + "$")
    for code, text in _TEXTS.items()
}


def code_of(message: str) -> str | None:
    """The row of the table of texts that a message is made of, if any."""
    found = [code for code, pattern in PATTERNS.items() if pattern.search(message)]
    return max(found, key=lambda code: len(_TEXTS[code]), default=None)


def messages(done: Done) -> dict[str | None, str]:
    """What is refused, or warned of, by its code."""
    if done.code == 0:
        texts = [line for line in done.err.splitlines() if line[:9] == "warning: "]
    else:
        assert (done.code, done.out) == (2, ""), done
        (line,) = done.err.splitlines()
        texts = [line]
    return {code_of(text): text for text in texts}


def items_of(ratings: str) -> list[list[str | None]]:
    """Items by raters, of a text of them."""
    mark = "[^/]+" if "/" in ratings else "."
    rows = (re.findall(mark, row) for row in ratings.split())
    return [[None if grade == "." else grade for grade in row] for row in rows]


def check_answer(expected: Mapping[str, str | float | None], done: Done) -> None:
    """Grades and agreement of groups, or values at places of the JSON."""
    document = json.loads(done.out)
    grades: list[str] = []
    for where, needed in expected.items():
        if needed is None or isinstance(needed, float):
            found = document
            for key in where.split():
                found = found[int(key) if key.isdigit() else key]
            assert found == pytest.approx(needed, abs=1e-12), where
            continue
        items = items_of(needed)
        grades += [grade for row in items for grade in row if grade is not None]
        met = {
            of["coefficient"]: of["value"]
            for of in document["estimates"]
            if where in ("", *map(str, of.values()))
        }
        for name, value in agreement(items).items():
            right = None if value is None else pytest.approx(float(value), abs=1e-12)
            assert met[name] == right, (where, name)
    counts = {g.replace("; ", ";"): n for g, n in document["read"]["grades"].items()}
    assert not grades or counts == Counter(grades)


def run(masrel: Caller, path: Path, options: str) -> Done:
    """Call the command that is named last, or `agree`."""
    *_, last = options.rpartition("masrel ")  # another command has other options
    command, *words = shlex.split(last if "masrel " in options else f"agree {options}")
    return masrel(command, path, *words, "--json", "-")


def check(masrel: Caller, path: Path, asked: Asked, options: str, n_asked: int) -> None:
    """The message comes, and what it suggests answers it."""
    assert n_asked < 2, "a third question"
    first = run(masrel, path, options)
    met, is_refused = messages(first), first.code == 2
    assert asked.code in met, met
    suggested = suggestions(met[asked.code])
    tried = {of for words in asked.tries for of in words_of(words)}
    named = suggested | {
        (name, None) for name in re.findall(r"--[a-z-]+", met[asked.code])
    }

    def are_same(one: Suggestion, other: Suggestion) -> bool:
        return one[0] == other[0] and one[1] in (None, other[1])

    untried = {of for of in suggested if not any(are_same(of, by) for by in tried)}
    unsaid = {by for by in tried if not any(are_same(of, by) for of in named)}
    assert (untried, unsaid) == (set(), set()), met[asked.code]
    for words, expected in asked.tries.items():
        if expected is None:
            continue
        if isinstance(expected, Asked):
            check(masrel, path, expected, f"{options} {words}", n_asked + 1)
            continue
        done = run(masrel, path, f"{options} {words}")
        assert done.code == 0, (words, done.err)
        assert is_refused or asked.code not in messages(done), words
        check_answer({"": expected} if isinstance(expected, str) else expected, done)


@pytest.mark.parametrize("name", TABLE)
def test_what_a_message_suggests_answers_it(
    name: str, tmp_path: Path, masrel: Caller
) -> None:
    asked = TABLE[name]
    path = tmp_path / asked.name
    data = asked.text if isinstance(asked.text, str | bytes) else asked.text()
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    check(masrel, path, asked, asked.options, 0)


def rows_behind(rows: Iterable[object]) -> Iterator[Asked]:
    """Rows, and the questions behind them."""
    for row in rows:
        if isinstance(row, Asked):
            yield row
            yield from rows_behind(row.tries.values())


def test_every_suggestion_is_in_the_table() -> None:
    rows = [*rows_behind(TABLE.values())]
    suggest = {
        code for code, text in _TEXTS.items() if suggestions(text) or MORE.search(text)
    }
    assert suggest - {row.code for row in rows} == NO_ROW.keys()
    tried: dict[bool, set[tuple[str | None, str]]] = {True: set(), False: set()}
    for row in rows:
        for words, expected in row.tries.items():
            options = {(row.code, option) for option, _ in words_of(words)}
            tried[expected is not None] |= options
    assert tried[False] <= tried[True]
