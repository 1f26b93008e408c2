"""Letters of any script find a font, or it is said which have none."""

import warnings

import pytest

from masrel.errors import MissingLettersWarning
from masrel.plots import draw, forest
from masrel.plots._drawn_values import Drawn
from masrel.tables._estimate_words import forest_row
from tests.plots.made import blank, estimate


def test_letters_without_a_font_are_said_in_one_sentence_with_the_way_out() -> None:
    with pytest.warns(MissingLettersWarning) as caught:
        forest([estimate()] * 2, ["경미", "경"], ax=blank())
    (warning,) = caught
    assert str(warning.message) == (
        "no font here has 경 미: such letters are drawn as boxes; set MASREL_FONT to "
        "the file or the name of a font that has them"
    )
    assert warning.filename == __file__


@pytest.mark.parametrize(("form", "is_said"), [("png", True), ("inline", False)])
def test_a_page_has_the_letters_of_its_reader(form: str, is_said: bool) -> None:
    rows = (forest_row("경미", estimate()),)
    shown = Drawn("masrel.plots._forest:forest_picture", (rows, "agreement"))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        draw(shown, stamp="", forms=(form,))
    assert [of.category for of in caught] == [MissingLettersWarning] * is_said
