"""Recordings of measurements: UNV data set 58, CSV, WAV, HDF5, netCDF and MDF files, read as channels over time."""
