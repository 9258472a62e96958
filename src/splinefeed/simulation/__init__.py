"""The servo loop over setpoints, experiments on an axis, and the rules that tune it."""
