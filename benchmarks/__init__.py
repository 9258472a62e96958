"""What splinefeed costs, beside C and other libraries; `python -m benchmarks [NAME ...]` writes it down."""
