# SPDX-License-Identifier: MIT
"""Films on disk: a render goes on with the same bits, what is damaged or foreign is refused, parts are joined."""

import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from fragtracer import guiding, light_tracing
from fragtracer.archive import read_archive, write_archive
from fragtracer.errors import FilmError, OutputError
from fragtracer.films import SavedFilm, merge, most_bytes
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.sampling.allocation import FIRST_STAGE, Window
from fragtracer.sampling.merging import Moments
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Ambient, Camera, Mesh, Part, Scene
from fragtracer.scene.digest import scene_digests

SCENE, SIZE, SPP = "three-spheres-ambient", (36, 20), 100
SETTINGS = {"bounces": 2, "guiding": "off"}
ARRAYS = {"a": np.arange(12, dtype=np.float32).reshape(3, 4), "b": np.array([7], np.int64)}


def found(renderer: Renderer) -> list[np.ndarray]:
    return [renderer.image(), renderer.standard_error(), renderer.samples()]


def assert_is_no_larger_than_told(path: Path, renderer: Renderer) -> None:
    size = sum(values.nbytes for values in SavedFilm.read(path).arrays.values())
    assert size <= most_bytes(replace(renderer.settings, light_tracing="off"))


@pytest.mark.parametrize(
    "choice", [{"adaptive": "off"}, {"adaptive": "auto"}, {"adaptive": "on"}, {"gradient_domain": "on"}], ids=str
)
def test_a_render_goes_on_with_the_same_bits(ctx, tmp_path, monkeypatch, choice) -> None:
    """Wherever it was interrupted, also within a pass, and however its passes were cut."""
    monkeypatch.setattr("fragtracer.gpu.accumulation._MOST_ITEMS", 512)
    with Renderer(load(SCENE), SIZE, context=ctx, **choice, **SETTINGS) as renderer:
        renderer.render(SPP)
        expected = found(renderer)
    path = tmp_path / "film.npz"
    for rays, end in ((16, 7), (5, 36), (16, 43), (16, 58), (16, 80)):

        def stop(state, end=end):
            if state.spp > end:
                raise KeyboardInterrupt

        with Renderer(load(SCENE), SIZE, context=ctx, rays=rays, **choice, **SETTINGS) as renderer:
            with pytest.raises(KeyboardInterrupt):
                renderer.render(SPP, progress=stop)
            assert renderer.spp <= end
            renderer.save(path)
            assert_is_no_larger_than_told(path, renderer)
        with Renderer(load(SCENE), SIZE, context=ctx, rays=21 - rays, **choice, **SETTINGS) as renderer:
            renderer.sample(4)
            renderer.resume(path)
            renderer.render(SPP)
            for one, other in zip(found(renderer), expected, strict=True):
                np.testing.assert_array_equal(one, other)


def test_layers_of_light_are_kept(ctx, tmp_path) -> None:
    """And a render that has them does not go on from a film that has not, nor the other way about."""
    path, settings = tmp_path / "film.npz", SETTINGS | {"adaptive": "off", "gradient_domain": "off", "context": ctx}
    layers = ("emission", "direct", "indirect", "diffuse", "specular")
    with Renderer(load(SCENE), SIZE, aovs=["diffuse"], **settings) as renderer:
        renderer.sample(12)
        expected = [renderer.image(), *map(renderer.aov, layers)]
        renderer.reset()
        renderer.sample(5)
        renderer.save(path)
        assert_is_no_larger_than_told(path, renderer)
        renderer.reset()
        renderer.resume(path)
        renderer.sample(7)
        for one, other in zip([renderer.image(), *map(renderer.aov, layers)], expected, strict=True):
            np.testing.assert_array_equal(one, other)
    with (
        Renderer(load(SCENE), SIZE, **settings) as renderer,
        pytest.raises(FilmError, match="light_parts is True there, False here"),
    ):
        renderer.resume(path)


