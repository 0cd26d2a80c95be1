# `make demo` on a bare Debian or Ubuntu leaves results/demo/report.html; the rest is in README.md.
PYTHON_IN_VENV := .venv/bin/python
READY := .venv/.ready
OUT ?= results/demo

.PHONY: demo setup test test-slow check docs regression format clean

demo: $(READY)
	rm -rf $(OUT)
	.venv/bin/airground reproduce --quick --out $(OUT)

setup: $(READY)

# Again only after a change of the dependencies.
$(READY): requirements.lock pyproject.toml scripts/setup
	scripts/setup
	@touch $@

test: $(READY)
	$(PYTHON_IN_VENV) -m pytest -q -m "not slow"

test-slow: $(READY)
	$(PYTHON_IN_VENV) -m pytest -q -m slow --durations=10

check: $(READY)
	$(PYTHON_IN_VENV) -m ruff check .
	$(PYTHON_IN_VENV) -m ruff format --check .
	$(PYTHON_IN_VENV) -m mypy

# The pages of docs/ with the API reference, to read in a browser: results/docs/index.html.
docs: $(READY)
	$(PYTHON_IN_VENV) docs/parameters.py
	$(PYTHON_IN_VENV) docs/metrics.py
	.venv/bin/sphinx-build -W --keep-going -q -b html docs results/docs

# Did a change make it worse? Against evaluation/accepted.json; docs/check_a_change.md.
regression: OUT = results/regression
regression: $(READY)
	rm -rf $(OUT)
	.venv/bin/airground reproduce --suite fast --render --out $(OUT)
	.venv/bin/airground check $(OUT)

format: $(READY)
	$(PYTHON_IN_VENV) -m ruff format .
	$(PYTHON_IN_VENV) -m ruff check --fix .

clean:
	rm -rf .venv build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis
