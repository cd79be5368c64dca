"""Versions of the methods that give stored numbers; part of the hash of every input.

Raise a number when a change of the method, or of what it rests on, changes what is stored: results of the old
version are then computed again or refused. A change that leaves all numbers as they are leaves the version, too.
"""

from __future__ import annotations

#: Table of the static transmission error by the superelement (`fe_ste.transmission_error`).
TABLE = 7

#: Contact about a state (`fe_ste.transmission_error.mean_contact`); it rests on `TABLE`, too.
MEAN_CONTACT = 7

#: Table by the reference analysis (`fe_ste.reference.table`, and what it is computed by).
NONLINEAR_TABLE = 3
