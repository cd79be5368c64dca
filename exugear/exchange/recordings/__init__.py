"""Recordings of measurements: UNV data set 58, CSV, WAV, HDF5 and netCDF files, read as channels over time."""
