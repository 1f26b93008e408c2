"""The protocol of a study: its types, and reading it with every error at once."""
