// SPDX-License-Identifier: Apache-2.0
#include "core/discretization/state_archive.h"

#include <cstdint>
#include <cstring>

namespace dlcs {
namespace {

// FNV-1a protects against accidental damage, not against forgery.
std::uint64_t Checksum(std::string_view bytes) {
  std::uint64_t sum = 14695981039346656037u;
  for (const char byte : bytes) sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211u;
  return sum;
}

}  // namespace

StateArchive::StateArchive(std::string_view bytes) : reads_(true), ok_(false) {
  std::uint64_t sum = 0;
  if (bytes.size() < sizeof sum) return;
  const std::string_view content = bytes.substr(0, bytes.size() - sizeof sum);
  std::memcpy(&sum, bytes.data() + content.size(), sizeof sum);
  if (sum != Checksum(content)) return;
  rest_ = content;
  ok_ = true;
}

std::string StateArchive::Take() {
  const std::uint64_t sum = Checksum(written_);
  written_.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  return std::move(written_);
}

void StateArchive::CarryBytes(void* bytes, std::size_t size) {
  if (!reads_) {
    written_.append(static_cast<const char*>(bytes), size);
    return;
  }
  ok_ = ok_ && rest_.size() >= size;
  if (size == 0) return;
  if (!ok_) {
    std::memset(bytes, 0, size);
    return;
  }
  std::memcpy(bytes, rest_.data(), size);
  rest_.remove_prefix(size);
}

std::size_t StateArchive::CarrySize(std::size_t size, std::size_t element_bytes) {
  Carry(size);
  if (!reads_) return size;
  ok_ = ok_ && size <= rest_.size() / element_bytes;
  return ok_ ? size : 0;
}

void StateArchive::Carry(bool& value) {
  char byte = value ? 1 : 0;
  CarryBytes(&byte, 1);
  value = byte != 0;
}

void StateArchive::Carry(std::string& value) {
  value.resize(CarrySize(value.size(), 1));
  CarryBytes(value.data(), value.size());
}

void StateArchive::Carry(Matrix& value) {
  Index rows = value.rows(), columns = value.cols();
  (*this)(rows, columns);
  if (reads_) {
    // A matrix without columns may have any number of rows, and has no entries that could be there or not.
    const auto most_entries = static_cast<Index>(rest_.size() / sizeof(double));
    ok_ = ok_ && rows >= 0 && columns >= 0 && (rows == 0 || columns <= most_entries / rows);
    value.resize(ok_ ? rows : 0, ok_ ? columns : 0);
  }
  CarryBytes(value.data(), static_cast<std::size_t>(value.size()) * sizeof(double));
}

void StateArchive::Carry(Vector& value) {
  const std::size_t size = CarrySize(static_cast<std::size_t>(value.size()), sizeof(double));
  if (reads_) value.resize(static_cast<Index>(size));
  CarryBytes(value.data(), size * sizeof(double));
}

}  // namespace dlcs