def test_checkpoints_of_a_shorter_render_serve_a_longer_one(ctx, tmp_path) -> None:
    """The pass that a render ends with is not one of a longer render: the last checkpoint is before it."""
    path, kept = tmp_path / "film.npz", []
    settings = SETTINGS | {"adaptive": "on", "context": ctx}
    with Renderer(load(SCENE), SIZE, **settings) as renderer:

        def keep(is_last: bool) -> None:
            kept.append((renderer.spp, is_last))
            renderer.save(path)

        renderer.render(70, keep=keep)
        assert renderer.spp == 70
        assert not renderer.can_go_on
        with pytest.raises(FilmError, match="ended within a pass"):
            renderer.save(path)
    assert kept == [(16, False), (32, False), (48, False), (64, True)]
    with Renderer(load(SCENE), SIZE, **settings) as renderer:
        renderer.render(96)
        expected = found(renderer)
        renderer.resume(path)
        assert renderer.spp == 64
        renderer.render(96)
        for one, other in zip(found(renderer), expected, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("first", "then"), [(32, 256), (256, 32)])
def test_a_film_goes_on_as_it_was_begun(ctx, tmp_path, monkeypatch, first, then) -> None:
    """Of more samples, or of fewer, something else may be decided, but not within one film."""

    def decided(_, scene, settings, pictures):
        is_many = settings.spp > 64 if settings.light_tracing == "auto" else settings.light_tracing == "on"
        return light_tracing.Decision(is_many, "on: 7" if is_many else "off: 7", 0.25), guiding.Decision(None, "off: 7")

    monkeypatch.setattr("fragtracer.decisions.decide_both", decided)
    path = tmp_path / "film.npz"
    with Renderer(load(SCENE), SIZE, context=ctx, spp=first) as renderer:
        renderer.sample(24)
        renderer.save(path)
        renderer.sample(24)
        expected = found(renderer)
    with Renderer(load(SCENE), SIZE, context=ctx, spp=then) as renderer:
        renderer.sample(2)
        told = pytest.warns(UserWarning, match="goes on without light tracing") if first < then else nullcontext()
        with told:
            renderer.resume(path)
        renderer.sample(24)
        assert renderer.metadata()["light_tracing_decision"] == f"{'on' if first > 64 else 'off'}: as in the film"
        for one, other in zip(found(renderer), expected, strict=True):
            np.testing.assert_array_equal(one, other)
        renderer.reset(load("furnace"))
        with pytest.raises(FilmError, match="scene differs"):
            renderer.resume(path)


def test_it_stops_at_the_same_error(ctx, tmp_path) -> None:
    """Whether it was interrupted before, or was finished."""
    with Renderer(load(SCENE), SIZE, context=ctx, adaptive="off", **SETTINGS) as renderer:
        renderer.render(until=0.015)
        spp, image = renderer.spp, renderer.image()
        assert spp > 64
        renderer.reset()
        renderer.render(48, until=0.015)
        renderer.save(tmp_path / "film.npz")
        renderer.reset()
        for _ in range(2):
            renderer.resume(tmp_path / "film.npz")
            renderer.render(until=0.015)
            assert renderer.spp == spp
            np.testing.assert_array_equal(renderer.image(), image)
            renderer.save(tmp_path / "film.npz")


@pytest.fixture(scope="module")
def parts(ctx, tmp_path_factory) -> list[Path]:
    """Films of the samples 0 to 19, 20 to 59 and 60 to 66."""
    paths = []
    for number, (first, spp) in enumerate(((0, 20), (20, 40), (60, 7))):
        paths.append(tmp_path_factory.mktemp("parts") / f"{number}.npz")
        settings = {"first_sample": first, "adaptive": "off", "context": ctx} | SETTINGS
        with ctx, Renderer(load(SCENE), SIZE, **settings) as renderer:
            renderer.sample(spp)
            renderer.save(paths[-1])
    return paths


def joined(paths) -> SavedFilm:
    return merge({path.name: SavedFilm.read(path) for path in paths})


