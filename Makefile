# SPDX-License-Identifier: MIT
# Each target does its own set-up (scripts/setup) and costs nothing extra when that is done.
BIN := .venv/bin
ARGS :=

.DEFAULT_GOAL := help
.PHONY: help demo test check mutate lint gallery runner wheel clean
.NOTPARALLEL:

help: ## print this list
	@sed -nE 's/^([a-z]+):.*## (.*)/make \1	\2/p' $(MAKEFILE_LIST) | expand -t 14

demo: ## render three-spheres, compare it with Mitsuba, and open the viewer where there is a display
	@scripts/setup gl window atomic llvm
	@mkdir -p out
	$(BIN)/fragtracer render three-spheres --spp 64 --size 480x270 -o out/three-spheres.png
	$(BIN)/fragtracer compare three-spheres
	@echo "The picture is in out/three-spheres.png"
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ] && $(BIN)/fragtracer view --help >/dev/null 2>&1; then $(BIN)/fragtracer view; fi

test: ## run all tests; make test ARGS="-k film" runs some
	@scripts/setup gl window atomic llvm xvfb xdotool glslang chromium
	$(BIN)/pytest -q -n auto --maxprocesses 4 --dist worksteal $(ARGS)

# The tests that catch most mistakes for their time: layers, records, the shader library, closed forms, a file of each kind.
CHECKED := tests/test_layers.py tests/test_shader_composer.py tests/test_specialise.py tests/packing tests/bvh \
	tests/shaders/test_conventions.py tests/shaders/test_fresnel.py tests/shaders/test_ggx.py tests/shaders/test_shapes.py \
	tests/shaders/test_warp.py tests/test_renderer.py tests/files/test_scene_file.py tests/files/test_gltf_scene.py \
	tests/apps/viewer/test_session.py tests/apps/viewer/test_refiner.py::test_what_was_removed_leaves_no_trace \
	$(addprefix tests/test_furnace.py::test_, furnace_has_no_noise_without_light_sampling convex_object_in_ambient_light \
	objects_that_glow_enough_vanish_in_ambient_light black_where_there_is_nothing)

check: ## what to run while working: style, types, and the tests that catch most mistakes, in less than 90 s
	@$(MAKE) --no-print-directory lint
	@scripts/setup gl
	$(BIN)/pytest -q -n auto --maxprocesses 4 --dist worksteal $(CHECKED)

mutate: ## plant 200 random errors in the shaders and say which of them no test finds (hours); make mutate ARGS="--count 20"
	@scripts/setup gl atomic llvm glslang
	$(BIN)/python scripts/mutate.py $(ARGS)

lint: ## check style and types
	@scripts/setup
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

gallery: ## write site/: the documentation, every bundled scene as a live page, and the method step by step
	@scripts/setup gl
	$(BIN)/python scripts/gallery.py $(ARGS)

runner: ## build the scripts of exported pages and of the widget from web/src (needs Node)
	cd web && npm ci && npm run build

wheel: ## build dist/fragtracer-*.whl
	@scripts/setup
	$(BIN)/python -m build --wheel --no-isolation

clean: ## remove everything that these targets made, .venv included
	rm -rf .venv out site dist build web/node_modules .pytest_cache .mypy_cache .ruff_cache
	find src tests -name __pycache__ -prune -exec rm -rf {} +
