"""The page of accuracy: masrel and other packages beside exact fractions."""
