"""The small study of the sessions' tests, and what is asked in it on paper."""

from tests.lab.run.conftest import new_study, small

__all__ = ["QUESTIONS", "new_study", "small"]

QUESTIONS = """
[[questionnaires]]
id = "arm"
title = "The arm"
when = "presentation"

[[questionnaires.questions]]
id = "realism"
text = "Like a patient's arm?"
type = "whole"
low = 1
high = 10

[[questionnaires]]
id = "end"
title = "At the end"
when = "session"

[[questionnaires.questions]]
id = "tired"
text = "How tired is your arm?"
type = "visual-analogue"

[[questionnaires.questions]]
id = "words"
text = "What would you change?"
type = "text"
required = false

[schedule]
"""
"""To be put in the place of ``[schedule]``."""
