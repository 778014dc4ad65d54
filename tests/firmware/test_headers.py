#
# This file is part of LiteStereo.
#
# SPDX-License-Identifier: BSD-2-Clause

"""The public headers, each alone, for C and for C++; and a program in C++ with the drivers."""

import re
import subprocess

import pytest

from support.paths import CHECKOUT

INCLUDE = CHECKOUT / "firmware" / "include"
HEADERS = sorted(path.relative_to(INCLUDE).as_posix() for path in INCLUDE.rglob("*.h"))

COMPILERS = {"c11": ["gcc", "-x", "c", "-std=c11"], "c++17": ["g++", "-x", "c++", "-std=c++17"]}

GUARD = '#ifdef __cplusplus\nextern "C" {\n#endif\n'
END   = "#ifdef __cplusplus\n}\n#endif\n"


def compiled(language, text, folder, *options):
    """What the compiler says of a source, empty if it is good."""
    source = folder / "source"
    source.write_text(text)
    command = [*COMPILERS[language], "-Wall", "-Wextra", "-Werror", "-pedantic", f"-I{INCLUDE}", *options, "-c", source,
               "-o", folder / "source.o"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stderr


@pytest.mark.parametrize("language", COMPILERS)
@pytest.mark.parametrize("header", HEADERS)
def test_header_alone(tmp_path, header, language):
    """Once for its contents, twice for its guard."""
    assert compiled(language, f'#include "{header}"\n'*2 + "extern int is_used;\nint is_used = 1;\n", tmp_path) == ""


@pytest.mark.parametrize("language", COMPILERS)
def test_all_headers_together(tmp_path, language):
    text = "".join(f'#include "{header}"\n' for header in [*HEADERS, *reversed(HEADERS)])
    assert compiled(language, text + "int is_used(void);\nint is_used(void) { return 1; }\n", tmp_path) == ""


def functions(header):
    """Names of the functions that a header declares without defining them."""
    text = re.sub(r"/\*.*?\*/", "", (INCLUDE / header).read_text(), flags=re.DOTALL)
    return re.findall(r"^[a-z][\w ]*[ *](\w+)\([^{};]*\)\s*;", text, re.MULTILINE)


@pytest.mark.parametrize("header", HEADERS)
def test_functions_have_the_names_of_c(tmp_path, header):
    """A C++ program that needs each function asks the linker for the name that the C object has."""
    names = functions(header)
    uses  = [f"extern void *const use_{name};\nvoid *const use_{name} = reinterpret_cast<void *>(&{name});\n"
             for name in names]
    text  = "".join([f'#include "{header}"\n', *uses])
    assert compiled("c++17", text + "int main() { return 0; }\n", tmp_path) == ""
    symbols = subprocess.run(["nm", "-u", tmp_path / "source.o"], check=True, capture_output=True, text=True).stdout
    assert {line.split()[-1] for line in symbols.splitlines()} >= set(names)


def test_most_headers_have_functions():
    assert sum(bool(functions(header)) for header in HEADERS) > 12
    assert {"stereo_submit", "stereo_wait"} <= set(functions("litestereo/stereo.h"))


@pytest.mark.parametrize("header", HEADERS)
def test_what_c_sees_is_within_the_guard(header):
    text = (INCLUDE / header).read_text()
    if functions(header):
        begin, end = text.index(GUARD), text.rindex(END)
        assert not re.search(r"^(?!#|/| \*|\s|$)", text[:begin], re.MULTILINE)
        assert "#include" not in text[begin:end]


@pytest.mark.parametrize("fault", ["static inline stereo_limits_t f(void) { return (stereo_limits_t){.features = 1}; }",
                                   "static inline int f(int n) { int a[n]; a[0] = n; return a[0]; }",
                                   "static inline char *f(void *p) { char *c = p; return c; }"])
def test_what_only_c_has_is_refused(tmp_path, fault):
    text = f'#include "litestereo/stereo_settings.h"\n{fault}\n'
    assert "error" in compiled("c++17", text, tmp_path, "-Wno-unused-function")


def test_names_of_statuses(programs):
    """In the order of the header, in lower case."""
    text  = (INCLUDE / "litestereo" / "status.h").read_text()
    names = re.findall(r"^    STATUS_(\w+)", text, re.MULTILINE)
    done  = subprocess.run([programs / "test_status", "names"], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [name.lower() for name in names] and len(names) == 19


def test_a_program_in_cplusplus(programs):
    """It runs with the drivers in C, and a matcher in software."""
    done = subprocess.run([programs / "hello_cplusplus"], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.replace("\r", "") == (
        "hello_cplusplus: 128x64 pixels in 8192 clocks, disparity 192/16 pixels\nhello_cplusplus: end\n")
