# make demo   watch eight simulated vehicles patrol two zones
# make quick  style, types, walls and the tests of what changed; within a minute
# make test   style, types and tests
# make flights  the long tests: whole flights, also attacked ones, rehearsals
# make endurance  more cases of what make flights shows once, before a release
# make keys   whole missions at 1x with nothing but keys, as at a real terminal; ten minutes
# make bench  the measured figures
# make lint   style and types only
# make guard  the guard's tests, every branch of it reached
# make mutants  whether they notice every little change of it; takes some minutes
# make fuzz HOURS=8  hostile frames with new seeds; one round without HOURS
# make soak HOURS=24  eight vehicles behind bad links; memory and files of the station once a minute
# make docs   the manual as a site, in site/
# make dist   a source distribution and a wheel, in dist/
# make distcheck   the wheel, installed and flown with on each Python of this machine
# make conformance LINK=udpin:127.0.0.1:14550 IDS=1-8   judge the vehicles on a link; they will fly (ONLY=words: those checks)
#
# Each makes .venv with pinned packages first; nothing is installed outside this folder, no root is needed.
# Another interpreter: make PYTHON=python3.12 test

PYTHON = python3
BIN = .venv/bin
PIP = $(BIN)/python -m pip --disable-pip-version-check --quiet install --constraint constraints.txt
BUILD = $(PIP) setuptools && $(PIP) --no-build-isolation --editable

LINK = udpin:127.0.0.1:14550
IDS =
ONLY =
HOURS =
# Those on PATH, and those of pyenv, whose commands work only where they are chosen.
PYTHONS = $(sort $(foreach minor,11 12 13 14,$(shell python3.$(minor) -c 'import ensurepip, sys; print(sys.executable)' 2>/dev/null)) \
  $(wildcard $(HOME)/.pyenv/versions/3.1[1-4].*/bin/python3.1[1-4]))

.PHONY: demo quick test flights endurance keys bench conformance guard mutants fuzz soak lint bytecode clean docs dist distcheck

# Where this is set, every process of the tests would compile all that it imports for itself.
unexport PYTHONDONTWRITEBYTECODE

demo: .venv/installed
	$(BIN)/tui-gcs demo

quick: .venv/installed-dev
	@$(MAKE) --no-print-directory lint
	$(BIN)/pytest --numprocesses 2 --dist loadgroup -m 'not long and not endurance and not by_keys and not process' $$($(BIN)/python -m tests.quick)

test: .venv/installed-dev
	@$(MAKE) --no-print-directory --jobs=2 lint bytecode
	$(BIN)/pytest --numprocesses 3 --dist loadgroup -m 'not long and not endurance and not by_keys'

# Two of the four mostly wait, for flights at 1x (tests/conftest.py); the others have a core each.
flights: .venv/installed-dev
	$(BIN)/pytest --numprocesses 4 --dist loadgroup -m long

endurance: .venv/installed-dev
	$(BIN)/pytest --numprocesses 3 --dist loadgroup -m endurance

keys: .venv/installed-dev
	$(BIN)/pytest -m by_keys

bench: .venv/installed-dev
	$(BIN)/python -m tests.bench

conformance: .venv/installed-dev
	$(BIN)/python -m tests.conformance --link $(LINK) $(if $(IDS),--ids $(IDS)) $(ONLY)

guard: .venv/installed-dev
	$(BIN)/coverage run --branch --include='tui_gcs/core/guard/*' --omit='*/bypass.py,*/conflict_prediction.py' --data-file=.venv/guard.coverage -m pytest -q -n0 tests/core/guard
	$(BIN)/coverage report --data-file=.venv/guard.coverage --show-missing --fail-under=100

mutants: .venv/installed-dev
	$(BIN)/python -m tests.mutants

fuzz: .venv/installed-dev
	$(BIN)/python -m tests.fuzz $(HOURS)

soak: .venv/installed-dev
	$(BIN)/python -m tests.soak $(HOURS)

docs: .venv/installed-docs
	$(BIN)/python docs/make_reference.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

dist: .venv/installed-dev
	rm -rf dist build
	$(BIN)/python docs/make_reference.py --man
	$(BIN)/python -m build --no-isolation --outdir dist .

distcheck: .venv/installed-dev
	TUI_GCS_PYTHONS=$(shell echo $(PYTHONS) | tr ' ' ':') $(BIN)/pytest tests/system/test_wheel.py

lint: .venv/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Tests are compiled in a way of their own, and each of the processes that run them would do it for all of them. mypy
# leaves a core for that. What is wrong with them is told when they run.
bytecode: .venv/installed-dev
	@$(BIN)/pytest --collect-only > /dev/null 2>&1 || true

clean:
	find tui_gcs sitl tests -name __pycache__ -prune -exec rm -rf {} +
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info build dist site man

# A stamp is newer than what it was made from, so an installation is made once, and again when the pins change.
.venv/installed: pyproject.toml constraints.txt .venv/made
	@echo "installing into .venv ..."
	@$(BUILD) .
	@touch $@

.venv/installed-dev: pyproject.toml constraints.txt .venv/made
	@echo "installing into .venv, with the tools for tests ..."
	@$(BUILD) '.[dev]'
	@touch .venv/installed $@

.venv/installed-docs: .venv/installed-dev
	@$(BUILD) '.[docs]'
	@touch $@

.venv/made:
	@command -v $(PYTHON) >/dev/null || \
	  { echo "tui-gcs needs Python 3.11 or newer: there is no $(PYTHON) here" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "tui-gcs needs Python 3.11 or newer; name one with: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "$(PYTHON) has no venv module; install it (Debian, Ubuntu: the package python3-venv)" >&2; exit 1; }
	@$(PYTHON) -m venv --clear .venv
	@touch $@
