"""The experiments: a file each; ``grasp_box.py`` is asked for as ``grasp-box``."""
