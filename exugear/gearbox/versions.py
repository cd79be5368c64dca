"""Versions of the methods that give stored numbers; part of the hash of every input.

Raise a number when a change of the method, or of what it rests on, changes what is stored: results of the old
version are then computed again or refused. A change that leaves all numbers as they are leaves the version, too.
Tables have theirs in `fe_ste.tools.versions`.
"""

from __future__ import annotations

#: Reduced elastic bodies (`exugear.system.bodies`). Runs and modes rest on it.
REDUCTION = 1
#: Eigenmodes (`exugear.system.modes`, and the laws and matrices of `exugear.system.system`).
MODES = 5
#: Runs in time (`exugear.transient`, both solvers, the laws, signals and filters).
RUN = 10
#: Life of gears and bearings (`exugear.life`, and the root stress of `fe_ste.root_stress`).
LIFE = 9
#: Steady responses (`exugear.steady`, and all that modes rest on).
STEADY = 13
#: Points of studies (`exugear.studies`: their outputs; what these rest on has its own version).
STUDY = 3
