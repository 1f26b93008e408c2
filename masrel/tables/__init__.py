"""Tables of results, in every form, and the rules of rounding."""
