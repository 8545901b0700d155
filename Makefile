# make demo: set up and run the paper's experiment.  make test: set up and run every check.
# make docs: set up and build the documentation into out/site.  make fuzz: ten minutes of damaged files.
# make release: build the wheel and the sdist into dist/ and try them in empty environments.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet --constraint constraints.txt

.PHONY: demo test types pytest fuzz docs release format clean

demo: $(VENV)/core.stamp
	$(BIN)/dynslam demo

test: $(VENV)/all.stamp
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(MAKE) --no-print-directory --jobs 2 types pytest

types: $(VENV)/all.stamp
	$(BIN)/pyright --pythonpath $(BIN)/python

# Many tests start processes: with bytecode kept, these do not compile every module again.
pytest: export PYTHONDONTWRITEBYTECODE =
pytest: $(VENV)/all.stamp
	$(BIN)/pytest --numprocesses logical --dist worksteal

# Damaged files for every reader; `make test` includes a minute of it.
fuzz: $(VENV)/all.stamp
	$(BIN)/python -m tests.fuzz.fuzz --seconds 600

docs: $(VENV)/all.stamp
	$(BIN)/python -m docs.making.cards
	$(BIN)/python -m docs.making.parameters
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet
	@echo out/site/index.html

release:
	.ci/release $(PYTHON)

format: $(VENV)/all.stamp
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:
	rm -rf $(VENV) out

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "dynslam needs Python 3.11 or newer; name one: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

$(VENV)/core.stamp: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing dynslam into $(VENV) (once)"
	$(PIP) --editable .
	@touch $@

$(VENV)/all.stamp: pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing dynslam and its tools into $(VENV) (once)"
	$(PIP) --editable '.[all]'
	@touch $@ $(VENV)/core.stamp