def test_parts_make_the_picture(ctx, parts) -> None:
    with Renderer(load(SCENE), SIZE, context=ctx, adaptive="off", **SETTINGS) as renderer:
        renderer.sample(67)
        whole = Moments.of(renderer._film.read())
    film = joined(parts)
    assert film.metadata["spp"] == "67"
    assert film.metadata["samples"] == "0-19, 20-59, 60-66"
    merged = Moments.of(film.pixels)
    np.testing.assert_array_equal(merged.count, whole.count)
    scale = 1e-5 * whole.mean.max()
    np.testing.assert_allclose(merged.mean, whole.mean, atol=scale)
    np.testing.assert_allclose(merged.half_difference, whole.half_difference, atol=scale)
    np.testing.assert_allclose(merged.variance, whole.variance, rtol=1e-3, atol=scale**2)
    for order in permutations(parts):
        for name, array in joined(order).arrays.items():
            np.testing.assert_array_equal(array, film.arrays[name])


def test_merging_is_exact() -> None:
    """Against all samples at once, in float64; some pixels have none in one of the films."""
    rng = np.random.default_rng(2)
    samples = rng.exponential(size=(9, 5, 4, 3))
    signs = np.where(np.arange(9) % 2, -1.0, 1.0)[:, None, None, None]
    counts = ((0, 3), (3, 9))

    def moments(first: int, end: int) -> Moments:
        values, count = samples[first:end], np.full((5, 4, 1), float(end - first))
        half_difference = (signs[first:end] * values).mean(axis=0)
        return Moments(values.mean(axis=0), values.var(axis=0), half_difference, count, 0 * count)

    one, other = (moments(*span) for span in counts)
    whole, merged = moments(0, 9), one.merged(other)
    for name, values in vars(whole).items():
        np.testing.assert_allclose(getattr(merged, name), values, rtol=1e-13, atol=1e-15)
    none = Moments(*(0 * values for values in vars(one).values()))
    for found in (none.merged(one), one.merged(none)):
        for name, values in vars(one).items():
            np.testing.assert_array_equal(getattr(found, name), values)
    assert not none.merged(none).mean.any()


def test_what_cannot_be_merged_is_named(ctx, parts, tmp_path) -> None:
    first, second, odd = (SavedFilm.read(path) for path in parts)
    films = {"a": first, "b": second}
    with pytest.raises(FilmError, match="b and c both have the samples 40 to 46"):
        merge(films | {"c": replace(odd, ranges=((40, 47),))})
    with pytest.raises(FilmError, match=r"c: has 7 .* even number"):
        merge({"c": odd, "d": replace(odd, ranges=((70, 77),))})
    with pytest.raises(FilmError, match="b: is not of the same picture as a: bounces is 3 there, 2 here"):
        merge({"a": first, "b": replace(second, origin=dict(second.origin) | {"bounces": "3"})})
    with pytest.raises(FilmError, match=r"guided is on there, off here \(--guiding on or off decides\)"):
        merge({"a": first, "b": replace(second, origin=dict(second.origin) | {"guided": "on"})})
    with Renderer(load(SCENE), SIZE, context=ctx, adaptive="on", **SETTINGS) as renderer:
        renderer.sample(FIRST_STAGE + 16)
        renderer.save(tmp_path / "film.npz")
    with pytest.raises(FilmError, match="c: was sampled adaptively"):
        merge(films | {"c": SavedFilm.read(tmp_path / "film.npz")})
    together = merge(films)
    together.write(tmp_path / "merged.npz")
    with pytest.raises(FilmError, match="both have the samples 20 to 59"):
        merge({"a": SavedFilm.read(tmp_path / "merged.npz"), "b": second})
    with (
        Renderer(load(SCENE), SIZE, context=ctx, adaptive="off", **SETTINGS) as renderer,
        pytest.raises(FilmError, match="merged of several"),
    ):
        renderer.resume(tmp_path / "merged.npz")


