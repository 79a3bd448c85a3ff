// SPDX-License-Identifier: Apache-2.0
#include "client/files/stored_array.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <limits>
#include <optional>

namespace dlcs::client {
namespace {

// The bits of a number, whichever byte comes first.
std::uint64_t BitsAt(std::string_view bytes, const NumberFormat& format) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < format.bytes; ++k) {
    const std::size_t at = format.big_endian ? k : format.bytes - 1 - k;
    bits = bits << 8 | static_cast<unsigned char>(bytes[at]);
  }
  return bits;
}

// A float of 16 bits: a sign, 5 bits of exponent, 10 of fraction.
double HalfFloat(std::uint64_t bits) {
  const auto exponent = static_cast<int>(bits >> 10 & 0x1f);
  const auto fraction = static_cast<double>(bits & 0x3ff);
  const double magnitude = exponent == 0x1f ? (fraction == 0 ? std::numeric_limits<double>::infinity()
                                                             : std::numeric_limits<double>::quiet_NaN())
                           : exponent == 0  ? std::ldexp(fraction, -24)
                                            : std::ldexp(1024 + fraction, exponent - 25);
  return (bits >> 15 & 1) != 0 ? -magnitude : magnitude;
}

double FloatOf(std::uint64_t bits, std::size_t bytes) {
  if (bytes == 8) return std::bit_cast<double>(bits);
  if (bytes == 4) return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  return HalfFloat(bits);
}

// Absent if no double is equal to the integer.
std::optional<double> IntegerOf(std::uint64_t bits, const NumberFormat& format) {
  if (format.kind == NumberFormat::Kind::kSigned) {
    const std::size_t unused = 64 - 8 * format.bytes;
    const auto number = static_cast<std::int64_t>(bits << unused) >> unused;
    const std::uint64_t magnitude = number < 0 ? 0 - static_cast<std::uint64_t>(number) : bits;
    const auto value = IntegerOf(magnitude, {.kind = NumberFormat::Kind::kUnsigned});
    return value && number < 0 ? -*value : value;
  }
  // A double has 53 bits.
  if (bits != 0 && std::bit_width(bits) - std::countr_zero(bits) > 53) return std::nullopt;
  return static_cast<double>(bits);
}

}  // namespace

absl::Status ReadingBudget::Take(std::size_t bytes) {
  if (bytes > left_) {
    return absl::ResourceExhaustedError(fmt::format(
        "unpacks, with what was read before it, to more than {} bytes, the limit of input files", kMaxFileBytes));
  }
  left_ -= bytes;
  return absl::OkStatus();
}

absl::StatusOr<double> NumberFromBytes(std::string_view bytes, const NumberFormat& format, std::size_t k) {
  const std::uint64_t bits = BitsAt(bytes.substr(k * format.bytes, format.bytes), format);
  if (format.kind != NumberFormat::Kind::kFloat) {
    if (const auto value = IntegerOf(bits, format)) return *value;
    return absl::InvalidArgumentError("an integer of more than 53 bits; every number must be one in double precision");
  }
  const double value = FloatOf(bits, format.bytes);
  if (std::isfinite(value)) return value;
  return absl::InvalidArgumentError(fmt::format("{}; every number must be finite", value));
}

absl::StatusOr<v1::DenseMatrix> DenseFromBytes(std::string_view bytes, const NumberFormat& format, std::uint64_t rows,
                                               std::uint64_t columns, bool by_columns, ReadingBudget& budget) {
  if (rows == 0 || columns == 0) {
    return absl::InvalidArgumentError(fmt::format("is empty ({} x {}); must hold numbers", rows, columns));
  }
  constexpr std::uint64_t kMaxNumbers = kMaxFileBytes / sizeof(double);
  if (rows > kMaxNumbers || columns > kMaxNumbers / rows) {
    return absl::ResourceExhaustedError(
        fmt::format("has {} x {} numbers; must have at most {}", rows, columns, kMaxNumbers));
  }
  const std::uint64_t count = rows * columns;
  if (bytes.size() != count * format.bytes) {
    return absl::InvalidArgumentError(
        fmt::format("has {} bytes; {} x {} numbers must have {}", bytes.size(), rows, columns, count * format.bytes));
  }
  if (const absl::Status taken = budget.Take(count * sizeof(double)); !taken.ok()) return taken;
  v1::DenseMatrix matrix;
  matrix.set_rows(static_cast<std::int32_t>(rows));
  matrix.set_columns(static_cast<std::int32_t>(columns));
  matrix.mutable_values()->Resize(static_cast<int>(count), 0);
  double* const values = matrix.mutable_values()->mutable_data();
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::uint64_t row = by_columns ? k % rows : k / columns;
    const std::uint64_t column = by_columns ? k / rows : k % columns;
    const absl::StatusOr<double> value = NumberFromBytes(bytes, format, k);
    if (!value.ok()) {
      return absl::InvalidArgumentError(
          fmt::format("holds in row {}, column {} (from 0) {}", row, column, std::string(value.status().message())));
    }
    values[row * columns + column] = *value;
  }
  return matrix;
}

}  // namespace dlcs::client
