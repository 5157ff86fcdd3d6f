"""The small controller of campaign.py. It needs nothing but Python: any contender can call it."""

GAIN, LEAST, LAST = 1.3, -1.0, 0.5  # 1, m/s², m


def law(position: float, speed: float) -> float:
    """Return the command (m/s²) of a train that is to stop at position 0 (m): v²/2d, corrected."""
    togo = -position
    needed = -0.5 * speed * speed / togo if togo > LAST else -LAST
    command = needed + GAIN * (needed + 0.7) if needed < -0.6 else needed
    return max(LEAST, min(command, 0.3))
