"""The chain as one call: read, plan, interpolate, measure; what the command line and other front ends share."""
