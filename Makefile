# splinefeed: everything here needs python3 (3.11 or newer), make and git, and touches only .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet install --constraint constraints.txt
RECIPE_OF_VENV := pyproject.toml constraints.txt
# What the user adds to the command, e.g. make run ARGS="wing.dat --feed 3600mm/min"
ARGS ?=

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help run test docs test-linuxcnc test-browser test-package test-long lint coverage mutants bench torture clean

help: ## print these targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

run: $(VENV)/.installed ## turn the paper's airfoil (or ARGS="FILE ...") into setpoints, tables and figures
	$(BIN)/splinefeed run $(ARGS)

test: lint ## lint, then the fast tests with the compiler off, then the whole suite
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -n 2 --dist worksteal -q -m "nojit and not torture and not package"
	$(BIN)/python -m pytest -n 2 --dist worksteal

test-linuxcnc: $(VENV)/.installed-dev ## play streams into LinuxCNC's HAL, hold programs against its interpreter (as root on Debian it installs LinuxCNC)
	@command -v halcmd >/dev/null || { [ "$$(id -u)" = 0 ] && apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends linuxcnc-uspace; } || { echo "LinuxCNC is not here: apt-get install linuxcnc-uspace (Debian 12), as root"; exit 1; }
	$(BIN)/python -m pytest -n 0 -m linuxcnc tests/live tests/formats

test-browser: $(VENV)/.installed-dev ## drive the studio and the reports in Chromium (as root on Debian it installs it)
	@command -v chromium >/dev/null || { [ "$$(id -u)" = 0 ] && apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium; } || { echo "Chromium is not here: apt-get install chromium (Debian), as root"; exit 1; }
	$(BIN)/python -m pytest -n 0 -m browser

test-package: $(VENV)/.installed-dev ## build wheel and sdist, install them and each extra into bare environments, and run (from the registry)
	$(BIN)/python -m pytest -n 0 -m package tests/package

lint: $(VENV)/.installed-dev ## ruff, mypy and the directions between the rooms
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict
	$(BIN)/lint-imports

docs: $(VENV)/.installed-dev ## the documentation as a site, build/docs/index.html (no network; a warning is an error)
	$(BIN)/sphinx-build -W --keep-going -q -b html -d build/doctrees docs build/docs
	@echo "see build/docs/index.html"

# The rooms whose lines are counted stand in pyproject.toml; these are the tests that are about them.
PLAIN := $(addprefix tests/,analysis feed interpolation literature machine simulation pipeline/test_tuning.py \
	formats/gcode/test_kernel.py formats/gcode/test_language.py formats/test_bit_pattern.py \
	$(addprefix geometry/test_,arc_length.py kernels.py nearest.py polyline.py rotary.py small_kernels.py smoothing.py \
	smoothing_order.py))

# On a busy machine plain Python takes as long as it takes: no test is given up, and the slowest are named. What ran is
# counted and told even if a test fails; the target fails with it.
coverage: $(VENV)/.installed-dev ## the lines of the computing rooms that tests run as plain Python; fails if a room is below 95 %
	rm -f .coverage .coverage.*
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -n 2 -q --timeout 0 --durations 20 --cov --cov-context=test --cov-report= --cov-fail-under=0 --junitxml=build/coverage.xml $(PLAIN); \
	passed=$$?; $(BIN)/python -m coverage report --fail-under=0 && $(BIN)/python -m tests.lines $(ARGS) && exit $$passed

mutants: $(VENV)/.installed-dev ## after make coverage: change kernels at random, see whether tests notice (ARGS="--count 50 --seed 1")
	$(BIN)/python -m tests.mutants $(ARGS)

bench: $(VENV)/.installed-bench ## measure against C and other libraries (needs gcc)
	$(BIN)/python -m benchmarks $(ARGS)

torture: $(VENV)/.installed-dev ## random cases of every kind, an hour on all cores, and a table (ARGS="--minutes 10 --seed 7")
	$(BIN)/python tests/torture.py $(ARGS)

test-long: $(VENV)/.installed-dev ## the long tests of single parts, over very many cases (hours)
	$(BIN)/python -m pytest -n 2 -m torture

clean: ## remove .venv and what the tools left behind
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .import_linter_cache .pytest_cache .hypothesis .coverage htmlcov
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "splinefeed needs Python 3.11 or newer; set it with: make PYTHON=python3.12")'
	@echo "Making $(VENV); the first time this takes a minute or two."
	$(PYTHON) -m venv $(VENV)

# One stamp for each set of packages: nothing is installed again until the project's recipe changes.
$(VENV)/.installed: $(RECIPE_OF_VENV) | $(BIN)/python
	$(PIP) --editable '.[report]'
	@touch $@

$(VENV)/.installed-dev: $(RECIPE_OF_VENV) | $(BIN)/python
	$(PIP) --editable '.[dev,cad,parquet,report,dask,mpi,studio,docs]'
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-bench: $(RECIPE_OF_VENV) | $(BIN)/python
	$(PIP) --editable '.[bench,cad]'
	@touch $@ $(VENV)/.installed
