#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Lays out the root of a container image: the given programs, the libraries that they load with the licenses of those,
# certificates of public authorities, and a user who owns the folder for jobs and nothing else.
#
#     deploy/image-root.sh FOLDER PROGRAM...
set -euo pipefail

[ $# -ge 2 ] || { echo "usage: $0 FOLDER PROGRAM..." >&2; exit 2; }
root=$1
shift
user=65532 # what images without a root user have agreed on
libraries="$root/usr/lib/$(uname -m)-linux-gnu" # where Debian's loader looks without being told

mkdir -p "$root"/{etc/ssl/certs,usr/bin,usr/share/doc/dlcs,var/lib/dlcs,tmp} "$libraries"
ln -s usr/lib "$root/lib"

# "libz.so.1 => /lib/x86_64-linux-gnu/libz.so.1 (0x...)", and the loader itself, "/lib64/ld-linux-x86-64.so.2 (0x...)"
ldd "$@" | awk '$2 == "=>" {print $3}' | sort -u | while read -r library; do
  cp --dereference "$library" "$libraries"
  # By its name alone: Debian calls some folders /lib that are /usr/lib.
  package=$(dpkg --search "*/$(basename "$(realpath "$library")")" | sed 's/:.*//;q')
  cp --dereference "/usr/share/doc/$package/copyright" "$root/usr/share/doc/$package"
done
# What the programs contain of static libraries, where the system has them.
for package in libgrpc-dev libprotobuf-dev libabsl-dev coinor-libclp-dev coinor-libcoinutils-dev liblapack-dev \
  libblas-dev libhdf5-dev libjemalloc-dev; do
  cp --dereference "/usr/share/doc/$package/copyright" "$root/usr/share/doc/$package"
done
loader=$(ldd "$1" | awk '$1 ~ /^\/.*ld-linux/ {print $1}')
mkdir -p "$root$(dirname "$loader")"
cp --dereference "$loader" "$root$loader"

install --strip "$@" "$root/usr/bin"
cp LICENSE "$root/usr/share/doc/dlcs"
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs"
printf 'root:x:0:0::/:\ndlcs:x:%s:%s::/var/lib/dlcs:\n' $user $user >"$root/etc/passwd"
printf 'root:x:0:\ndlcs:x:%s:\n' $user >"$root/etc/group"
chown $user:$user "$root/var/lib/dlcs"
chmod 1777 "$root/tmp"
