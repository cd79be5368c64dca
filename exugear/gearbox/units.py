"""Units of the input files in SI units: a number times its unit, `MM * length_mm`. Keys end with their unit."""

from __future__ import annotations

import math
from typing import Final

MM: Final = 1e-3
"""A millimetre, m."""
UM: Final = 1e-6
"""A micrometre, m."""
KN: Final = 1e3
"""A kilonewton, N."""
MPA: Final = 1e6
"""A megapascal, Pa."""
GPA: Final = 1e9
"""A gigapascal, Pa."""


RPM = math.pi / 30.0
"""One revolution per minute, rad/s."""
