"""The model of raters who agree with themselves, each to a degree of his or her own."""
