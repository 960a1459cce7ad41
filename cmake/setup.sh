# shellcheck shell=bash
# SPDX-License-Identifier: MIT
# Sourced by the run scripts: finds what is missing, says so, installs it with apt-get.
#   need NAME...   what the caller cannot do without: installs it or ends with a clear message
#   want NAME...   what only adds something: installs it if it can, else says what is left out and goes on
# NAME is a row of the table below. A thing counts as present wherever it came from; no package manager is asked.

script=${0##*/}
[ "$script" = run ] && script=$(basename "$(dirname "$0")")/run
say() { printf '%s: %s\n' "$script" "$*"; }
die() { printf '%s: %s\n' "$script" "$*" >&2; exit 1; }

# NAME -> Debian package, test for presence, what is left out without it.
about() {
  case $1 in
    compiler) compiler_package; test_of=has_compiler; without="" ;;
    cmake) package=cmake; test_of=has_cmake; without="" ;;
    ninja) package=ninja-build; test_of="has_command ninja"; without="" ;;
    eigen) package=libeigen3-dev; test_of="has_header Eigen/Core"; without="" ;;
    doctest) package=doctest-dev; test_of="has_header doctest/doctest.h"; without="" ;;
    benchmark) package=libbenchmark-dev; test_of="has_header benchmark/benchmark.h"; without="" ;;
    thread-sanitizer) sanitizer_package; test_of=has_thread_sanitizer; without="the tests under ThreadSanitizer" ;;
    clang) package=clang; test_of="has_command clang++"; without="" ;;
    clang-format) package=clang-format-16; test_of="has_command clang-format-16"; without="" ;;
    clang-tidy) package=clang-tidy; test_of="has_command clang-tidy"; without="" ;;
    itk) package=libinsighttoolkit5-dev; test_of=has_itk; without="reading DICOM, NRRD, NIfTI and MetaImage, and ITK as a measure" ;;
    openvdb) package=libopenvdb-dev; test_of="has_header openvdb/openvdb.h"; without="OpenVDB as a measure" ;;
    boost) package=libboost-dev; test_of="has_header boost/version.hpp"; without="what OpenVDB's headers need, and the programs and tests of the Haply Inverse3 and of robots" ;;
    nlohmann-json) package=nlohmann-json3-dev; test_of="has_header nlohmann/json.hpp"; without="the programs and tests of the Haply Inverse3 and of robots" ;;
    nanovdb) package=libnanovdb-dev; test_of="has_header nanovdb/NanoVDB.h"; without="NanoVDB as a measure" ;;
    png) package=libpng-dev; test_of="has_header png.h"; without="pictures" ;;
    cli11) package=libcli11-dev; test_of="has_header CLI/CLI.hpp"; without="the CLI11 command line" ;;
    doxygen) package=doxygen; test_of="has_command doxygen"; without="the reference of the headers" ;;
    python3) package=python3; test_of="has_command python3"; without="the tests from Python" ;;
    python-headers) package=python3-dev; test_of=has_python_headers; without="the Python module and its tests" ;;
    numpy) package=python3-numpy; test_of="has_python_module numpy"; without="the Python module and its tests" ;;
    pybind11) package=pybind11-dev; test_of="has_header pybind11/pybind11.h"; without="the Python module and its tests" ;;
    h5py) package=python3-h5py; test_of="has_python_module h5py"; without="the tests of sessions as HDF5" ;;
    mypy) package=mypy; test_of="has_python_module mypy"; without="the check of the Python module's types" ;;
    chromium) package=chromium; test_of="has_command chromium"; without="the tests of reports in a browser" ;;
    emscripten) package=emscripten; test_of="has_command emcc"; without="the page and its tests" ;;
    npm) package=npm; test_of=has_node; without="the page and its tests" ;;
    mono) package=mono-mcs; test_of="has_command mcs"; without="the C# binding's program and tests" ;;
    pkg-config) package=pkg-config; test_of="has_command pkg-config"; without="the test of the pkg-config file" ;;
    spnav) package=libspnav-dev; test_of="has_header spnav.h"; without="the 6-DOF mouse's program and tests" ;;
    xlib) package=libx11-dev; test_of="has_header X11/Xlib.h"; without="the 6-DOF mouse's program and tests (spnav.h includes Xlib.h)" ;;
    glfw) package=libglfw3-dev; test_of="has_header GLFW/glfw3.h"; without="the window" ;;
    imgui) package=libimgui-dev; test_of=has_imgui; without="the window" ;;
    opengl) package=libgl-dev; test_of="has_header GL/glext.h"; without="the window" ;;
    opengl-driver) package=libgl1-mesa-dri; test_of=has_opengl_driver; without="Mesa's OpenGL" ;;
    xvfb) package=xvfb; test_of="has_command Xvfb"; without="the tests of the window" ;;
    xauth) package=xauth; test_of="has_command xauth"; without="the tests of the window" ;;
    gnuplot) package=gnuplot-nox; test_of="has_command gnuplot"; without="plots" ;;
    mingw) package=g++-mingw-w64-x86-64-posix; test_of="has_command x86_64-w64-mingw32-g++-posix"; without="" ;;
    wine) package=wine64; test_of=has_wine; without="" ;;
    libcxx) package=libc++-dev; test_of=has_libcxx; without="" ;;
    libcxxabi) package=libc++abi-dev; test_of=has_libcxxabi; without="" ;;
    aarch64) package=g++-aarch64-linux-gnu; test_of="has_command aarch64-linux-gnu-g++"; without="" ;;
    qemu) package=qemu-user; test_of="has_command qemu-aarch64"; without="" ;;
    *) die "setup.sh knows no '$1'" ;;
  esac
}

