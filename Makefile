# `make demo` and `make test` set up everything they need in .venv and run.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
# The commit that `make changed` and `make test HOUSE=changed` compare with.
SINCE  ?= main
# No house: every test, whatever the environment says.
HOUSE  :=
# What tests, linters and pictures need beside the program.
DEV    := $(VENV)/.developer
LOCK   := uv pip compile --universal --no-strip-extras --python-version 3.11 --generate-hashes --no-annotate --no-header

.PHONY: demo test tests changed quick docs test-python coverage soak bench challenge false-acceptance format lint lock clean setup pictures

demo: $(STAMP)
	$(BIN)/accept demo --out out/demo

# Linters beside the tests; three processes for two cores, because tests that wait for programs come first and in one of
# them, and each process collects all tests for itself.
# HOUSE="checks/gap hw" runs the tests of these houses and of the doors above, HOUSE=changed of those that differ from
# main or from SINCE (tests/shared/houses.py).
test: $(DEV)
	$(MAKE) --no-print-directory --jobs 2 tests lint

# Tests start hundreds of programs: what one of them has compiled, the others read, whatever the environment says.
tests quick soak changed coverage: export PYTHONDONTWRITEBYTECODE :=

tests: $(DEV)
	lane=$$($(if $(HOUSE),$(BIN)/python -m tests.shared.houses $(HOUSE) $(if $(filter changed,$(HOUSE)),$(SINCE)),true)) && \
		$(BIN)/python -m pytest -n 3 --dist worksteal $$lane

# What the linters can put right by themselves: lines, imports.
format: $(DEV)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

lint: $(DEV)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.shared.line_budget

# The lane for the hands: linters, and of each house the tests that say most in least time. Under 90 s on two cores.
quick: $(DEV) lint
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow" tests/test_sources.py tests/test_imports.py tests/accept/base \
		$$($(BIN)/python -m tests.shared.houses doors)

# The documentation site, as files, in site/.
docs: $(DEV)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

# The tests with another interpreter, in an environment of its own: make test-python PYTHON=python3.13
test-python:
	$(MAKE) test VENV=.venv-$(notdir $(PYTHON))

# Lines that the tests reach. Tracing makes them some 40 % slower, so it is no part of `make test`.
coverage: $(DEV)
	$(BIN)/python -m pytest -n 2 --dist worksteal --cov --cov-report=term:skip-covered

# The heavy proofs in full: every kill, every damaged file.
soak: $(DEV)
	ACCEPT_SOAK=1 $(BIN)/python -m pytest

# The heavy proofs of what differs from a commit: make changed SINCE=HEAD~3
changed: $(DEV)
	ACCEPT_SINCE=$(SINCE) $(BIN)/python -m pytest -n 4 --dist worksteal -m soak

# Speed as ratios measured in one run; numbers, not verdicts.
bench: $(DEV)
	for b in benchmarks/bench_*.py; do echo "== $$b"; $(BIN)/python $$b || exit 1; done

# The blind test: 300 units nobody has seen, truth sealed beforehand, scores against their targets. Goes on where it was
# stopped. SET=scatter-1 runs one set only, CASES=10 the first ten units of each, CLUSTER=tcp://HOST:8786 on a cluster.
challenge: $(DEV)
	$(BIN)/python -m validation.challenge --out out/challenge $(if $(SET),--set $(SET)) $(if $(CASES),--cases $(CASES)) $(if $(CLUSTER),--cluster $(CLUSTER))

# 400 struts as built about the limits of their misalignment: how many that are accepted lie outside, against what is
# stated of them. Goes on where it was stopped.
false-acceptance: $(DEV)
	$(BIN)/python -m validation.studies.false_acceptance --out out/false_acceptance

setup: $(DEV)

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "accept needs Python 3.11 or later; set PYTHON=..."; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' || { echo "accept needs Python's venv module (Debian: apt install python3-venv)"; exit 1; }
	rm -rf $(VENV)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

$(DEV): $(STAMP) requirements-dev.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements-dev.lock
	touch $@

# Renew the pictures of the documentation (needs pdftoppm).
pictures: $(DEV)
	$(BIN)/accept demo --out build/pictures
	mkdir -p docs/img
	pdftoppm -r 100 -png -singlefile build/pictures/certificates/APA-03.pdf docs/img/certificate
	$(BIN)/python tests/accept/tui/picture_screens.py docs/img
	$(BIN)/python tests/shared/explanation_figures.py docs/img/physics
	$(BIN)/python tests/accept/fleet/picture_fleet.py docs/img/fleet
	rm -rf build/tutorial
	$(BIN)/accept simulate unit --kind strut --model strut-as-built --draw --serial S-T --dy-um 150 --seed 11 --low-s 12 --high-s 12 --out build/tutorial/S-T
	$(BIN)/accept gap build/tutorial/S-T --model strut-as-built --out build/tutorial/out
	pdftoppm -r 75 -png build/tutorial/out/gap.pdf docs/img/gap

# Renew the locks after a change of pyproject.toml (needs uv): what runs, and what develops, at the same versions.
lock:
	$(LOCK) --all-extras pyproject.toml -o requirements-dev.lock
	$(LOCK) --extra build --constraint requirements-dev.lock pyproject.toml -o requirements.lock
	$(LOCK) --extra build --extra cluster --extra remote --constraint requirements-dev.lock pyproject.toml -o requirements-cluster.lock

clean:
	rm -rf $(VENV) .venv-* build out .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
