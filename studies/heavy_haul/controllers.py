"""The line-up of controllers on a coupler's force, and of those on the train's speed."""

from ...controllers import FuzzyPID, SamplePID

SAMPLE = 0.002  # s; the paper's

FORCE: dict[str, SamplePID] = {
    "pid": SamplePID(),
    "pid_fast": SamplePID(kp=1.5, ki=0.006),
    "pid_feed_forward": SamplePID(feed_forward=True),
    "fuzzy_literal": FuzzyPID(reading="literal"),
    "fuzzy_literal_little": FuzzyPID(reading="literal", extreme=2.0),
    "fuzzy_folded": FuzzyPID(),
}
# The integral gain taken in 1/s: the train rolls back.
PER_SECOND: dict[str, SamplePID] = {"pid_ki_per_second": SamplePID(ki=0.003 * SAMPLE)}
INFERENCE: dict[str, SamplePID] = {
    "fuzzy_folded_table": FuzzyPID(inference="table"),
    "fuzzy_folded_sum": FuzzyPID(integral="sum"),
}

# On speed the gains are per m/s: 4 MN times the paper's, but ki, which is a tenth of it: the train
# is an integrator, where the coupler's force is none. Universes ±1 m/s and ±2 cm/s per sample.
# All ours.
SPEED: dict[str, SamplePID] = {
    "pid": SamplePID(unit="m/s", scale=4e6, ki=3e-4),
    "fuzzy_folded": FuzzyPID(
        unit="m/s", scale=4e6, ki=3e-4, ki_change=6e-4, universe=1.0, change_universe=0.02
    ),
}
