"""Damaged files for every reader of the package: see __main__ and docs/reliability.md."""
