"""Results folder and files of runs, and what is computed from them: spectra, sound power, order tracking."""
