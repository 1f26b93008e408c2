"""The report of a study: tables, figures and pages.

In: a protocol, ratings and their analysis. Out: one self-contained HTML page, the
same as Markdown, tables as CSV, figures as PNG and SVG.
"""
