"""What accuracy costs and what it buys, measured on the machine at hand, regime by regime."""