def test_a_window_is_a_part_of_the_picture(ctx, parts) -> None:
    """The same bits, wherever it lies and however passes are cut."""
    expected = SavedFilm.read(parts[1]).pixels
    with Renderer(load(SCENE), SIZE, context=ctx, adaptive="off", rays=7, **SETTINGS) as renderer:
        window = Window(left=5, top=2, width=9, height=6, first_sample=20)
        block = renderer.block(window, 40)
        assert renderer.spp == 0
        for name, image in vars(block).items():
            np.testing.assert_array_equal(image, getattr(expected, name)[2:8, 5:14])
        with pytest.raises(ValueError, match="even"):
            renderer.block(replace(window, first_sample=1), 4)
    with (
        Renderer(load(SCENE), SIZE, context=ctx, adaptive="on", **SETTINGS) as renderer,
        pytest.raises(ValueError, match="adaptive"),
    ):
        renderer.block(window, 4)


def test_foreign_films_are_refused(ctx, parts) -> None:
    """With what differs, by name."""
    scene = load(SCENE)
    moved = replace(scene, camera=replace(scene.camera, fov_degrees=41.0), name="other")
    cases = [
        (scene, SIZE, {"bounces": 3}, "bounces is 2 there, 3 here"),
        (scene, SIZE, {"seed": 5}, "seed is 0 there, 5 here"),
        (scene, SIZE, {"adaptive": "on"}, "adaptive is off there, on here"),
        (scene, (20, 36), {}, "size is 36x20 there, 20x36 here"),
        (moved, SIZE, {}, "the scene differs in: camera$"),
        (scene, SIZE, {"defines": {"HAS_MEDIA": 1}}, "defines is"),
        (scene, SIZE, {"first_sample": 4}, "its first sample is 0 there, 4 here"),
    ]
    for other, size, changed, words in cases:
        settings = {"adaptive": "off", "context": ctx} | SETTINGS | changed
        with Renderer(other, size, **settings) as renderer, pytest.raises(FilmError, match=words):
            renderer.resume(parts[0])


def test_versions_and_drivers_are_told(ctx, parts, tmp_path) -> None:
    film = SavedFilm.read(parts[0])
    other = tmp_path / "film.npz"
    with Renderer(load(SCENE), SIZE, context=ctx, adaptive="off", **SETTINGS) as renderer:
        replace(film, origin=dict(film.origin) | {"version": "0.0.1", "shaders": "x"}).write(other)
        with pytest.raises(FilmError, match=r"version is 0\.0\.1 there.*; the shaders are others"):
            renderer.resume(other)
        replace(film, driver="S3 ViRGE").write(other)
        with pytest.warns(UserWarning, match=r"S3 ViRGE.*bits may differ"):
            renderer.resume(other)
        assert renderer.spp == 20


def test_a_scene_is_known_by_its_content() -> None:
    scene = load("knot")
    digests = scene_digests(scene)
    assert scene_digests(replace(scene, name="other", description="other")) == digests
    (mesh, *others) = scene.meshes
    elsewhere = replace(mesh, file="/elsewhere", name="other")
    assert scene_digests(replace(scene, meshes=[elsewhere, *others])) == digests
    part = mesh.parts[0]
    positions = part.geometry.positions.copy()
    positions[0, 0] += 1e-9
    geometry = type(part.geometry)(positions, part.geometry.triangles)
    bent = Mesh((Part(geometry, part.material, part.matrix), *mesh.parts[1:]), mesh.instances)
    changed = scene_digests(replace(scene, meshes=[bent, *others]))
    assert {name for name in digests if changed[name] != digests[name]} == {"meshes"}


def test_minus_zero_is_zero() -> None:
    """Two scenes that are equal have the same film."""
    one, other = (Scene(Camera(target=(0.0, zero, -1.0)), ambient=Ambient(zero)) for zero in (0.0, -0.0))
    assert one == other
    assert scene_digests(one) == scene_digests(other)


