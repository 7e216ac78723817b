# make demo and make test each work alone, on a machine with Python 3.11 or newer, git and make.
#
# All paths are relative, because make splits names at spaces and the repository may lie in a folder with one.

SHELL = /bin/sh
RUN = .venv/bin/python
SETUP = PYTHON="$(PYTHON)" sh scripts/setup.sh
PYTHON =
SEED = 1
N = 10000
# Processes that share the tests; each compiles kernels of its own, so more than a few do not help.
JOBS = 2
# More arguments for pytest, such as TESTS="tests/test_house.py -x".
TESTS =

.PHONY: help demo test verify bench lint format docs lectures clean lock

help:
	@echo "make demo                render a model to a picture"
	@echo "make test                run all tests"
	@echo "make verify SEED=1 N=10000   compare N random triangles with the exact oracle"
	@echo "make bench               race the peers on this machine"
	@echo "make lint | format       check | mend the style"
	@echo "make docs                run the examples in the documentation"
	@echo "make lectures            renew the page on the lectures, docs/lectures/index.html"
	@echo "make lock                renew the lock files"
	@echo "make clean               remove everything that make made"

# A stamp per set of packages: the second run finds it and installs nothing.
.venv/.core: requirements.lock pyproject.toml scripts/setup.sh
	@$(SETUP) core

.venv/.dev: requirements-dev.lock pyproject.toml scripts/setup.sh
	@$(SETUP) dev

.venv/.bench: requirements-bench.lock pyproject.toml scripts/setup.sh
	@$(SETUP) bench

demo: .venv/.core
	@$(RUN) -m scanspan render examples/models/spot.obj -o demo.png --camera-azimuth-angle=-120 --camera-elevation-angle=-15 --crease-angle=70 >/dev/null
	@echo "$$(pwd)/demo.png"

test: .venv/.dev
	@$(RUN) -m pytest -n $(JOBS) --dist loadfile $(TESTS)

verify: .venv/.dev
	@$(RUN) -m tests.verify --seed $(SEED) --count $(N)

bench: .venv/.bench
	@$(RUN) -m benchmarks --seconds 1 -o docs/benchmarks.md --readme README.md
	@$(RUN) -m benchmarks.splats

lint: .venv/.dev
	@.venv/bin/python -m ruff check .
	@.venv/bin/python -m ruff format --check .
	@.venv/bin/python -m mypy
	@.venv/bin/python scripts/imports.py

format: .venv/.dev
	@.venv/bin/python -m ruff check --fix .
	@.venv/bin/python -m ruff format .

docs: .venv/.dev
	@$(RUN) -m pytest --doctest-glob="*.md" README.md docs src

lectures: .venv/.core
	@$(RUN) -m scanspan lecture run all -o docs/lectures

# uv is needed for nothing else, so it has a place of its own.
lock: .venv/.core
	@test -d .cache/uv || .venv/bin/python -m venv .cache/uv
	@.cache/uv/bin/python -m pip install --quiet --disable-pip-version-check uv==0.13.9
	@.cache/uv/bin/python scripts/lock.py

clean:
	rm -rf .venv .cache .hypothesis build dist demo.png demo-*.png src/*.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
