"""The schedules of a study: who meets which model when, drawn once and kept.

Goes in: a protocol. Comes out: for each rater and session a schedule file that
names the models, and a blinded sheet that does not.
"""
