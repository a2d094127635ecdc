"""Every claim of the paper that has a number or a direction, measured, judged and written down."""
