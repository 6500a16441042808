# Commands of the study. `make help` lists them.

CORES ?= 2
# Memory that jobs may use together [MB]: one solve per core.
MEMORY_MB ?= $(shell echo $$((4000 * $(CORES))))
PYTHON ?= python3.11
RECORDINGS ?= none

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

# One BLAS thread per process: threads change results in the last digits and slow down parallel solves.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export PATH := $(CURDIR)/.venv/bin:$(PATH)

# The stamp is written last, so an interrupted installation is started again.
environment := .venv/complete

# The option of resources takes all words up to the next option, so it may not stand last.
limits := --resources mem_mb=$(MEMORY_MB) --cores $(CORES)
study := snakemake --workflow-profile workflow/profiles/default $(limits)
quick := snakemake --workflow-profile workflow/profiles/quick --configfile config/quick.yaml $(limits)

# Score cards are named by when their keys were sealed, so that one draw is kept once. This holds from
# 2026-11-28 on: older cards are named by when they were kept.
sealed = json.load(open('$(1)'))['sealed']['date'].replace(':', '')
keep_scores = cp $(1) reports/blind_scores/$$(python -c "import json; print($(sealed))").json

.PHONY: help environment reproduce quick report gap real blind blind_small blind_opensim bench test lint unit format lock dag clean

help: ## List the commands
	@awk -F ':.*## ' '/^[a-z_]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

environment: $(environment) ## Create the Python environment in .venv

$(environment): environment.lock workflow/environment/create.sh workflow/environment/write_ipopt_pc.py
	workflow/environment/create.sh .venv "$(PYTHON)"
	touch $@

reproduce: $(environment) ## Run the full study, up to the report
	$(study)

quick: $(environment) ## Run one participant and one plane, up to the report
	$(quick)

report: $(environment) ## Bring the report of the full study and the pictures of the README up to date
	$(study) reports/report.html reports/motion.svg reports/gimbal_lock.svg

gap: $(environment) ## Diagnose the gap between recorded and simulated elevations
	$(study) gap

real: $(environment) ## Diagnose cases of known cause: make real RECORDINGS=folder (an hour; needs predictions)
	$(study) real_cases --config recordings=$(RECORDINGS)
	cp results/gap/real/cases.csv reports/real_cases.csv

blind: $(environment) ## Draw, answer and score 60 blind cases of the gap diagnosis (one and a half to three hours; to draw again, delete results/gap/blind)
	$(study) results/gap/blind/scores.json
	$(call keep_scores,results/gap/blind/scores.json)

blind_small: $(environment) ## The same with 20 cases, for a first look (half an hour)
	$(study) results/gap/blind_small/scores.json
	$(call keep_scores,results/gap/blind_small/scores.json)

blind_opensim: $(environment) ## The same with 12 persons simulated by OpenSim, a second plant (half an hour)
	$(study) results/gap/blind_opensim/scores.json
	$(call keep_scores,results/gap/blind_opensim/scores.json)

bench: $(environment) ## Measure the solver against CasADi, opty and Moco, one by one (an hour)
	pytest -m slow --numprocesses $(CORES)
	$(study) --cores 1 results/bench/peers.json
	cp results/bench/peers.json reports/peers.json

test: lint ## Check format, types and workflow; run the quick study and the tests
	$(quick)
	$(MAKE) unit  # with the equations that the quick study has built

lint: $(environment) ## Check format, lint and types
	ruff format --check .
	ruff check .
	mypy
	snakefmt --check Snakefile workflow
	snakemake --lint

# The opensim and casadi wheels cannot be loaded into one process.
unit: $(environment) ## Run the tests that need no results
	pytest -m "(unit or workflow) and not slow" --numprocesses $(CORES) --dist worksteal
	pytest -m opensim --numprocesses $(CORES) --dist loadfile || [ $$? -eq 5 ]  # 5: no test carries the mark

format: $(environment) ## Format all files
	ruff check --fix .
	ruff format .
	snakefmt Snakefile workflow

lock: $(environment) ## Pin all packages of pyproject.toml in environment.lock
	PKG_CONFIG_PATH="$(CURDIR)/.venv/lib/pkgconfig" CUSTOM_COMPILE_COMMAND="make lock" \
	pip-compile --quiet --generate-hashes --all-extras --allow-unsafe --strip-extras \
	    --no-build-isolation --no-emit-index-url --no-emit-trusted-host --no-emit-find-links \
	    --output-file environment.lock pyproject.toml

dag: $(environment) ## Draw the rules of the study as a Mermaid diagram
	$(study) dag

clean: $(environment) ## Delete all results; the environment and the reports stay
	$(study) clean
