// SPDX-License-Identifier: Apache-2.0
#include "server/access/token.h"

#include <openssl/rand.h>

#include <array>
#include <cstdint>
#include <stdexcept>

#include "fmt/format.h"
#include "proto/wire/content_hash.h"

namespace dlcs {

std::string RandomToken() {
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  constexpr int kLetters = 43;  // of six bits each
  std::array<unsigned char, kLetters> random;
  if (RAND_bytes(random.data(), random.size()) != 1) throw std::runtime_error("the system gives no random bytes");
  std::string token = "dlcs_";
  for (const unsigned char byte : random) token += kAlphabet[byte % kAlphabet.size()];
  return token;
}

std::string TokenHash(std::string_view token) { return ContentHash(token); }

std::string TokenHashText(std::string_view token) {
  std::string text = "sha256:";
  for (const char byte : TokenHash(token)) text += fmt::format("{:02x}", static_cast<std::uint8_t>(byte));
  return text;
}

}  // namespace dlcs
