"""How a scene is answered: planned first, then followed for as long as it needs, then judged."""
