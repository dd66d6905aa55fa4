# make demo, make test, make bench, make docs, make lint: each sets up all it needs in .venv on a fresh machine.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
FORMATTED := $(wildcard core/lostmotion/*/*.hpp core/kernels/*.[ch]pp core/tests/*.[ch]pp bindings/*.[ch]pp bindings/c/*.[ch] bindings/c/*.[ch]pp bindings/fmu/*.[ch]pp examples/*.c benchmarks/*.[ch]pp)
SOURCES := $(wildcard core/lostmotion/*/*.hpp core/kernels/* bindings/*.[ch]pp bindings/c/*.[ch]* bindings/fmu/*.[ch]pp scenarios/*.toml) CMakeLists.txt pyproject.toml

.PHONY: demo test bench docs lint format clean
.DELETE_ON_ERROR:
# Not every ninja understands the job server of every make.
unexport MAKEFLAGS

demo: $(VENV)/built
	$(BIN)/lostmotion reproduce -o out

test: lint test-core test-page test-python

.PHONY: test-python
test-python: c-library page-where-node
	$(BIN)/pip install -q --group portable --group examples
	$(BIN)/pytest

.PHONY: test-core
test-core: $(VENV)/tools
	echo '#include <doctest/doctest.h>' | c++ -E -x c++ - >/dev/null 2>&1 || { apt-get update -q && apt-get install -qy doctest-dev; }
	$(BIN)/cmake -S . -B build/core -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN)/ninja) -DLOSTMOTION_TESTS=ON -DLOSTMOTION_WERROR=ON >build/core.log
	$(BIN)/cmake --build build/core
	$(BIN)/ctest --test-dir build/core --output-on-failure --parallel 2

# The library of the C interface, bindings/c/lostmotion.h, from what the extension for any processor is made of.
.PHONY: c-library
c-library: $(VENV)/built
	directory=$$(ls -td build/python-*/ | head -1) && $(BIN)/cmake --build $$directory --target lostmotion_c && \
		mkdir -p build/c && cp $$directory/liblostmotion.* build/c/
	@echo 'cc -I$(abspath bindings/c) PROGRAM.c -L$(abspath build/c) -llostmotion -lm'

# The same library as WebAssembly, and as the libraries of FMUs for all platforms, by the Zig compiler.
.PHONY: wasm fmu
wasm: $(VENV)/tools
	$(BIN)/pip install -q --group portable
	$(BIN)/python bindings/c/build.py wasm build/wasm/lostmotion.wasm
fmu: $(VENV)/tools
	$(BIN)/pip install -q --group portable
	$(BIN)/python bindings/c/build.py fmu src/lostmotion/fmu_libraries

# Those libraries, as far as this machine can run them: QEMU and Wine, if they are installed.
.PHONY: test-fmu
test-fmu: $(VENV)/built $(VENV)/portable
	$(BIN)/pytest -n0 -rs tests/test_fmu_platforms.py

# FMUs with inputs and reference results, as the FMI cross-check asks for them.
.PHONY: cross-check
cross-check: $(VENV)/built
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
test-wheels: $(VENV)/built
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
LIVE := src/lostmotion/live_page
NODE := command -v npm >/dev/null || (echo 'npm is missing: without node the live page is not built'; false)
.PHONY: page
page: $(LIVE)/page.html $(LIVE)/wide.wasm.gz
$(LIVE)/page.html: page/node_modules/installed $(wildcard page/*.ts page/*.html page/src/*)
	cd page && npm run --silent build
	cp build/page/index.html $@
# The last of them to be written.
$(LIVE)/wide.wasm.gz: $(SOURCES) $(wildcard bindings/c/*) page/src/core.ts | $(VENV)/portable page/node_modules/installed
	$(BIN)/python bindings/c/build.py page $(LIVE)
	touch $@
page/node_modules/installed: page/package.json page/package-lock.json
	@$(NODE)
	cd page && npm ci --silent
	touch $@
$(VENV)/portable: $(VENV)/tools
	$(BIN)/pip install -q --group portable
	touch $@

# In Chromium; left out where there is no node.
.PHONY: page-where-node test-page
page-where-node: $(VENV)/built
	@$(NODE) || exit 0; $(MAKE) page
test-page: page-where-node
	@$(NODE) || exit 0; { command -v chromium >/dev/null || { apt-get update -q && apt-get install -qy chromium; }; } && cd page && npm run --silent lint && npm test --silent

# 100,000 random drives of each kind; CASES and SEED choose others.
CASES ?= 100000
SEED ?= 1
.PHONY: soak
soak: $(VENV)/tools
	echo '#include <doctest/doctest.h>' | c++ -E -x c++ - >/dev/null 2>&1 || { apt-get update -q && apt-get install -qy doctest-dev; }
	$(BIN)/cmake -S . -B build/core -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN)/ninja) -DLOSTMOTION_TESTS=ON -DLOSTMOTION_WERROR=ON >build/core.log
	$(BIN)/cmake --build build/core --target soak
	build/core/core/tests/soak $(CASES) $(SEED)

bench: $(VENV)/built
	$(BIN)/pip install -q --group bench
	command -v valgrind >/dev/null || { apt-get update -q && apt-get install -qy valgrind; } || echo 'without valgrind'
	echo '#include <cvode/cvode.h>' | c++ -E -x c++ - >/dev/null 2>&1 || { apt-get update -q && apt-get install -qy libsundials-dev; } || echo 'without SUNDIALS'
	command -v npm >/dev/null && $(MAKE) page c-library || echo 'without the live page'
	$(BIN)/python benchmarks/baseline.py build/baseline
	$(BIN)/cmake -S . -B build/bench -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN)/ninja) -DLOSTMOTION_BENCHMARKS=ON -DLOSTMOTION_WERROR=ON -DLOSTMOTION_BASELINE=$(abspath build/baseline) >build/bench.log
	$(BIN)/cmake --build build/bench
	$(BIN)/python benchmarks/bench.py build/bench

docs: $(VENV)/built page
	$(BIN)/pip install -q "lostmotion[docs]"
	$(BIN)/python docs/generate.py
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build

lint: $(VENV)/built
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run --Werror $(FORMATTED)

.PHONY: stub
stub: $(VENV)/built
	$(BIN)/python -m nanobind.stubgen -q -m lostmotion._core -o src/lostmotion/_core.pyi

format: $(VENV)/tools
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(FORMATTED)

# Tools and libraries, then the package itself; only what changed is compiled again.
$(VENV)/tools: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || { apt-get update -q && apt-get install -qy python3-venv && $(PYTHON) -m venv $(VENV); }
	command -v c++ >/dev/null || { apt-get update -q && apt-get install -qy g++; }
	@echo 'Installing tools and libraries into $(VENV); this takes a minute or two.'
	$(BIN)/pip install -q --upgrade "pip>=25.1"
	$(BIN)/pip install -q --group dev
	mkdir -p build
	touch $@

$(VENV)/built: $(VENV)/tools $(SOURCES)
	@echo 'Compiling the core in up to two builds; this takes one to five minutes.'
	$(BIN)/pip install -q --no-build-isolation --config-settings=cmake.define.LOSTMOTION_WERROR=ON --editable ".[all]"
	touch $@

clean:
	rm -rf build out docs/_build docs/_generated $(VENV)
