"""Numbers that the parts of the planner share."""

#: What differs by less than this share is the same: arc lengths of a path, times, shares of a limit. Sums of a million
#: terms round by less, and no machine tells it apart.
SAME = 1e-12
#: A motion keeps its limits if the audit finds q over them by no more than this share: jerk, which goes with q^(3/2),
#: is then over by less than what the check and setpoints allow (`records.verdict.KEPT`).
KEPT = 5e-7
#: What is below this share of a period, of a piece or of what is around it is none: roundings add up to less.
ALMOST = 1e-9
#: A motion that is over a limit by more than this, as a factor on q, is none: no feed mends it.
HOPELESS = 100.0
#: What rounding of a value may come to, in units of its last place.
ROUNDINGS = 8.0
#: Rounds in which what is over a limit is held lower, at most; twice as many where nothing is slowed down afterwards.
ROUNDS = 4
#: Halvings that tell where a motion can begin or end to a thousandth.
BISECTIONS = 10
#: Halvings that take any interval to the rounding of its middle.
HALVINGS = 50
#: Places that are looked at together: their arrays stay in the processor's cache.
TOGETHER = 1 << 15
