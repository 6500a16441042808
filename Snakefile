# Table of contents of the study. Commands are in the Makefile, content in config/.
from snakemake.utils import min_version

min_version("9.27")


configfile: "config/config.yaml"


# Inert unless --software-deployment-method asks for containers: the environment is .venv, made
# from environment.lock. Named so that every rule states the Python it was written for.
container: "docker://python:3.11"


report: "workflow/report/study.rst"


# Checks the configuration before any rule is read.
include: "workflow/rules/common.smk"
include: "workflow/rules/model.smk"
include: "workflow/rules/solve.smk"
include: "workflow/rules/emg.smk"
include: "workflow/rules/calibrate.smk"
include: "workflow/rules/predict.smk"
include: "workflow/rules/variants.smk"
include: "workflow/rules/sensitivity.smk"
include: "workflow/rules/recovery.smk"
include: "workflow/rules/audit.smk"
include: "workflow/rules/gap.smk"
include: "workflow/rules/blind.smk"
include: "workflow/rules/real.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/bench.smk"
include: "workflow/rules/test.smk"


rule all:
    default_target: True
    input:
        report=f"reports/{config['report']}.html",
        tests="results/tests.success",
    message:
        "The study is complete: reports/{config[report]}.html"
