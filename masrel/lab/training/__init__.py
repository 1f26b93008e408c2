"""Training of raters: models of known grade, feedback, a test of what is learnt.

In: a protocol. Out: a log of its own for every rater. Nothing of a training enters the
ratings of the study.
"""
