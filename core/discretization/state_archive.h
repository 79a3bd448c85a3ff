// SPDX-License-Identifier: Apache-2.0
// Values as bytes and back, by one function for both ways.

#ifndef DLCS_CORE_DISCRETIZATION_STATE_ARCHIVE_H_
#define DLCS_CORE_DISCRETIZATION_STATE_ARCHIVE_H_

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/types.h"

namespace dlcs {

// Writes what it is given, or reads it back in the same order:
//
//     const auto carry = [&](StateArchive& state) { state(step, x, y); };
//
// Numbers keep their bits. The bytes end in a checksum: those that were cut or changed are not read. Not portable
// between machines of different byte order.
class StateArchive {
 public:
  // Writes.
  StateArchive() = default;
  // Reads `bytes`, which must outlive it.
  explicit StateArchive(std::string_view bytes);

  bool reads() const { return reads_; }
  // False, when reading, as soon as the bytes are not those of Take() or hold less than is asked for. What is read then
  // is zero.
  bool ok() const { return ok_; }
  // All that was written has been read.
  bool at_end() const { return ok_ && rest_.empty(); }
  // What was written, with its checksum.
  std::string Take();

  template <typename... Values>
  void operator()(Values&... values) {
    (Carry(values), ...);
  }

 private:
  void Carry(double& value) { CarryBytes(&value, sizeof value); }
  void Carry(Index& value) { CarryBytes(&value, sizeof value); }
  void Carry(std::size_t& value) { CarryBytes(&value, sizeof value); }
  void Carry(bool& value);
  void Carry(std::string& value);
  void Carry(Matrix& value);
  void Carry(Vector& value);
  template <typename Value>
  void Carry(std::optional<Value>& value) {
    bool present = value.has_value();
    Carry(present);
    if (reads_) value.reset();
    if (!present) return;
    if (reads_) value.emplace();
    Carry(*value);
  }
  template <typename Value>
  void Carry(std::vector<Value>& values) {
    std::size_t size = CarrySize(values.size(), 1);
    if (reads_) values.assign(size, Value());
    for (Value& value : values) Carry(value);
  }
  // A struct says itself what it consists of.
  template <typename Value>
  requires requires(StateArchive& archive, Value& value) { CarryFields(archive, value); }
  void Carry(Value& value) { CarryFields(*this, value); }

  void CarryBytes(void* bytes, std::size_t size);
  // The size of something whose elements take at least `element_bytes`: 0 where so many cannot be there.
  std::size_t CarrySize(std::size_t size, std::size_t element_bytes);

  bool reads_ = false;
  bool ok_ = true;
  std::string written_;
  std::string_view rest_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_STATE_ARCHIVE_H_
