"""Letters of any script find a font, or it is said which have none."""

import warnings

import pandas as pd
import pytest

import masrel
from masrel.errors import MissingLettersWarning
from masrel.plots import forest
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


@pytest.mark.parametrize("is_page", [True, False])
def test_a_page_has_the_letters_of_its_reader(is_page: bool) -> None:
    named = pd.DataFrame([[1, 1], [2, 1], [1, 2]], columns=["경미", "경"])
    result = masrel.agree(named, reading=masrel.Reading(no_item=True))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        if is_page:
            assert "경미" in result.to_html()
        else:
            result.plot("grades")
    is_said = any(of.category is MissingLettersWarning for of in caught)
    assert is_said is not is_page
