"""Results: motion, contacts, events, energy and figures of a run, in memory and in files."""
