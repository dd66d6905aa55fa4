# make demo, make check, make test, make bench, make docs: each sets up all it needs in .venv on a fresh machine.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CORE_SOURCES := $(wildcard core/lostmotion/*/*.[ch]pp core/kernels/*.[ch]pp)
FORMATTED := src/lostmotion/warp/joint_step.hpp $(CORE_SOURCES) $(wildcard core/tests/*.[ch]pp bindings/*.[ch]pp bindings/c/*.[ch] bindings/c/*.[ch]pp bindings/fmu/*.[ch]pp bindings/mujoco/*.cpp examples/*.c benchmarks/*.[ch]pp)
SOURCES := $(CORE_SOURCES) $(wildcard bindings/*.[ch]pp) CMakeLists.txt
# One build tree for the extension, the C library, the library of FMUs and the tests of the core.
TREE := build/native
PACKAGE := src/lostmotion
# Two makes at once, or one with several jobs, wait for each other there, and say so.
ONE_BY_ONE := $(if $(shell command -v flock),.ci/one_by_one)
CMAKE := $(ONE_BY_ONE) $(BIN)/cmake
BUILD := $(CMAKE) --build $(TREE)
NODE := command -v npm >/dev/null

.PHONY: demo check test bench docs lint format clean
.DELETE_ON_ERROR:
# Not every ninja understands the job server of every make.
unexport MAKEFLAGS

# The libraries are installed, and the core of the live page compiles, beside the extension.
demo: $(VENV)/tools
	@$(MAKE) --no-print-directory --jobs=2 $(VENV)/built demo-page
	@if $(NODE); then mkdir -p out && $(BIN)/lostmotion live paper-2dof-nl-small -o out/live.html; \
	else echo 'Without node the live page was not built; with it, make demo leaves it at out/live.html.'; fi
	$(BIN)/lostmotion reproduce -o out
	@echo
	@echo 'Made: out/report.html, the reproduction of the paper, with the data of its figures beside it.'
	@! test -f out/live.html || echo 'Made: out/live.html, the drive of the paper to try out in a browser.'
	@echo 'Next: $(BIN)/lostmotion run paper-2dof-nl-small --plot run.png'
	@echo '      $(BIN)/lostmotion rig schaeffler-rt1-h-20-100'
	@echo '      $(BIN)/lostmotion servo position-axis'

.PHONY: demo-page
demo-page: $(VENV)/tools
	@! $(NODE) || $(MAKE) --no-print-directory page-drive page-report

# After a change: what finds most faults. make test runs all. Of two jobs one has the longest, the other all else beside it.
check:
	@$(MAKE) --no-print-directory --jobs=2 check-python lint test-core
test:
	@$(MAKE) --no-print-directory --jobs=2 test-python test-core lint test-sanitized test-page

.PHONY: test-python check-python
test-python: c-library fmu-library page-where-node $(VENV)/examples
	$(BIN)/pytest
# Without what takes minutes: each such test says why it is worth its time.
check-python: $(VENV)/dev fmu-library c-library report-where-node
	$(BIN)/pytest -m 'not slow' --durations=0 --durations-min=5

# With the objects of the extension, and again under sanitizers with two of the kernels.
.PHONY: test-core test-sanitized with-core-tests
DOCTEST := echo '\#include <doctest/doctest.h>' | c++ -E -x c++ - >/dev/null 2>&1 || { apt-get update -q && apt-get install -qy doctest-dev; }
with-core-tests: $(VENV)/built
	$(DOCTEST)
	@$(CMAKE) $(TREE) -DLOSTMOTION_TESTS=ON >build/core.log || { cat build/core.log; false; }
test-core: with-core-tests
	$(BUILD) --target core_tests core_tests_many
	$(BIN)/ctest --test-dir $(TREE) --output-on-failure --parallel 2 --tests-regex '^core'
test-sanitized: with-core-tests
	$(BUILD) --target core_tests_sanitized
	$(BIN)/ctest --test-dir $(TREE) --output-on-failure --parallel 2 --tests-regex '^sanitized'

# The library of the C interface, bindings/c/lostmotion.h, from what the extension is made of.
.PHONY: c-library fmu-library
c-library: $(VENV)/built
	$(BUILD) --target lostmotion_c
	mkdir -p build/c && cp $(TREE)/liblostmotion.* build/c/
	@echo 'cc -I$(abspath bindings/c) PROGRAM.c -L$(abspath build/c) -llostmotion -lm'
# The library of FMUs for this platform, and their sources. `lostmotion fmu` calls this when it first needs it.
fmu-library: $(VENV)/built
	$(BUILD) --target lostmotion_fmu
	mkdir -p $(PACKAGE)/fmu_libraries && cp -r $(TREE)/fmu/* $(PACKAGE)/fmu_libraries/
	$(BIN)/python bindings/fmu/sources.py $(PACKAGE)/fmu_libraries/sources

# The actuator plugin of MuJoCo, where its Python package is installed.
.PHONY: mujoco-plugin
mujoco-plugin: $(VENV)/built
	@$(CMAKE) $(TREE) -DLOSTMOTION_MUJOCO="$$($(BIN)/python -c 'import mujoco, pathlib; print(pathlib.Path(mujoco.__file__).parent)')" >build/mujoco.log
	$(BUILD) --target lostmotion_mujoco
	mkdir -p $(PACKAGE)/mujoco/plugin_library && cp $(TREE)/lostmotion_mujoco.* $(PACKAGE)/mujoco/plugin_library/

# The same library as WebAssembly, and as the libraries of FMUs for all platforms, by the Zig compiler.
.PHONY: wasm fmu
wasm: $(VENV)/portable
	$(BIN)/python bindings/c/build.py wasm build/wasm/lostmotion.wasm
fmu: $(VENV)/portable
	$(BIN)/python bindings/c/build.py fmu src/lostmotion/fmu_libraries
	$(BIN)/python bindings/fmu/sources.py src/lostmotion/fmu_libraries/sources

# Those libraries, as far as this machine can run them: QEMU and Wine, if they are installed.
.PHONY: test-fmu
test-fmu: $(VENV)/portable
	$(BIN)/pytest -n0 -rs tests/test_fmu_platforms.py

# FMUs with inputs and reference results, as the FMI cross-check asks for them.
.PHONY: cross-check
cross-check: $(VENV)/dev fmu-library
	$(BIN)/python bindings/fmu/cross_check.py build/cross-check

# Wheels for all platforms, dist/*.whl, by the Zig compiler; the headers of Python 3.12 have to be at hand.
.PHONY: wheels
wheels: page $(VENV)/portable
	$(BIN)/pip install -q --group release
	$(BIN)/python bindings/wheels.py dist
	$(BIN)/twine check --strict dist/*.whl
	rm -rf build/audit && for wheel in dist/*abi3*.whl; do $(BIN)/python -m zipfile -e $$wheel build/audit/$$(basename $$wheel); done
	$(BIN)/abi3audit --strict --assume-minimum-abi3 3.12 build/audit/*/lostmotion/*.abi3.so build/audit/*/lostmotion/*.pyd
	$(MAKE) test-wheels

# In environments of their own, which take what they need from the package index.
.PHONY: test-wheels aarch64-python
test-wheels: $(VENV)/dev
	$(BIN)/pytest -n0 -rs tests/test_wheels.py
# Debian's Python for aarch64, which QEMU runs.
ARM := build/aarch64
ARM_PACKAGES := python3.11-minimal libpython3.11-minimal libpython3.11-stdlib libc6 libgcc-s1 libstdc++6 zlib1g libexpat1 libffi8 \
	libbz2-1.0 liblzma5 libsqlite3-0 libssl3 libuuid1 libcrypt1
aarch64-python:
	dpkg --add-architecture arm64 && apt-get update -q
	mkdir -p $(ARM)/packages && cd $(ARM)/packages && apt-get download -q $(ARM_PACKAGES:=:arm64)
	for p in $(ARM)/packages/*.deb; do dpkg -x $$p $(ARM); done

# The live page, src/lostmotion/live_page/page.html, and its cores, one for each kernel, which the wheel carries.
# `lostmotion live` calls page-KERNEL when it first needs a core.
LIVE := $(PACKAGE)/live_page
KERNELS := drive middle any
NEED_NODE := $(NODE) || (echo 'npm is missing: without node the live page is not built'; false)
WASM_SOURCES := $(SOURCES) $(wildcard bindings/c/*) page/src/core.ts
.PHONY: page page-report $(KERNELS:%=page-%)
# In one go, of which each part compiles on a processor of its own where something has changed.
page: $(LIVE)/page.html page-report | $(VENV)/zig
	$(BIN)/python bindings/c/build.py page $(LIVE)
$(KERNELS:%=page-%): page-%: $(LIVE)/page.html $(LIVE)/%.wasm.gz
# The script of reports, which those who have none call by page-report.
SCRIPT := $(PACKAGE)/reports/report.js
PAGE_SOURCES := $(wildcard page/*.ts page/*.html page/src/*)
page-report: $(SCRIPT)
$(SCRIPT): page/node_modules/installed $(PAGE_SOURCES)
	cd page && npm run --silent build-report
	cp build/report/report.js $@
$(LIVE)/page.html: page/node_modules/installed $(PAGE_SOURCES) $(PACKAGE)/reports/style.css
	cd page && npm run --silent build
	cp build/page/index.html $@
$(KERNELS:%=$(LIVE)/%.wasm.gz): $(LIVE)/%.wasm.gz: $(WASM_SOURCES) | $(VENV)/zig page/node_modules/installed
	@echo 'Compiling the core of the live page (kernel: $*) to WebAssembly; this takes about half a minute.'
	$(BIN)/python bindings/c/build.py page $(LIVE) $*
page/node_modules/installed: page/package.json page/package-lock.json
	@$(NEED_NODE)
	cd page && npm ci --silent
	touch $@
$(VENV)/zig: $(VENV)/libraries
	$(BIN)/pip install -q ziglang
	touch $@
$(VENV)/portable: $(VENV)/dev
	$(BIN)/pip install -q --group portable
	touch $@

# In Chromium; left out where there is no node.
.PHONY: page-where-node report-where-node test-page
page-where-node: $(VENV)/portable
	@! $(NODE) || $(MAKE) page
report-where-node:
	@! $(NODE) || $(MAKE) --no-print-directory page-report
test-page: page-where-node
	@$(NODE) || exit 0; { command -v chromium >/dev/null || { apt-get update -q && apt-get install -qy chromium; }; } && cd page && npm run --silent lint && npm test --silent

# All random cases of the tests, and 100,000 random drives of each kind; CASES and SEED choose others.
CASES ?= 100000
SEED ?= 1
.PHONY: soak
soak: with-core-tests $(VENV)/dev
	$(BUILD) --target core_tests core_tests_many soak
	LOSTMOTION_CASES=1 $(BIN)/ctest --test-dir $(TREE) --output-on-failure --parallel 2 --tests-regex '^core'
	LOSTMOTION_CASES=1 $(BIN)/pytest
	$(TREE)/core/tests/soak $(CASES) $(SEED)

# Random input of all kinds, for some minutes; CASE repeats one that failed, KINDS chooses some.
MINUTES ?= 3
.PHONY: fuzz
fuzz: $(VENV)/dev fmu-library
	PYTHONPATH=tests $(BIN)/python -m fuzz $(if $(CASE),--case $(CASE),--seed $(SEED) --minutes $(MINUTES) $(KINDS:%=--kinds %))

bench: $(VENV)/dev fmu-library
	$(BIN)/pip install -q --group bench
	command -v valgrind >/dev/null || { apt-get update -q && apt-get install -qy valgrind; } || echo 'without valgrind'
	echo '#include <cvode/cvode.h>' | c++ -E -x c++ - >/dev/null 2>&1 || { apt-get update -q && apt-get install -qy libsundials-dev; } || echo 'without SUNDIALS'
	command -v npm >/dev/null && $(MAKE) page c-library || echo 'without the live page'
	$(BIN)/cmake -S . -B build/bench -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN)/ninja) -DLOSTMOTION_BENCHMARKS=ON -DLOSTMOTION_BUILD=all -DLOSTMOTION_WERROR=ON >build/bench.log
	$(BIN)/cmake --build build/bench
	PYTHONPATH=tests $(BIN)/python benchmarks/bench.py build/bench

docs: $(VENV)/dev page
	$(BIN)/pip install -q "lostmotion[docs]"
	$(BIN)/python docs/generate.py
	$(BIN)/python docs/live_pages.py
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build

lint: $(VENV)/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	@$(BIN)/clang-format --dry-run --Werror $(FORMATTED)
	@$(BIN)/python docs/lines.py

.PHONY: lint-words
lint-words: $(VENV)/libraries
	$(BIN)/python docs/lint_words.py

.PHONY: stub
stub: $(VENV)/built
	$(BIN)/python -m nanobind.stubgen -q -m lostmotion._core -o src/lostmotion/_core.pyi
	$(BIN)/python -c 'import lostmotion.simulation.forms.train_tables; from lostmotion.inputs.core_parameters import stub; print(stub(), end="")' > src/lostmotion/inputs/core_parameters.pyi

format: $(VENV)/dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(FORMATTED)

# What compiles; the package with the libraries of its report, and the extension; only what changed is compiled again.
$(VENV)/tools: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || { apt-get update -q && apt-get install -qy python3-venv && $(PYTHON) -m venv $(VENV); }
	command -v c++ >/dev/null || { apt-get update -q && apt-get install -qy g++; }
	@echo 'Installing libraries into $(VENV): about half a minute.'
	$(BIN)/pip install -q --upgrade "pip>=25.1"
	$(BIN)/pip install -q --group build
	mkdir -p build
	touch $@
# Half of these libraries are their own tests, which need not become bytecode.
$(VENV)/libraries: $(VENV)/tools
	$(BIN)/pip install -q --no-compile --no-build-isolation --config-settings=wheel.cmake=false --editable ".[report,control]"
	$(BIN)/python -m compileall -q -x '/(tests|setuptools|pip)/' $(VENV)/lib/*/site-packages || true
	touch $@
$(VENV)/built: $(VENV)/extension $(VENV)/libraries
	touch $@
$(VENV)/extension: $(VENV)/tools $(SOURCES)
	@$(BIN)/python -c 'import os; n = os.cpu_count() or 1; print(f"Compiling the core on {n} processors: about {max(1, round(200 / n / 30) / 2):g} min.")'
	@$(CMAKE) -S . -B $(TREE) -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN)/ninja) -DPython_EXECUTABLE=$(abspath $(BIN)/python) \
		-Dnanobind_DIR=$$($(BIN)/python -m nanobind --cmake_dir) -DLOSTMOTION_PYTHON=ON -DLOSTMOTION_WERROR=ON >build/cmake.log || { cat build/cmake.log; false; }
	$(BUILD)
	@rm -f $(PACKAGE)/_core_*.so $(PACKAGE)/_instruction_set*.so
	@$(CMAKE) --install $(TREE) --prefix src >build/install.log
	@ln -sfn ../../scenarios $(PACKAGE)/scenarios
	@$(BIN)/python -m compileall -q src
	touch $@
# All extras, and what tests and checks need.
$(VENV)/dev: $(VENV)/built
	$(BIN)/pip install -q --group dev
	$(BIN)/pip install -q --no-build-isolation --config-settings=wheel.cmake=false --editable ".[all]"
	touch $@
$(VENV)/examples: $(VENV)/portable
	$(BIN)/pip install -q --group examples
	touch $@

clean:
	rm -rf build out docs/_build docs/_generated docs/jupyter_execute $(VENV)
