# make solve   install the light core into .venv, solve a real machine's leg lengths
# make test    install what the tests need as well, run them all
# make quick   the tests that need no PyTorch, browser or new process, few random samples: a minute
# make pictures   the documents' pictures, by the commands that stand beside them
# make lint    ruff, pyright, layers    make docs    HTML into docs/_build    make bench    the tables
# make release-check   build sdist and wheel, install the wheel into an empty environment, use it

PYTHON ?= $(firstword $(foreach p,python3 python3.14 python3.13 python3.12 python3.11,\
  $(shell $(p) -c 'import sys; sys.version_info >= (3, 11) and print("$(p)")' 2>/dev/null)))
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --disable-pip-version-check --quiet

.PHONY: solve test quick lint docs pictures bench release-check clean

solve: $(VENV)/.core
	$(BIN)/gough solve examples/rubin_camera_legs.csv -p rubin_camera

test: $(VENV)/.dev
	$(BIN)/python -m pytest -n auto --dist worksteal

quick: $(VENV)/.dev
	HYPOTHESIS_PROFILE=quick $(BIN)/python -m pytest -n auto --dist worksteal -q \
		-m "not (slow or torch or browser or process or documents)" --ignore=tests/learn --ignore=tests/paper

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports

docs: $(VENV)/.docs
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

pictures: $(VENV)/.dev
	$(BIN)/python tools/pictures.py
	$(BIN)/python docs/figures/draw.py

bench: $(VENV)/.dev
	@for script in benchmarks/*.py; do echo "== $$script"; $(BIN)/python $$script || exit 1; done

release-check: $(BIN)/python
	@$(PIP) 'build==1.6.1' 'twine==7.0.0'
	$(BIN)/python tools/release_check.py

clean:
	rm -rf docs/_build build .pytest_cache .ruff_cache .hypothesis .benchmarks

# The stamps say what is installed; a newer pyproject.toml or constraints.txt installs it again.

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "gough needs Python 3.11 or newer: install it, or say make PYTHON=/path/to/python3"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.core: pyproject.toml | $(BIN)/python
	@echo "Installing the core into $(VENV) ..."
	@$(PIP) -e .
	@touch $@

$(VENV)/.dev: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing the development environment into $(VENV), a few minutes ..."
	@$(PIP) -c constraints.txt -e '.[dev,excel,learn,plot,view]'
	@touch $@ $(VENV)/.core

$(VENV)/.docs: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing what the documents need into $(VENV) ..."
	@$(PIP) -c constraints.txt -e '.[docs]'
	@touch $@ $(VENV)/.core
