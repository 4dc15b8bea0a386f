#!/bin/sh
# Prints a CPython 3.11 for the Makefile to make .venv with. The argument is what PYTHON= says.
#
# With `auto` uv may download one where none is at hand: the uv found on PATH, else the one of
# uv.lock, installed for as long as that takes into an environment of any other Python 3.
set -eu
asked=${1:-}

is_311() {
  "$1" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' >/dev/null 2>&1
}

refuse() {
  echo "HMCS needs CPython 3.11 and $1" >&2
  exit 1
}

case $asked in '' | auto) set -- python3.11 python3 python ;; esac
for candidate; do
  if is_311 "$candidate"; then
    echo "$candidate"
    exit 0
  fi
done
case $asked in
  '') refuse "found none: install it, name it (make PYTHON=/path/to/python3.11), or let uv download it (make demo PYTHON=auto)" ;;
  auto) ;;
  *) refuse "found another at $asked: name one (make PYTHON=/path/to/python3.11), or let uv download it (make demo PYTHON=auto)" ;;
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
