# Everything a fresh machine needs: Python 3.11 or newer with its venv module, and make.
# The first target that needs it builds .venv; later ones reuse it until the lock changes.

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# the first of the usual names that is new enough; override with PYTHON=...
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
SCENARIO ?= whiteboard_moving

.DEFAULT_GOAL := help
.PHONY: help setup test check pytest docs format demo lock clean

help:  ## show this list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

setup: $(STAMP)  ## build .venv with the locked dependencies and this project in it

$(STAMP): requirements.lock pyproject.toml
	@if [ -z "$(PYTHON)" ]; then \
		echo "steadyhand needs Python 3.11 or newer, and found none." >&2; \
		echo "Install one (for example: apt-get install python3 python3-venv)," >&2; \
		echo "or name it: make setup PYTHON=/path/to/python3" >&2; exit 1; fi
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "steadyhand needs Python 3.11 or newer; $(PYTHON) is not." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "$(PYTHON) has no venv module. On Debian or Ubuntu: apt-get install python3-venv" >&2; \
		exit 1; }
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

test: check docs pytest  ## all checks, the docs and all tests

check: setup  ## lint, format, types, who imports whom
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

# on simulated time side by side; what starts real processes alone on the machine
pytest: setup
	$(BIN)/python -m pytest -n auto --maxprocesses 4 -m "not processes and not browser"
	$(BIN)/python -m pytest -m "processes or browser"

docs: setup  ## the pages of docs/ as a site in build/site, warnings as errors
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict --site-dir build/site

format: setup  ## put the code into the project's format
	$(BIN)/ruff format
	$(BIN)/ruff check --fix

demo: setup  ## draw on the whiteboard from a moving platform, live (SCENARIO=... for another)
	$(BIN)/steadyhand up $(SCENARIO) --until-finished --for 120

# uv resolves for every platform and Python at once; it is used here and nowhere else
lock:  ## resolve the dependencies anew into requirements.lock
	$(PYTHON) -m venv --clear build/lockenv
	build/lockenv/bin/python -m pip install --quiet --disable-pip-version-check uv
	build/lockenv/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 \
		--extra dev --generate-hashes --no-header --no-annotate --no-emit-index-url \
		pyproject.toml -o requirements.lock
	@! grep -nE '://|file:|--(extra-)?index-url|--find-links' requirements.lock

clean:  ## remove the environment and everything generated, but not runs/
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache \
		.import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
