"""Commands of the laboratory, one a file."""
