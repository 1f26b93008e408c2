"""Judges beside people: whether a model rates as well as the humans it would replace.

In: grades of humans and of a judge, which may be a language model. Out: whether the
judge may stand for a human, rates corrected for its errors, and who is probably right.
"""

__all__: list[str] = []
