"""Many runs: what a sweep asks, one run of it, the engines that share the work, and the dataset that grows."""
