#!/bin/sh
# Makes sure that a C++ compiler and OMPL's headers are there; installs them where that needs no question.
set -eu

has_ompl() {
    command -v c++ >/dev/null || return 1
    for root in /usr /usr/local /opt/homebrew /opt/ros/* "${CONDA_PREFIX:-/usr}"; do
        for header in "$root"/include/ompl/config.h "$root"/include/ompl-*/ompl/config.h; do
            [ -e "$header" ] && return 0
        done
    done
    [ -n "${CMAKE_PREFIX_PATH:-}" ]
}

has_ompl && exit 0

as_root=""
if [ "$(id -u)" -ne 0 ]; then
    as_root="sudo -n"
    $as_root true 2>/dev/null || as_root="no"
fi
if command -v apt-get >/dev/null && [ "$as_root" != no ]; then
    echo "installing libompl-dev and a C++ compiler through apt-get"
    $as_root apt-get update -qq >/dev/null
    DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y -qq libompl-dev g++ >/dev/null
    has_ompl && exit 0
fi
echo "OMPL is missing: Debian/Ubuntu 'sudo apt install libompl-dev g++', conda 'conda install -c conda-forge ompl cxx-compiler', macOS 'brew install ompl'" >&2
exit 2
