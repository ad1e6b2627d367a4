# Set-up, tests and demonstration. Needs make and Python 3.11 or newer, nothing else.
# Another interpreter: make PYTHON=python3.12 test

PYTHON ?= python3
JOBS ?= 2
VENV := .venv
BIN := $(VENV)/bin
CLIENTS := .venv-clients
CLEANRL := .venv-cleanrl
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

.DEFAULT_GOAL := help
.PHONY: help setup demo test kernels compiled-tests test-long lint docs bench bench-gpu benchmark-diagnosis benchmark-realistic benchmark-power benchmark-time benchmark-agents benchmark-loop clients measure-export fuzz check-release walks clone-to-verdict clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 28

setup: $(VENV)/.with-dev  ## create .venv and install everything that tests and training need

demo: $(VENV)/.with-base  ## diagnose a small data set, compare a real fish, swim the environment
	$(BIN)/robofish demo

# Processes that share the cores must not wait for each other's threads.
test test-long: export OMP_NUM_THREADS = 1
# Tests import the package in hundreds of processes. Some environments keep no compiled modules.
test test-long: export PYTHONDONTWRITEBYTECODE =

test: setup  ## check style, types and layering, then run the tests
	$(MAKE) --jobs=2 lint kernels compiled-tests
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder

kernels: setup  ## compile what the tests share
	$(BIN)/python -m scripts.warm_kernels --processes $(JOBS)

# Else each process of the tests compiles all of them. What is wrong with one is said when they run.
compiled-tests: setup  ## compile the tests
	$(BIN)/python -m pytest --collect-only --quiet > /dev/null || true

test-long: setup  ## the tests of ten seconds and more that make test leaves out
	$(BIN)/python -m pytest -n $(JOBS) -m long

lint: setup  ## style, types and import direction
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/.with-docs  ## write the generated pages, then the site into out/site
	$(BIN)/python -m scripts.make_effects_page
	$(BIN)/python -m scripts.make_policy_page
	$(BIN)/python -m scripts.make_environment_page
	$(BIN)/python -m scripts.make_import_graphs
	$(BIN)/python -m scripts.make_benchmarks_page
	$(BIN)/python -m scripts.make_notebook_page
	$(BIN)/python -m scripts.update_readme
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "Open out/site/index.html"

bench: $(VENV)/.with-bench  ## measure speed beside other environments, and put it into the README
	$(BIN)/python -m scripts.bench.startup
	$(BIN)/python -m scripts.bench.random_actions
	$(BIN)/python -m scripts.bench.c_loop
	$(BIN)/python -m scripts.bench.speed
	$(BIN)/python -m scripts.update_readme

bench-gpu: setup  ## measure the environment and a training on an NVIDIA GPU (extra gpu, see docs/gpu.md)
	$(BIN)/python -m scripts.bench.gpu

benchmark-diagnosis: setup  ## hide effects in made-up measurements, and count what is found
	$(BIN)/python scripts/benchmark_diagnosis.py

benchmark-realistic: setup  ## hide many small errors, dirty sensors and wrong inputs, as robots have
	$(BIN)/python scripts/benchmark_diagnosis.py --suite realistic

benchmark-power: setup  ## hide effects of chosen sizes, and see from which size on they are found
	$(BIN)/python scripts/benchmark_power.py

benchmark-time: setup  ## measure how the time of a diagnosis grows with the data
	$(BIN)/python scripts/benchmark_diagnosis_time.py

benchmark-agents: setup  ## measure controllers and shipped policies on the frozen suites
	$(BIN)/python -m scripts.benchmark_agents

benchmark-loop: setup  ## measure hidden fish, diagnose, learn on what was found, judge on them
	$(BIN)/python -m scripts.measure_to_policy

check-release: setup  ## build the wheel twice and compare, and go through the checklists of a release
	$(BIN)/python -m scripts.check_wheels --record
	$(BIN)/python -m scripts.check_project

walks: setup  ## go from raw logs and from nothing to an answer, as the pages say, and time it
	$(BIN)/python -m scripts.walks

clone-to-verdict: setup  ## time git clone, installation and demonstration up to the verdict
	$(BIN)/python -m scripts.clone_to_verdict

measure-export: setup  ## compare exported policies with the NumPy policy, over a million observations
	$(BIN)/python -m scripts.measure_export

clients: $(CLIENTS)/.ready $(CLEANRL)/.ready  ## run libraries of reinforcement learning on the environment
	mkdir -p out
	CLEANRL_PYTHON=$(CURDIR)/$(CLEANRL)/bin/python $(CLIENTS)/bin/python -m pytest \
	  --junitxml=out/clients.xml tests/clients/client_*.py
	$(CLIENTS)/bin/python -m scripts.record_clients out/clients.xml

FUZZ_EXAMPLES ?= 2000
fuzz: setup  ## try FUZZ_EXAMPLES hostile inputs in each test of the readers (2000: about an hour)
	FUZZ_EXAMPLES=$(FUZZ_EXAMPLES) $(BIN)/python -m pytest tests/fuzzing

