"""The railway's customary units: gradients in ‰, resistance in N/kN, speeds in km/h."""

GRAVITY_PER_MILLE = 9.81 / 1000.0  # m/s² for 1 N/kN or 1 ‰; the precise braking paper, eq. 3
KILOMETRES_PER_HOUR = 3.6  # for 1 m/s
JOULES_PER_KWH = 3.6e6
