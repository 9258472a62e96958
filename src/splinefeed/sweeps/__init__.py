"""Many runs of one job over ranges of settings, shared among processes or a cluster.

`spec` is what a sweep asks, `work` one run of it, `sweeping` shares the runs over an executor, `store` the dataset that
grows and is taken up again.
"""
