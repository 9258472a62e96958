"""The planner: q(s) = feed^2 as a cubic spline on cells of the path, every limit a row, one interior point."""
