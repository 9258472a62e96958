"""One file a format, in and out: curves as JSON, airfoils as .dat, records as HDF5, CSV and MATLAB files."""
