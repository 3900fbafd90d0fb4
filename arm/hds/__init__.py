"""The automaton language and its runtime; knows nothing of arms."""