has_command() { command -v "$1" >/dev/null 2>&1; }
has_header() {
  local prefix
  for prefix in ${CMAKE_PREFIX_PATH:+${CMAKE_PREFIX_PATH//[;:]/ }} /usr/local /usr /opt/homebrew; do
    if [ -e "$prefix/include/$1" ] || [ -e "$prefix/include/eigen3/$1" ]; then return 0; fi
  done
  compgen -G "/usr/include/*-linux-*/$1" >/dev/null
}
# Packages go to the system's Python, which need not be the first on the path.
has_python_module() { python3 -c "import $1" >/dev/null 2>&1 || /usr/bin/python3 -c "import $1" >/dev/null 2>&1; }
has_python_headers() {
  local python
  for python in python3 /usr/bin/python3; do
    if [ -e "$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))' 2>/dev/null)/Python.h" ]; then return 0; fi
  done
  return 1
}
has_node() { has_command node && has_command npm; }
has_wine() { has_command wine64 || has_command wine || [ -x /usr/lib/wine/wine64 ]; }
has_libcxx() { compgen -G "/usr/lib/llvm-*/include/c++/v1/vector" >/dev/null; }
has_libcxxabi() { compgen -G "/usr/lib/llvm-*/lib/libc++abi.so" >/dev/null; }
has_imgui() { has_header imgui/imgui.h || has_header imgui.h; }
has_opengl_driver() { compgen -G "/usr/lib/*/dri/*_dri.so" >/dev/null || compgen -G "/usr/lib/*/libGLX_nvidia.so*" >/dev/null; }
has_itk() {
  [ -n "${ITK_DIR:-}" ] || compgen -G "/usr/lib/cmake/ITK-5.*" >/dev/null || compgen -G "/usr/lib/*/cmake/ITK-5.*" >/dev/null ||
    compgen -G "/usr/local/lib/cmake/ITK-5.*" >/dev/null
}
# The C compiler too: the project asks for both.
has_compiler() {
  if [ -n "${CXX:-}" ]; then has_command "${CXX%% *}"; else has_command c++ || has_command g++ || has_command clang++; fi &&
    if [ -n "${CC:-}" ]; then has_command "${CC%% *}"; else has_command cc || has_command gcc || has_command clang; fi
}
compiler_package() {
  local name=${CXX:-g++}
  name=${name%% *}
  case $(basename "$name") in
    clang++) package=clang ;;
    clang++-*) package=clang-${name##*-} ;;
    c++) package=g++ ;;
    *) package=$(basename "$name") ;;
  esac
}
# Debian keeps clang's sanitizers apart; g++ brings its own.
has_thread_sanitizer() {
  case ${CXX:-} in
    *clang++*) compgen -G "$("${CXX%% *}" -print-resource-dir)/lib/*/libclang_rt.tsan*" >/dev/null ;;
  esac
}
sanitizer_package() {
  case ${CXX:-} in
    *clang++-*) package=libclang-rt-${CXX##*-}-dev ;;
    *) package=libclang-rt-dev ;;
  esac
}
has_cmake() {
  has_command cmake || return 1
  cmake --version | awk '/version/ { split($3, v, "."); exit !(v[1] > 3 || (v[1] == 3 && v[2] >= 24)) }'
}

