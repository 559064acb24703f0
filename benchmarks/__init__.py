"""Speed of the package against others, as ratios."""
