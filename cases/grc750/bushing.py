"""GRC 750 kW gearbox on its rolling bearings: tables, run-up, waterfall and modes, in one go.

    python cases/grc750/bushing.py [results folder]

Results go to results/grc750 by default; tables that are there already are used again.
"""

from __future__ import annotations

from one_variant import compute

if __name__ == "__main__":
    compute("bushing")
