"""One file a format, in and out: drawings, CAD, G-code, curves and tables of points; records as HDF5 and others."""
