"""Versions of the methods that compute stored numbers; they are part of the hash of every input.

Increase a number when a change of the method, or of a method that it uses, changes stored numbers. Results of the old
version are then recomputed or refused. A change that leaves all numbers as they are leaves the version unchanged.
Versions of tables are in `fe_ste.tools.versions`.
"""

from __future__ import annotations

#: Reduced flexible bodies (`exugear.system.bodies`), which runs and modes use.
REDUCTION = 2
#: Eigenmodes (`exugear.system.modes`, and the models and matrices of `exugear.system.system`).
MODES = 6
#: Runs in time (`exugear.transient`, both solvers, the models, signals and filters).
RUN = 14
#: Life of gears and bearings (`exugear.life`, and the root stress of `fe_ste.root_stress`).
LIFE = 13
#: Steady-state responses (`exugear.steady`, and all methods that modes use).
STEADY = 34
#: Comparisons with measured run-ups (`exugear.steady.evaluation`, `exugear.results.order_tracking`).
MEASURED = 5
#: Points of studies (`exugear.studies`: their outputs; the methods that these use have their own versions).
STUDY = 5
