#!/bin/sh
# Prints a CPython for the Makefile to make .venv with: 3.11, else 3.12, else 3.13, on PATH or of
# pyenv. 3.11 comes first since PyBullet has no wheels for the others, where MuJoCo simulates.
#
# The argument is what PYTHON= says: a program, one of these versions, or `auto`: then uv may
# download 3.11 where none is at hand: the uv found on PATH, else the one of uv.lock, installed for
# as long as that takes into an environment of any other Python 3.
set -eu
asked=${1:-}
versions="3.11 3.12 3.13"

version_of() {
  "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null || true
}

refuse() {
  echo "HMCS needs CPython 3.11, 3.12 or 3.13 and $1" >&2
  exit 1
}

name_one="name one (make PYTHON=/path/to/python3.11), or let uv download it (make demo PYTHON=auto)"
case $asked in
  '' | auto) ;;
  3.11 | 3.12 | 3.13) versions=$asked ;;
  *)
    case " $versions " in
      *" $(version_of "$asked") "*) echo "$asked" ;;
      *) refuse "found another at $asked: $name_one" ;;
    esac
    exit 0
    ;;
esac
for version in $versions; do
  for candidate in "python$version" python3 python \
    "${PYENV_ROOT:-${HOME:-}/.pyenv}/versions/$version".*/bin/"python$version"; do
    if [ "$(version_of "$candidate")" = "$version" ]; then
      echo "$candidate"
      exit 0
    fi
  done
done
case $asked in
  '') refuse "found none: install it, $name_one" ;;
  auto) ;;
  *) refuse "found no $asked: install it, or $name_one" ;;
esac

aside=$(mktemp -d)
trap 'rm -rf "$aside"' EXIT
if ! uv=$(command -v uv); then
  uv=$aside/bin/uv
  for other in python3 python; do
    if "$other" -m venv "$aside" >/dev/null 2>&1; then
      "$aside/bin/python" "$(dirname "$0")/install_uv.py" >&2 || true
      break
    fi
  done
  [ -x "$uv" ] || refuse "could not get uv to download it: install uv or CPython 3.11; an older Python 3 with its venv module is enough to install uv with"
fi
export UV_PYTHON_DOWNLOADS=automatic
"$uv" python install --quiet 3.11 >&2 || refuse "uv could not download it: the lines above say why; install it yourself"
"$uv" python find --system --no-project 3.11 || refuse "uv does not find the one it downloaded"
