"""``python -m services.cli``: the command line without its installed script."""

from services.cli.main import main

main()
