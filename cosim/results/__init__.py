"""What a run records, and who looks on."""
