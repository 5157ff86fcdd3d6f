"""The engine that runs everywhere, generated Python, and the choice between the two."""
