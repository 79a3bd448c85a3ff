// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/content_hash.h"

#include <openssl/sha.h>

namespace dlcs {

std::string ContentHash(std::string_view content) {
  std::string hash(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(content.data()), content.size(),
         reinterpret_cast<unsigned char*>(hash.data()));
  return hash;
}

}  // namespace dlcs
