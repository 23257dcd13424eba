# Two commands: `make demo` and `make test`; both install what they need on their first run.
PYTHON := .venv/bin/python
SEED ?= 0

.PHONY: help bootstrap demo test lint unit proof blind bench

help:
	@echo "make demo          the main job on bundled recordings; results in out/demo"
	@echo "make test          style, types, imports, tests with coverage"
	@echo "make blind SEED=n  one concealed case: drawn, sealed, diagnosed, opened"
	@echo "make proof         the long studies"
	@echo "make bench         speed against peers"

bootstrap:
	@sh scripts/bootstrap

demo: bootstrap
	@$(PYTHON) -m corexy_fmi demo --out out/demo

test: lint unit

lint: bootstrap
	@echo "ruff";         $(PYTHON) -m ruff check .
	@echo "ruff format";  $(PYTHON) -m ruff format --check .
	@echo "mypy";         $(PYTHON) -m mypy
	@echo "import-linter"; .venv/bin/lint-imports --no-cache

unit: bootstrap
	@$(PYTHON) -m pytest --cov=src --cov-report=term:skip-covered --junitxml=out/tests.xml

blind: bootstrap
	@$(PYTHON) -m benchmarks.concealed.blind --seed $(SEED)

proof: bootstrap
	@$(PYTHON) -m benchmarks.concealed.proof

bench: bootstrap
	@$(PYTHON) -m benchmarks.speed
