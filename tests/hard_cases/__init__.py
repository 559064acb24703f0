"""Cases with a closed form, or a bound that physics sets: python -m tests.hard_cases."""
