"""The compiled stepper: a small C file that carries out any schedule, built once on a machine."""
