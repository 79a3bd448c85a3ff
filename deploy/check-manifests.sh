#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compares the manifests of deploy/kubernetes, or those that are named, with the published schemas of Kubernetes: kinds,
# names of fields, types and required fields. What only a cluster knows is not checked: admission, quotas, whether an
# image or a metric exists.
#
#     deploy/check-manifests.sh [FILE...]   exit code 0, or 1 with what is wrong
#
# The schemas come through npm (deploy/manifests) into build/manifest-tools, once. Exit code 77: they cannot be had
# here.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=deploy/npm-packages.sh
. "$root/deploy/npm-packages.sh"
checked="the manifests"
tools="$root/build/manifest-tools"

files=()
for file in "$@"; do files+=("$(realpath "$file")"); done
if [ $# -eq 0 ]; then
  for file in "$root"/deploy/kubernetes/*.yaml; do
    # Its schema is kustomize's own.
    [ "${file##*/}" = kustomization.yaml ] || files+=("$file")
  done
fi
install_npm_packages "$root/deploy/manifests" "$tools" kubernetes-models
cp "$root/deploy/manifests/check_manifests.mjs" "$tools"
cd "$tools"
exec node check_manifests.mjs "${files[@]}"
