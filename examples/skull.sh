# shellcheck shell=bash
# SPDX-License-Identifier: MIT
# Sourced by the run scripts after cmake/setup.sh: fetches the skull CT into $skull.

skull=build/data/cranium
# Of matrix.dat, the voxels: what is fetched at run time is used only if it is what this program was tried on.
skull_sha256=d87fd5e6aaf2c4fdf4f3fe28ee3335192fc2464ed8e9682fc78530cb837938da

is_skull() { [ -e "$1/main.plist" ] && echo "$skull_sha256  $1/matrix.dat" | sha256sum --check --status 2>/dev/null; }

# Leaves the skull in $skull or says why not.
fetch_skull() {
  is_skull "$skull" && return 0
  local tool
  for tool in apt-get dpkg-deb sha256sum tar gzip; do
    has_command "$tool" || { say "no $tool here, so no skull CT"; return 1; }
  done
  say "fetching the skull CT: Debian package invesalius-examples (19 MB), unpacked into $skull"
  local work status=0
  work=$(mktemp -d)
  download_skull "$work" || status=1
  rm -rf "$work"
  return $status
}

download_skull() {
  local work=$1 sandbox=()
  # As root apt would complain that its own user cannot write here.
  [ "$(id -u)" = 0 ] && sandbox=(-o APT::Sandbox::User=root)
  download() { (cd "$work" && apt-get -q "${sandbox[@]}" download invesalius-examples) >"$work/log" 2>&1; }
  # Fresh machines have no package lists, stale ones name files that are gone.
  if ! download; then
    if become_root; then apt update >"$work/log" 2>&1 || true; fi
    if ! download; then
      grep -E '^E:' "$work/log" >&2 || true
      say "apt-get could not download it"
      return 1
    fi
  fi
  dpkg-deb -x "$work"/invesalius-examples_*.deb "$work/package" || return 1
  local archive
  archive=$(find "$work/package" -name Cranium.inv3 -print -quit)
  mkdir "$work/cranium"
  # The folder in the archive has a random name.
  if [ -z "$archive" ] || ! tar -xzf "$archive" -C "$work/cranium" --strip-components=1 --no-same-owner --no-same-permissions \
    --wildcards '*/matrix.dat' '*/main.plist'; then
    say "the package holds no Cranium.inv3 as expected"
    return 1
  fi
  is_skull "$work/cranium" || { say "the package's matrix.dat is another one (sha256), not used"; return 1; }
  mkdir -p "$(dirname "$skull")"
  rm -rf "$skull"
  mv "$work/cranium" "$skull"
}
