"""From a path and limits to a time law s(t): the planner, seven-phase profiles, and the override of laws."""
