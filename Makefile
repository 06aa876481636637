# `make demo` and `make test` set up everything they need in .venv and run.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed

.PHONY: demo test soak bench challenge lint lock clean setup pictures

demo: $(STAMP)
	$(BIN)/accept demo --out out/demo

test: $(STAMP) lint
	$(BIN)/python -m pytest -n 2

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The heavy proofs in full: every kill, every damaged file.
soak: $(STAMP)
	ACCEPT_SOAK=1 $(BIN)/python -m pytest

# Speed as ratios measured in one run; numbers, not verdicts.
bench: $(STAMP)
	for b in benchmarks/bench_*.py; do echo "== $$b"; $(BIN)/python $$b || exit 1; done

# The blind test of the gap workflow: CASES units it has never seen, truth sealed beforehand, scores against their targets.
CASES ?= 300
challenge: $(STAMP)
	$(BIN)/python -m validation.challenge --cases $(CASES) --out out/challenge

setup: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "accept needs Python 3.11 or later; set PYTHON=..."; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' || { echo "accept needs Python's venv module (Debian: apt install python3-venv)"; exit 1; }
	rm -rf $(VENV)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

# Renew the pictures of the documentation (needs pdftoppm).
pictures: $(STAMP)
	$(BIN)/accept demo --out build/pictures
	mkdir -p docs/img
	pdftoppm -r 100 -png -singlefile build/pictures/certificates/APA-03.pdf docs/img/certificate
	$(BIN)/python tests/accept/tui/picture_screens.py docs/img

# Renew the lock after a change of pyproject.toml (needs uv).
lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-annotate --no-header --all-extras pyproject.toml -o requirements.lock

clean:
	rm -rf $(VENV) build out .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
