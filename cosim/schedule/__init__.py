"""The schedule: what an engine does in a tick, one operation after the other."""
