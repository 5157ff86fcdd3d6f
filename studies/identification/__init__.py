"""Identification of braking models from logs: reading, fitting, and what the figures are worth."""