# Sets `root`, the words before a command that needs root; fails where there is no way to get it.
become_root() {
  if [ "$(id -u)" = 0 ]; then root=(); return 0; fi
  has_command sudo || return 1
  root=(sudo)
  # Without a terminal sudo cannot ask for a password.
  sudo -n true 2>/dev/null || { [ -t 0 ] && [ -t 1 ]; }
}

apt() { "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=600 -o Dpkg::Use-Pty=0 "$@"; }

# Installs packages; keeps the log for the error message. `apt-get update` first: lists of fresh machines are empty, of
# old ones stale.
install_packages() {
  local log
  log=$(mktemp)
  if ! apt update >"$log" 2>&1; then say "apt-get update failed (no network?); trying with the lists there are"; fi
  if apt install --no-install-recommends "$@" >>"$log" 2>&1; then
    rm -f "$log"
    return 0
  fi
  grep -E '^(E|W):' "$log" >&2 || tail -n 5 "$log" >&2
  rm -f "$log"
  return 1
}

# Of the names given, those that are missing, and their packages.
find_missing() {
  local name
  missing=(); packages=()
  for name in "$@"; do
    about "$name"
    $test_of || { missing+=("$name"); packages+=("$package"); }
  done
}

need() {
  find_missing "$@"
  [ ${#missing[@]} -gt 0 ] || return 0
  local by_hand="apt-get install --no-install-recommends ${packages[*]}"
  if ! has_command apt-get; then
    die "missing: ${missing[*]}. There is no apt-get here to install them with; please install them (on Debian: ${packages[*]}) and run this again."
  fi
  if ! become_root; then
    die "missing: ${missing[*]}. Installing needs root, and this is neither root nor is there a usable sudo. As root: $by_hand"
  fi
  say "installing what is missing: ${packages[*]}"
  install_packages "${packages[@]}" || die "could not install ${packages[*]}; by hand: $by_hand"
  find_missing "$@"
  if [ ${#missing[@]} -gt 0 ]; then
    case " ${missing[*]} " in
      *" cmake "*) die "this system's cmake is too old ($(cmake --version | head -n 1)); trephine needs 3.24 or newer." ;;
    esac
    die "still missing after the installation: ${missing[*]}"
  fi
}

want() {
  find_missing "$@"
  [ ${#missing[@]} -gt 0 ] || return 0
  if has_command apt-get && become_root; then
    say "installing what is optional and missing: ${packages[*]}"
    # One that a distribution does not have must not cost the others.
    install_packages "${packages[@]}" || local each=1
    if [ "${each:-0}" = 1 ]; then
      local one
      for one in "${packages[@]}"; do apt install --no-install-recommends "$one" >/dev/null 2>&1 || true; done
    fi
  fi
  find_missing "$@"
  local name
  for name in "${missing[@]}"; do
    about "$name"
    say "$package is not installed: left out is $without"
  done
}

# As many jobs as processors, but not more than memory carries: a compiler with Eigen's templates takes up to 1.5 GB.
jobs() {
  local cpus memory
  cpus=$(nproc 2>/dev/null || echo 2)
  memory=$(awk '/^MemAvailable/ {print int($2 / 1500000)}' /proc/meminfo 2>/dev/null || true)
  [ -n "$memory" ] && [ "$memory" -lt "$cpus" ] && cpus=$((memory > 0 ? memory : 1))
  echo "$cpus"
}

# configure DIR [CMAKE ARGUMENTS]: quiet unless it fails, started anew where the folder is of another generator, place or
# compiler.
configure() {
  local dir=$1 log
  shift
  log=$dir.configure.log
  mkdir -p "$dir"
  if ! cmake -S . -B "$dir" -G Ninja "$@" >"$log" 2>&1; then
    rm -rf "$dir"
    mkdir -p "$dir"
    cmake -S . -B "$dir" -G Ninja "$@" >"$log" 2>&1 || { cat "$log" >&2; die "configuring failed"; }
  fi
  grep -E '^-- trephine' "$log" | sed 's/^-- //' || true
}

# build DIR [TARGETS]
build() {
  local dir=$1
  shift
  cmake --build "$dir" -j "$(jobs)" ${1:+--target "$@"}
}
