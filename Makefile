# `make demo` and `make test` do all the set-up themselves. Another interpreter: `make test PYTHON=/path/to/python3.12`.
# Another place for the environment: `make test VENV=/elsewhere`.

VENV ?= .venv
PYTHON ?=
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test check
.DELETE_ON_ERROR:

demo: $(READY)
	$(BIN)/bt-tamp run fig1 --render

test: $(READY)
	@$(MAKE) --no-print-directory check

check:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports
	$(BIN)/python -m pytest

$(READY): pyproject.toml constraints.txt
	@python=; \
	for candidate in $(if $(PYTHON),"$(PYTHON)",python3.11 python3.12 python3.13 python3 python); do \
	    if "$$candidate" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null; then python="$$candidate"; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
	    echo "bt-tamp: $(if $(PYTHON),PYTHON=$(PYTHON) is not Python 3.11 to 3.13,no Python 3.11 to 3.13 found): install it (Debian 12: apt install python3 python3-venv) or name one: make $(or $(MAKECMDGOALS),demo) PYTHON=/path/to/python3.11" >&2; exit 1; \
	fi; \
	if ! "$$python" -c 'import ensurepip, venv' 2>/dev/null; then \
	    echo "bt-tamp: $$python lacks the venv module: install it (Debian, Ubuntu: its package is called like python3.11-venv)" >&2; exit 1; \
	fi; \
	if ! $(BIN)/python -m pip --version >/dev/null 2>&1; then "$$python" -m venv --clear "$(VENV)" || exit 1; fi
	$(BIN)/python -m pip install --disable-pip-version-check --quiet --constraint constraints.txt --editable '.[dev]'
	@touch $@
