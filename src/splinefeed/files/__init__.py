"""What every reader and writer of files shares: text within bounds, numbers, whole files or none.

`source` opens files and `sizes` bounds them, `native_process` runs readers of others in a process of their own;
`table_text` and `json_values` take texts apart; `metadata` is what files say of a record; `plain` makes values for
JSON; `atomic` writes to a temporary name and renames.
"""
