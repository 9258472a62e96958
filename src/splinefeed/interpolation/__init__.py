"""The parameter at each servo tick: one file a published method, one shared loop, one registry."""
