"""FMUs and loops of blocks that depend on each other, at an instant and over a step."""
