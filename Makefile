# `make demo` on a bare Debian or Ubuntu leaves results/demo/report.html; the rest is in README.md.
PYTHON_IN_VENV := .venv/bin/python
READY := .venv/.ready
OUT ?= results/demo
# Tests run in parallel, those of a file in one process; more processes need too much memory.
PYTEST := $(PYTHON_IN_VENV) -m pytest -q --numprocesses=$(shell nproc) --maxprocesses=4 --dist=loadfile

# Else each process compiles all that it imports, which takes it 7 s; images of containers set this.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo setup test test-slow test-all test-uncompiled check docs regression fuzz format clean

demo: $(READY)
	rm -rf $(OUT)
	.venv/bin/airground reproduce --quick --out $(OUT) $(if $(RECORDINGS),--recordings '$(RECORDINGS)')

setup: $(READY)

# Again only after a change of the dependencies.
$(READY): requirements.lock pyproject.toml scripts/setup
	scripts/setup
	@touch $@

test: $(READY)
	$(PYTEST) -m "not slow"

test-slow: $(READY)
	$(PYTEST) --no-loadscope-reorder -m slow --durations=10

test-all: $(READY)
	$(PYTEST) --no-loadscope-reorder --durations=10

# Kernels against their slow twins, as plain Python.
test-uncompiled: $(READY)
	NUMBA_DISABLE_JIT=1 $(PYTHON_IN_VENV) -m pytest -q -m "kernel and not slow" \
		$$(grep -rl --include='test_*.py' mark.kernel tests)

check: $(READY)
	$(PYTHON_IN_VENV) -m ruff check .
	$(PYTHON_IN_VENV) -m ruff format --check .
	$(PYTHON_IN_VENV) -m mypy

# The pages of docs/ with the API reference, to read in a browser: results/docs/index.html.
docs: $(READY)
	$(PYTHON_IN_VENV) docs/parameters.py
	$(PYTHON_IN_VENV) docs/metrics.py
	$(PYTHON_IN_VENV) docs/measured_levels.py
	.venv/bin/sphinx-build -W --keep-going -q -b html docs results/docs

# Did a change make it worse? Each suite against its accepted figures; docs/check_a_change.md.
# RESUME=1 uses what OUT has of the same sources. Recordings (24 GiB) are kept until the simulator
# changes; RECORDINGS=DIR keeps them elsewhere, RECORDINGS= keeps none.
regression: OUT = results/regression
regression: SUITES = fast hard faults
regression: RECORDINGS = $(shell scripts/kept_recordings results)
regression: $(READY)
	$(if $(RESUME),,rm -rf $(OUT))
	code=0; for suite in $(SUITES); do \
		.venv/bin/airground reproduce --suite $$suite --out $(OUT)/$$suite \
			$(if $(RECORDINGS),--recordings '$(RECORDINGS)',--render) && \
		.venv/bin/airground check $(OUT)/$$suite || code=$$?; done; exit $$code

# Damaged inputs by the thousand: docs/reliability.md.
fuzz: N = 10000
fuzz: SEED = 1
fuzz: $(READY)
	$(PYTHON_IN_VENV) -m tests.fuzz --count $(N) --seed $(SEED)

format: $(READY)
	$(PYTHON_IN_VENV) -m ruff format .
	$(PYTHON_IN_VENV) -m ruff check --fix .

clean:
	rm -rf .venv build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis
