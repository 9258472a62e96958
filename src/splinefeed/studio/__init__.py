"""The local web page: settings in, results out, every number from `pipeline`; see docs/studio.md."""