def test_every_damage_is_noticed(tmp_path) -> None:
    path = tmp_path / "film.npz"
    write_archive(path, {"some": "header"}, ARRAYS)
    content = path.read_bytes()
    rng = np.random.default_rng(0)
    damaged = [content[:end] for end in (0, 1, *rng.integers(len(content), size=40), len(content) - 1)]
    for place in range(0, len(content), 3):
        damaged.append(content[:place] + bytes([content[place] ^ (1 << rng.integers(8))]) + content[place + 1 :])
    refused = 0
    for other in damaged:
        path.write_bytes(other)
        try:
            header, arrays = read_archive(path)
        except FilmError:
            refused += 1
            continue
        assert header == {"some": "header"}  # the damage is in what nobody reads, as the time of the file
        for name, array in ARRAYS.items():
            np.testing.assert_array_equal(arrays[name], array)
    assert refused > 0.7 * len(damaged)
    path.unlink()
    with pytest.raises(FilmError, match="no such file"):
        read_archive(path)


def test_a_header_that_is_no_object_is_a_damage(tmp_path) -> None:
    np.savez(tmp_path / "film.npz", header=np.frombuffer(b'"hello"', np.uint8))
    with pytest.raises(FilmError, match="damaged, or not one: its header is no JSON object"):
        SavedFilm.read(tmp_path / "film.npz")


def test_pickles_are_never_read(tmp_path) -> None:
    np.savez(tmp_path / "film.npz", header=np.array([{}], object))
    with pytest.raises(FilmError, match="damaged"):
        read_archive(tmp_path / "film.npz")


@pytest.mark.skipif(sys.platform != "linux", reason="traces system calls of Linux")
def test_a_writer_killed_between_any_two_system_calls_loses_nothing(tmp_path) -> None:
    """It is traced, and killed at each entry and exit of a system call: the old film is there, or the new one."""
    script = Path(__file__).with_name("killed_writer.py")
    done = subprocess.run([sys.executable, script, tmp_path], capture_output=True, text=True, timeout=60, check=False)
    if done.returncode == 77:
        pytest.skip(done.stdout)
    assert done.returncode == 0, done.stderr
    old, new = map(int, done.stdout.split())
    assert old > 20
    assert new > 2


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit of the size of files")
def test_a_full_disk_leaves_the_last_film(tmp_path) -> None:
    import resource

    path = tmp_path / "film.npz"
    write_archive(path, {"number": 1}, ARRAYS)
    large = {"a": np.zeros(100_000)}
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, limit[1]))
        with pytest.raises(OutputError, match=r"film.npz: cannot write"):
            write_archive(path, {"number": 2}, large)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert read_archive(path)[0] == {"number": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_pass_that_is_abandoned_is_not_counted(ctx, monkeypatch) -> None:
    """Nor taken off, where all was forgotten meanwhile; what a part of it has added is."""
    monkeypatch.setattr("fragtracer.gpu.tracer.Tracer._rows", lambda *_: 7)
    with Renderer(load(SCENE), SIZE, context=ctx, adaptive="off", **SETTINGS) as renderer:
        film, tracer = renderer._film, renderer._tracer
        renderer.sample(8)
        bands = film.bands(tracer, 4, None)
        next(bands)
        bands.close()
        assert renderer.spp == 8
        bands = film.bands(tracer, 4, None)
        next(bands)
        film.clear()
        bands.close()
        assert renderer.spp == 0
        bands = film.bands(tracer, 4, None)
        monkeypatch.setattr("fragtracer.gpu.tracer.Tracer.max_rays", 4)
        tracer._max_rays = 1  # as in a pass that a driver cuts short
        for _ in range(4):
            next(bands)
        bands.close()
        assert renderer.spp == renderer.samples().max() == 1


def test_a_film_that_is_not_what_was_drawn_is_not_kept(ctx, tmp_path) -> None:
    from fragtracer.errors import DeviceError

    with Renderer(load(SCENE), SIZE, context=ctx, adaptive="off", **SETTINGS) as renderer:
        renderer.sample(4)
        film = renderer._film._film
        pixels = film.read()
        mean = pixels.mean.copy()
        mean[3, 4, 3] += 1
        film.write(Pixels(mean, pixels.variance, pixels.half_difference), 4)
        with pytest.raises(DeviceError, match="does not hold"):
            renderer.save(tmp_path / "film.npz")
