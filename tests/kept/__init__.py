"""Results that are shown from what is kept with them."""
