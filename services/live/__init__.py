"""Services as real processes: loops, supervisor, what people watch while they run."""
