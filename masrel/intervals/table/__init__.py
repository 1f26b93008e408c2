"""The posterior of a coefficient of two raters, from a Dirichlet on their table."""
