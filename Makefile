# splinefeed: everything here needs python3 (3.11 to 3.14) with its venv, make and git, and touches only .venv and build.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
# Python compiles what it imports, when it imports it: pip need not compile everything first.
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet install --no-compile
# What a set of constraints.txt names, each file of it compared with its hash, and the project beside it.
INSTALL = grep -E '^[^\#].*\# (.* )?$(1)( |$$)' constraints.txt > $@.txt && $(PIP) --require-hashes --requirement $@.txt \
	&& $(PIP) --no-deps --no-build-isolation --editable . && rm $@.txt
RECIPE_OF_VENV := pyproject.toml constraints.txt
PYTEST := $(BIN)/python -m pytest -n 2 --dist worksteal -q
# What the user adds to the command, e.g. make run ARGS="wing.dat --feed 3600mm/min"
ARGS ?=

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help run test test-slow test-all lint docs strings bench torture clean

help: ## print these targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

run: $(VENV)/.installed ## turn the paper's airfoil (or ARGS="FILE ...") into setpoints, tables and figures
	$(BIN)/splinefeed run $(ARGS)

test: lint ## lint, and every test that guards a promise to users: a few minutes
	$(PYTEST)

test-slow: $(VENV)/.installed-all ## the slow tests alone; what misses a program or a registry says so and is skipped
	NUMBA_DISABLE_JIT=1 $(PYTEST) -m nojit
	$(PYTEST) -m slow

test-all: test test-slow ## both: what has to be green before a change lands

lint: $(VENV)/.installed-dev ## ruff, mypy and the directions between the rooms
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict
	$(BIN)/lint-imports

docs: $(VENV)/.installed-all ## the documentation as a site, build/docs/index.html (no network; a warning is an error)
	$(BIN)/sphinx-build -W --keep-going -q -b html -d build/doctrees docs build/docs
	@echo "see build/docs/index.html"

strings: $(BIN)/python ## print every string that users see, to be read from top to bottom
	@$(BIN)/python tests/strings.py

bench: $(VENV)/.installed-bench ## measure against C and other libraries (needs gcc)
	$(BIN)/python -m benchmarks $(ARGS)

torture: $(VENV)/.installed-dev ## random cases of every kind, an hour on all cores, and a table (ARGS="--minutes 10 --seed 7")
	$(BIN)/python tests/torture.py $(ARGS)

clean: ## remove .venv and what the tools left behind
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .import_linter_cache .pytest_cache .hypothesis
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

# One line to the user, whatever his Python lacks.
INSTEAD := or name another Python: make PYTHON=python3.12
$(BIN)/python:
	@command -v $(PYTHON) >/dev/null || { echo "splinefeed: there is no $(PYTHON); on Debian: apt-get install python3 python3-venv; $(INSTEAD)"; exit 1; }
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(not (3, 11) <= v[:2] <= (3, 14) and "splinefeed: needs Python 3.11 to 3.14, and $(PYTHON) is %d.%d; on Debian 12: apt-get install python3 python3-venv; $(INSTEAD)" % v[:2])'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "splinefeed: $(PYTHON) cannot make environments; on Debian: apt-get install python3-venv; $(INSTEAD)"; exit 1; }
	@echo "Making $(VENV); the first time this takes a minute or two."
	$(PYTHON) -m venv $(VENV)

# One stamp for each set of packages: nothing is installed again until the project's recipe changes.
$(VENV)/.installed: $(RECIPE_OF_VENV) | $(BIN)/python
	@$(call INSTALL,run)
	@touch $@

$(VENV)/.installed-dev: $(RECIPE_OF_VENV) | $(BIN)/python
	@$(call INSTALL,dev)
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-all: $(RECIPE_OF_VENV) | $(BIN)/python
	@$(call INSTALL,all)
	@touch $@ $(VENV)/.installed $(VENV)/.installed-dev

$(VENV)/.installed-bench: $(RECIPE_OF_VENV) | $(BIN)/python
	@$(call INSTALL,bench)
	@touch $@ $(VENV)/.installed
