"""FMUs: files, instances, prepared calls, logs."""
