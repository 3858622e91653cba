# Sourced by the scripts beside it: makes .venv once, with the exact versions of requirements.lock.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=${DARKO_VENV:-$root/.venv}

# can_serve PYTHON CONDITION: whether it can make .venv and a condition on the options of its build holds.
can_serve() {
  "$1" -c "import ensurepip, sys, sysconfig, venv
options = sysconfig.get_config_var('CONFIG_ARGS') or ''
sys.exit(sys.version_info < (3, 11) or not ($2))" 2>/dev/null
}

# The Python that makes .venv: PYTHON if set, else python3. If python3 was built without optimisation, as pyenv builds
# unless asked for more, the system's is taken: the quick tests then take a fifth less time.
chosen_python() {
  local unoptimised="'--enable-optimizations' not in options"
  if [ -z "${PYTHON:-}" ] && can_serve python3 "$unoptimised" && can_serve /usr/bin/python3 True; then
    echo /usr/bin/python3
  else
    echo "${PYTHON:-python3}"
  fi
}

# ensure_env EXTRA: install the project, editable, with an extra of pyproject.toml ("" for none).
ensure_env() {
  local extras=$1 stamp="$venv/.darko-${1:-run}" python
  if [ -e "$stamp" ] && [ "$stamp" -nt "$root/requirements.lock" ] && [ "$stamp" -nt "$root/pyproject.toml" ] &&
     [ "$stamp" -nt "$root/protocol/dialect/darko.xml" ] && [ "$stamp" -nt "$root/scripts/build_dialect.py" ] &&
     [ -e "$root/protocol/dialect/mavlink.py" ] && [ -e "$root/protocol/dialect/vocabulary.py" ]; then
    return
  fi
  python=$(chosen_python)
  "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null ||
    { echo "DarkO needs Python 3.11 or newer (set PYTHON to name one)" >&2; exit 1; }
  echo "Setting up $venv with $(command -v "$python") ..." >&2
  [ -x "$venv/bin/python" ] || "$python" -m venv "$venv" ||
    { echo "python3 -m venv failed: on Debian, install python3-venv" >&2; exit 1; }
  # The constraint also holds for the build environment, so that the dialect is made by the locked generator.
  PIP_CONSTRAINT="$root/requirements.lock" PIP_DISABLE_PIP_VERSION_CHECK=1 \
    "$venv/bin/pip" install --quiet --editable "$root${extras:+[$extras]}"
  touch "$stamp"
}

# What the tests use besides: a program, and Debian's packages that bring it.
TOOLS=(
  "chromium chromium"
  "gcc gcc g++"
  "clang clang"
  "cppcheck cppcheck"
  "arm-none-eabi-gcc gcc-arm-none-eabi libnewlib-arm-none-eabi"
  "qemu-system-arm qemu-system-arm"
  "aarch64-linux-gnu-gcc gcc-aarch64-linux-gnu libc6-dev-arm64-cross"
  "qemu-aarch64 qemu-user"
)

# ensure_tools: a browser to look at pages, compilers and processors for the exported controller. Without the right to
# install one, the tests that need it are skipped.
ensure_tools() {
  local program packages missing=()
  for tool in "${TOOLS[@]}"; do
    read -r program packages <<<"$tool"
    command -v "$program" >/dev/null || missing+=($packages)
  done
  [ ${#missing[@]} -eq 0 ] && return
  if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
    echo "Tests are skipped for want of (on Debian) apt-get install ${missing[*]}" >&2
    return
  fi
  echo "Installing ${missing[*]} ..." >&2
  { apt-get update -qq && apt-get install -qq -y --no-install-recommends "${missing[@]}"; } >/dev/null 2>&1 ||
    echo "They could not be installed: the tests that need them are skipped" >&2
}
