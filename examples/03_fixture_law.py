"""What a virtual fixture makes of the operator's velocity, from free motion to a hard ruler.

    python examples/03_fixture_law.py

Equation (3.6) of Aarno's thesis: what is along the preferred direction counts k times, what is
across it 1 - k times. k = 1/2 is free motion at half the speed, k = 1 a hard ruler.
"""

import numpy as np

from hmcs.fixtures.law import full_speed_gains, general_law, thesis_law

velocity_m_s = np.array([0.10, 0.05, 0.0])
direction = np.array([1.0, 0.0, 0.0])

print("  k   thesis (3.6), m/s   at the operator's speed (2.29), m/s")
for k in (0.5, 0.6, 0.7, 0.8, 0.9, 1.0):
    thesis = thesis_law(velocity_m_s, direction, k)
    general = general_law(velocity_m_s, direction, full_speed_gains(k))
    print(f"{k:.1f}   {thesis[0]:.3f}  {thesis[1]:.3f}        {general[0]:.3f}  {general[1]:.3f}")
