"""Numbers from records and paths: the verdict on every limit, ripple, drift, chord and contour error, spectra."""
