// SPDX-License-Identifier: Apache-2.0
// Serializes values to bytes and back, by one function for both directions.

#ifndef DLCS_CORE_DISCRETIZATION_STATE_ARCHIVE_H_
#define DLCS_CORE_DISCRETIZATION_STATE_ARCHIVE_H_

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/types.h"

namespace dlcs {

// Writes the values passed to it, or reads them back in the same order:
//
//     const auto carry = [&](StateArchive& state) { state(step, x, y); };
//
// Numbers keep their bits. The bytes end in a checksum: truncated or changed bytes are rejected. Not portable between
// machines of different byte order.
class StateArchive {
 public:
  // Writes.
  StateArchive() = default;
  // Reads `bytes`, which must outlive it.
  explicit StateArchive(std::string_view bytes);

  bool reads() const { return reads_; }
  // When reading: false as soon as the bytes do not come from Take() or are too short. Values read after that are zero.
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
  // A struct lists its fields in CarryFields().
  template <typename Value>
  requires requires(StateArchive& archive, Value& value) { CarryFields(archive, value); }
  void Carry(Value& value) { CarryFields(*this, value); }

  void CarryBytes(void* bytes, std::size_t size);
  // Carries the number of elements of a container whose elements take at least `element_bytes` each; 0 when reading if
  // the remaining bytes cannot hold that many.
  std::size_t CarrySize(std::size_t size, std::size_t element_bytes);

  bool reads_ = false;
  bool ok_ = true;
  std::string written_;
  std::string_view rest_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_DISCRETIZATION_STATE_ARCHIVE_H_
