// SPDX-License-Identifier: Apache-2.0
#include "server/access/forwarded_caller.h"

#include <openssl/crypto.h>

#include <charconv>
#include <cstddef>

#include "fmt/format.h"
#include "server/access/token.h"

namespace dlcs {
namespace {

// Prefixes a text with its length, "3:abc", so that texts of any bytes can be concatenated.
std::string Counted(const std::string& text) { return fmt::format("{}:", text.size()) + text; }

// Removes one such text from the beginning of `rest`.
std::optional<std::string> TakeCounted(std::string_view& rest) {
  std::size_t size = 0;
  const auto [colon, error] = std::from_chars(rest.data(), rest.data() + rest.size(), size);
  const auto begin = static_cast<std::size_t>(colon - rest.data()) + 1;
  if (error != std::errc() || begin > rest.size() || *colon != ':' || size > rest.size() - begin) return std::nullopt;
  std::string text(rest.substr(begin, size));
  rest.remove_prefix(begin + size);
  return text;
}

}  // namespace

ForwardingKey::ForwardingKey() : secret_(RandomToken()) {}

std::string ForwardingKey::Encode(const ForwardedCaller& caller) const {
  std::string value = secret_ + Counted(caller.peer);
  for (const std::string& name : caller.certificate_names) value += Counted(name);
  return value;
}

std::optional<ForwardedCaller> ForwardingKey::Decode(std::string_view value) const {
  if (value.size() < secret_.size()) return std::nullopt;
  if (CRYPTO_memcmp(value.data(), secret_.data(), secret_.size()) != 0) return std::nullopt;
  value.remove_prefix(secret_.size());
  ForwardedCaller caller;
  std::optional<std::string> text = TakeCounted(value);
  if (!text) return std::nullopt;
  caller.peer = *std::move(text);
  while (!value.empty()) {
    text = TakeCounted(value);
    if (!text) return std::nullopt;
    caller.certificate_names.push_back(*std::move(text));
  }
  return caller;
}

}  // namespace dlcs