.PHONY: fuzz-guided crash soak versions lock audit bom ray
FUZZ_SECONDS ?= 600
fuzz-guided: $(VENV)/.with-reliability  ## fuzz each reader, led by coverage, for FUZZ_SECONDS (600)
	$(BIN)/python -m scripts.reliability.guided_fuzz --seconds $(FUZZ_SECONDS)

crash: $(VENV)/.with-ray  ## test the rig, kill training, diagnosis, suite and sweep 30 times each, compare the ends
	$(BIN)/python -m pytest tests/reliability/rig_crash.py
	$(BIN)/python -m scripts.reliability.crash

SOAK_HOURS ?= 8
soak: setup  ## 1e8 steps of the batch, then train, evaluate and diagnose for SOAK_HOURS (8)
	$(BIN)/python -m scripts.reliability.soak --hours $(SOAK_HOURS)

ray: $(VENV)/.with-ray  ## test campaigns and sweeps on a Ray cluster that loses a node, and training with RLlib
	$(BIN)/python -m scripts.reliability.cluster

versions: $(VENV)/.with-reliability  ## run tests on the oldest and newest supported versions
	$(BIN)/python -m scripts.reliability.versions

lock: $(VENV)/.with-reliability  ## write requirements.lock: the tested versions with their hashes
	$(BIN)/python -m uv pip compile pyproject.toml --constraint constraints.txt --generate-hashes \
	  --extra parquet --extra render --extra docs --extra logs --extra notebook --no-header \
	  --no-annotate --no-emit-index-url --python-version 3.11.0 \
	  --python-platform x86_64-manylinux_2_28 --quiet --output-file requirements.lock

audit: $(VENV)/.with-reliability  ## look up known vulnerabilities of requirements.lock
	$(BIN)/python -m scripts.reliability.audit

bom: $(VENV)/.with-reliability  ## write out/bom.json, a CycloneDX bill of materials of .venv
	mkdir -p out
	$(BIN)/cyclonedx-py environment $(BIN)/python --pyproject pyproject.toml \
	  --output-reproducible --of JSON -o out/bom.json
	@echo "written: out/bom.json"

clean:  ## remove virtual environments and everything that builds and tests leave behind
	rm -rf $(VENV) $(CLIENTS) $(CLEANRL) build dist out .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Each stamp is redone only when the project file or the tested versions change.
$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "Python 3.11 or newer is needed, '$(PYTHON)' is not it (or is missing)."; \
	  echo "Name one that is, for example: make PYTHON=python3.12 setup"; exit 1; }
	@echo "Creating $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.with-base: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing robotic-fish into $(VENV) (about a minute, only this once)"
	@$(PIP) --editable .
	@touch $@

$(VENV)/.with-dev: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing robotic-fish with its test and training tools into $(VENV)"
	@echo "(a few minutes, only this once; PyTorch is the large part)"
	@$(PIP) --editable ".[dev,train,parquet,render,docs,notebook]"
	@touch $(VENV)/.with-base $(VENV)/.with-docs $@

$(VENV)/.with-docs: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing robotic-fish and what builds its documentation into $(VENV)"
	@$(PIP) --editable ".[docs,train,notebook]"
	@touch $(VENV)/.with-base $@

$(VENV)/.with-reliability: $(VENV)/.with-dev
	@$(PIP) "atheris>=3,<4" "cyclonedx-bom>=7,<8" "pip-audit>=2.10,<3" "uv>=0.8,<1"
	@touch $@

$(VENV)/.with-ray: $(VENV)/.with-dev
	@echo "Installing Ray into $(VENV)"
	@$(PIP) --editable ".[ray]"
	@touch $@

$(VENV)/.with-bench: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing robotic-fish and the simulators it is measured against into $(VENV)"
	@$(PIP) --editable ".[bench]"
	@touch $(VENV)/.with-base $@

# Libraries of reinforcement learning need other versions than the tests.
$(CLIENTS)/.ready: pyproject.toml constraints-clients.txt
	@echo "Installing robotic-fish and libraries of reinforcement learning into $(CLIENTS)"
	@$(PYTHON) -m venv $(CLIENTS)
	@$(CLIENTS)/bin/python -m pip install --quiet --disable-pip-version-check \
	  --constraint constraints-clients.txt --editable ".[clients]"
	@touch $@

# CleanRL's last release needs a Gymnasium below 1.0 (PPO) and OpenAI gym 0.23 (SAC).
$(CLEANRL)/.ready: pyproject.toml constraints-clients.txt
	@echo "Installing robotic-fish and CleanRL into $(CLEANRL)"
	@$(PYTHON) -m venv $(CLEANRL)
	@grep -v '^gymnasium==' constraints-clients.txt > $(CLEANRL)/constraints.txt
	@$(CLEANRL)/bin/python -m pip install --quiet --disable-pip-version-check \
	  --constraint $(CLEANRL)/constraints.txt gymnasium==0.29.1 matplotlib numba numpy pandas pint \
	  pyyaml rich scipy tensorboard threadpoolctl torch typer
	@$(CLEANRL)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps \
	  --ignore-requires-python cleanrl==1.2.0 gym==0.23.1 gym-notices==0.1.0 \
	  stable-baselines3==1.2.0 --editable .
	@touch $@
