# Two commands: `make demo` and `make test`; both install what they need on their first run.
PYTHON := .venv/bin/python
SEED ?= 0

FIRMWARE := stepper
# two workers, a file at a time, in the order of tests/conftest.py
TWO := -n 2 --dist loadfile --no-loadscope-reorder

.PHONY: help bootstrap demo test test-long test-plant lint unit coverage proof blind real bench firmware flash hil

help:
	@echo "make demo          the main job on bundled recordings; results in out/demo"
	@echo "make test          style, types, imports, tests but the long ones"
	@echo "make test-long     the tests of ten seconds and more"
	@echo "make test-plant    the tests of the plant of the blind proof, but its draws"
	@echo "make coverage      the tests again, and the lines that they leave out"
	@echo "make blind SEED=n  one concealed case: drawn, sealed, diagnosed, opened"
	@echo "make proof         the long studies"
	@echo "make real          a public benchmark, fetched and diagnosed; results in out/real"
	@echo "make bench         speed against SciPy's LSODA (others: python -m benchmarks.peers)"
	@echo "make firmware      firmware of the board (needs gcc-avr avr-libc)"
	@echo "make flash PORT=p  builds it and writes it to the board at p (needs avrdude)"
	@echo "make hil           faults, ten minutes and commissioning on an emulated board"

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
	@$(PYTHON) -m pytest $(TWO) -m "not long" --junitxml=out/tests.xml

test-long: bootstrap
	@$(PYTHON) -m pytest $(TWO) -m long --junitxml=out/tests-long.xml

test-plant: bootstrap
	@$(PYTHON) -m pytest benchmarks/concealed -m "not long" --junitxml=out/tests-plant.xml

coverage: bootstrap
	@$(PYTHON) -m pytest $(TWO) --cov=src --cov-report=term:skip-covered --cov-fail-under=90

blind: bootstrap
	@$(PYTHON) -m benchmarks.concealed.blind --seed $(SEED)

proof: bootstrap
	@$(PYTHON) -m benchmarks.concealed.proof

real: bootstrap
	@$(PYTHON) -c 'import nonlinear_benchmarks' 2> /dev/null || \
	  $(PYTHON) -m pip --disable-pip-version-check install -q -c constraints.txt -e '.[real]'
	@$(PYTHON) -m benchmarks.real

bench: bootstrap
	@$(PYTHON) -m benchmarks.speed

firmware:
	@command -v avr-gcc > /dev/null || { echo "avr-gcc is missing; install it: apt-get install gcc-avr avr-libc" >&2; exit 1; }
	@$(MAKE) --no-print-directory -C firmware

flash: firmware
	@test -n "$(PORT)" || { echo "make flash: say where the board is, such as PORT=/dev/ttyACM0" >&2; exit 1; }
	@command -v avrdude > /dev/null || { echo "avrdude is missing; install it: apt-get install avrdude" >&2; exit 1; }
	avrdude -p m328p -c arduino -P "$(PORT)" -b 115200 -U flash:w:firmware/build/$(FIRMWARE).hex:i

hil: bootstrap
	@$(PYTHON) -m tests.hil.faults
	@$(PYTHON) -m tests.hil.soak
	@$(PYTHON) -m tests.hil.commissioning
