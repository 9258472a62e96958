"""Feed planning: from a path and limits to how far along the path the tool is by when."""
