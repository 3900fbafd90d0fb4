"""What crosses between processes: the bus, its encoding, where it listens."""
