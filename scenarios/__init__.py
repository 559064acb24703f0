"""The shipped scenarios: TOML files beside this one, and the surfaces and routines they name."""
