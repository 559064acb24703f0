"""What files of generated parts cost against their exact CAD faces: `python -m tests.parts`."""
