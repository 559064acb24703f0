"""Live scenarios: parameters, targets and bodies that change while a run goes on."""
