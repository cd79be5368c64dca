"""Order tracking of measured run-ups: angle of a shaft from a tacho or a speed signal, and order cuts over it.

Functions take arrays; files and units are in `exugear.exchange.recordings`.
"""
