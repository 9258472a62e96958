"""Setpoints to a running controller: a look-ahead buffer, override, hold and stop; one small file a sink."""
