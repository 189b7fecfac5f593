# Two commands: `make sweep` runs the main sweep, `make test` checks everything. Each creates its environment first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1
ARGS ?=

.PHONY: help env dev sweep quick test lint types layers pytest benchmark clean

help:
	@echo "make sweep [ARGS='--quick']  the sweep over K_att, K_rep and zeta (results in runs/)"
	@echo "make test                    lint, types, layering and all tests"
	@echo "make env                     create the environment in $(VENV)"
	@echo "make benchmark               run all benchmarks; results in docs/benchmarks.json and .md"

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "Python 3.11 or newer is needed; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.run: $(VENV)/.made pyproject.toml constraints.txt
	$(BIN)/python -m pip install --quiet -c constraints.txt -e .
	@touch $@

$(VENV)/.dev: $(VENV)/.run
	$(BIN)/python -m pip install --quiet -c constraints.txt -e '.[dev]'
	@touch $@

env: $(VENV)/.run
dev: $(VENV)/.dev

sweep: env
	$(BIN)/python -m experiments.sweep $(ARGS)

quick: env
	$(BIN)/python -m experiments.sweep --quick $(ARGS)

benchmark: env
	$(BIN)/python -m experiments.benchmark all --json docs/benchmarks.json --page docs/benchmarks.md

lint: dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: dev
	$(BIN)/basedpyright

layers: dev
	$(BIN)/lint-imports

pytest: dev
	$(BIN)/python -m pytest --numprocesses=2 --dist=loadfile --no-loadscope-reorder $(ARGS)

test: lint types layers pytest

clean:
	rm -rf $(VENV) build *.egg-info .pytest_cache .ruff_cache .hypothesis
