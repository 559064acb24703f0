"""The package against published experiments: cases, their data and their bounds."""
