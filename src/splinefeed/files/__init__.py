"""What every reader and writer of files shares: text within bounds, numbers, whole files or none.

`source` opens files and `sizes` bounds them, `native_process` runs readers of others in a process of their own;
`table_text`, `json_values` and `markup` (XML) take texts apart; `metadata` is what files say of a record; `plain` makes
values for JSON; `atomic` writes to a temporary name and renames.
"""
