"""The basic blocks, one a file."""
