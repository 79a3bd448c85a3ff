# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# What the scripts share that try containers for real, beside checks.sh: sourced by them, in the top folder.
set -euo pipefail
# shellcheck source=deploy/checks.sh
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"

image=localhost/dlcs:test
base=docker.io/library/debian:bookworm-slim

# Podman's settings, for all that runs here: of the file alone, not of the machine.
cat >"$work/containers.conf" <<SETTINGS
[engine]
runtime = "runc"
[containers]
# Named since not every machine lets a container raise them.
default_ulimits = ["nofile=4096:4096", "nproc=4096:4096"]
[network]
# With names: containers find one another by those of their services.
network_backend = "netavark"
SETTINGS
export CONTAINERS_CONF="$work/containers.conf"

# Where no registry of images is reached, Debian's packages make it.
make_base() {
  podman image exists "$base" || podman pull --quiet "$base" 2>/dev/null ||
    { mmdebstrap --quiet --variant=minbase bookworm "$work/base.tar" &&
      podman import --quiet "$work/base.tar" "$base"; }
}

# In the format of Docker: that of OCI has no health check. The compiler's cache knows what was built with the same
# options: where those builds had warnings as errors, CMAKE_OPTIONS=-DDLCS_WERROR=ON.
build_image() {
  local cache
  cache=$(ccache --get-config cache_dir)
  mkdir -p "$cache"
  podman build --format docker --network host --file deploy/Dockerfile --tag "$image" --build-arg BASE="$base" \
    --volume "$cache:/host-ccache" --build-arg CCACHE_DIR=/host-ccache --build-arg CMAKE_OPTIONS="${CMAKE_OPTIONS:-}" .
}

# The script says where its server is.
address=
# dlcs from the image, on the problems of this folder and the server at $address.
dlcs() { # COMMAND ARGUMENT...
  podman run --rm --network host --read-only --cap-drop all --security-opt no-new-privileges \
    --volume "$root/deploy/examples:/examples:ro" --entrypoint /usr/bin/dlcs "$image" "$@" --server "$address"
}
