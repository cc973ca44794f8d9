"""Hard random points for every scene, each compared with an independent truth: see `attack.command`."""
