"""The local web page: settings in, results out, every number from `runs`; docs/studio.md describes it.

`server` talks to the browser, whose page is `page/`; `house` holds what is open, `staff` the worker processes, which
do `tasks`. `settings` checks what a page wants, `sources` finds its path, `results` is what it is sent, `history`
keeps what was planned.
"""
