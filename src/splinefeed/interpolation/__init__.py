"""The parameter at each servo tick: one function a published method, one shared loop, one registry."""
