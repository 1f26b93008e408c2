"""Estimates, comparisons and retests of the ratings in a file."""
