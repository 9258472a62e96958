"""Numbers from records and paths: feed ripple, drift, chord error, the motion of each axis."""
