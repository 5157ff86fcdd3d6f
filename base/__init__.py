"""The ground floor: units, errors, float-or-symbol operations, compilers, the cache."""
