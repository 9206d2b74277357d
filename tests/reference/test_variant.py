# SPDX-License-Identifier: MIT
"""The choice of the Mitsuba variant, and of an LLVM library that does not abort the process."""

import subprocess
import sys

import pytest

from fragtracer.errors import FragtracerError
from fragtracer.reference import variant


@pytest.fixture
def no_llvm(monkeypatch):
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr(variant, "find_llvm", lambda: None)


def test_candidates_are_ordered_by_version_and_never_old(monkeypatch, tmp_path):
    for name in ("libLLVM-15.so.1", "libLLVM-14.so", "libLLVM.so.18.1", "libLLVM-20.so", "libLLVM.so"):
        (tmp_path / name).touch()
    monkeypatch.setattr(variant, "_FOLDERS", (str(tmp_path),))
    assert [path.rsplit("/", 1)[1] for path in variant._candidates()] == [
        "libLLVM-20.so",
        "libLLVM.so.18.1",
        "libLLVM.so",
    ]


def test_a_file_that_is_no_llvm_library_has_no_version(tmp_path):
    (tmp_path / "libLLVM-19.so").write_text("not a library")
    assert variant.llvm_version(str(tmp_path / "libLLVM-19.so")) is None


def test_an_unusable_asked_for_library_is_passed_over(monkeypatch, tmp_path):
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "missing.so"))
    monkeypatch.setattr(variant, "_candidates", list)
    with pytest.warns(UserWarning, match="looking elsewhere"):
        assert variant.find_llvm.__wrapped__() is None


def test_without_llvm_scalar_is_taken_with_a_warning(no_llvm):
    with pytest.warns(UserWarning, match="60 times slower"):
        assert variant.choose_variant() == "scalar_rgb"


def test_without_llvm_asking_for_it_fails(no_llvm):
    with pytest.raises(FragtracerError, match="DRJIT_LIBLLVM_PATH"):
        variant.choose_variant("llvm_ad_rgb")


def test_explicit_variants_are_taken_as_they_are(no_llvm):
    assert variant.choose_variant("scalar_rgb") == "scalar_rgb"
    assert variant.choose_variant("cuda_ad_rgb") == "cuda_ad_rgb"
    with pytest.raises(FragtracerError, match="linear RGB"):
        variant.choose_variant("scalar_spectral")


def test_a_variant_that_mitsuba_lacks(mi):
    with pytest.raises(FragtracerError, match="does not start"), variant.mitsuba_variant("abacus_rgb"):
        pass


def test_the_variant_before_comes_back(mi):
    with variant.mitsuba_variant("scalar_rgb") as name:
        assert mi.variant() == name == "scalar_rgb"
    assert mi.variant() == "llvm_ad_rgb"


def test_without_mitsuba_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(FragtracerError, match=r"fragtracer\[reference\]"), variant.mitsuba_variant("scalar_rgb"):
        pass


def test_the_package_does_not_import_mitsuba():
    code = (
        "import sys, fragtracer.reference.render, fragtracer.reference.export;"
        "sys.exit('mitsuba' in sys.modules or 'drjit' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
