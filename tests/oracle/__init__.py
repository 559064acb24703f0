"""The slow, obvious twin: contacts, laws and mechanics straight from their definitions."""
