// SPDX-License-Identifier: Apache-2.0
#include "client/mpi/row_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "client/files/matrix_market.h"
#include "client/files/petsc_file.h"
#include "core/mpi/row_exchange.h"
#include "proto/shared/byte_order_mark.h"

namespace dlcs::client {
namespace {

constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20;

// A file with random access.
class PlacedFile {
 public:
  explicit PlacedFile(std::string path) : path_(std::move(path)), file_(open(path_.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~PlacedFile() {
    if (file_ >= 0) close(file_);
  }
  PlacedFile(const PlacedFile&) = delete;
  PlacedFile& operator=(const PlacedFile&) = delete;

  const std::string& path() const { return path_; }
  // The size of a regular file; 0 for anything else.
  std::uint64_t size() const {
    struct stat about {};
    if (file_ < 0 || fstat(file_, &about) != 0 || !S_ISREG(about.st_mode)) return 0;
    return static_cast<std::uint64_t>(about.st_size);
  }

  // `count` bytes from `begin` on, or fewer at the end. Errors: FailedPrecondition.
  absl::StatusOr<std::string> Read(std::uint64_t begin, std::uint64_t count) const {
    std::string bytes(count, '\0');
    std::uint64_t got = 0;
    while (got < count) {
      const ssize_t more = pread(file_, bytes.data() + got, count - got, static_cast<off_t>(begin + got));
      if (more < 0 && errno == EINTR) continue;
      if (more < 0) return absl::FailedPreconditionError(fmt::format("{}: {}", path_, std::strerror(errno)));
      if (more == 0) break;
      got += static_cast<std::uint64_t>(more);
    }
    bytes.resize(got);
    return bytes;
  }

 private:
  const std::string path_;
  const int file_;
};

// The error of the first rank that has one, on all ranks.
absl::Status Agreed(const absl::Status& own, MpiTeam& team) {
  const std::string text = team.FirstText(std::string(own.message()));
  const double code = team.Max(own.ok() ? 0 : static_cast<double>(own.code()));
  return text.empty() ? absl::OkStatus() : absl::Status(static_cast<absl::StatusCode>(code), text);
}

// The first index of the share of `rank` in `count` items.
std::uint64_t ShareBegin(std::uint64_t count, int rank, int ranks) {
  const auto r = static_cast<std::uint64_t>(rank), p = static_cast<std::uint64_t>(ranks);
  return count / p * r + count % p * r / p;
}

absl::Status TooManyEntries(const PlacedFile& file, const std::length_error& error) {
  return absl::ResourceExhaustedError(fmt::format("{}: {}", file.path(), error.what()));
}

// Matrix Market.

absl::StatusOr<MarketHead> ReadMarketHead(const PlacedFile& file) {
  // Comments may be long.
  for (std::uint64_t bytes = kPieceBytes;; bytes *= 2) {
    const absl::StatusOr<std::string> text = file.Read(0, bytes);
    if (!text.ok()) return text.status();
    const std::size_t end = text->size() < bytes ? text->size() : text->rfind('\n');
    auto head = ParseMarketHead(std::string_view(*text).substr(0, end), file.path());
    if (head.ok() || text->size() < bytes) return head;
  }
}

// The lines of this rank: those that begin in its share of the bytes.
class MarketShare {
 public:
  MarketShare(const PlacedFile& file, const MarketHead& head, MpiTeam& team) : file_(file), head_(head) {
    const std::uint64_t bytes = file.size() - head.bytes;
    const auto begin = [&](int rank) { return LineFrom(head.bytes + ShareBegin(bytes, rank, team.size())); };
    at_ = begin(team.rank());
    end_ = begin(team.rank() + 1);
  }

  bool HasMore() const { return status_.ok() && at_ < end_; }
  const absl::Status& status() const { return status_; }
  std::int64_t entries() const { return entries_; }

  // Reads a piece.
  void Read(RowExchange& exchange) {
    // Lines of matrices are never longer than a piece.
    const std::uint64_t count = std::min(kPieceBytes, end_ - at_);
    auto text = file_.Read(at_, count);
    if (!text.ok()) {
      status_ = text.status();
      return;
    }
    if (at_ + count < end_) text->resize(text->rfind('\n') + 1);
    if (text->empty()) {
      Refuse("has a line that is too long");
      return;
    }
    const auto add = [&](std::int32_t row, std::int32_t column, double value) { exchange.Add(row, column, value); };
    auto found = ParseMarketLines(*text, kUnknownLine, head_, file_.path(), add);
    if (found.ok()) {
      entries_ += *found;
      at_ += text->size();
      return;
    }
    // Parses again, for an error with the number of the line.
    found = ParseMarketLines(*text, LineAt(at_), head_, file_.path(), [](auto, auto, auto) {});
    status_ = found.status();
  }

 private:
  static constexpr std::int64_t kUnknownLine = 2;

  // The offset of the first line that begins at `at` or later.
  std::uint64_t LineFrom(std::uint64_t at) const {
    if (at <= head_.bytes) return head_.bytes;
    for (std::uint64_t begin = at - 1;;) {
      const auto text = file_.Read(begin, kPieceBytes);
      if (!text.ok() || text->empty()) return file_.size();
      if (const std::size_t end = text->find('\n'); end != std::string::npos) return begin + end + 1;
      begin += text->size();
    }
  }

  std::int64_t LineAt(std::uint64_t at) const {
    std::int64_t line = 1;
    for (std::uint64_t begin = 0; begin < at; begin += kPieceBytes) {
      const auto text = file_.Read(begin, std::min(kPieceBytes, at - begin));
      if (text.ok()) line += std::count(text->begin(), text->end(), '\n');
    }
    return line;
  }

  void Refuse(const std::string& rule) {
    status_ = absl::InvalidArgumentError(fmt::format("{}, line {}: {}", file_.path(), LineAt(at_), rule));
  }

  const PlacedFile& file_;
  const MarketHead& head_;
  std::uint64_t at_ = 0, end_ = 0;
  std::int64_t entries_ = 0;
  absl::Status status_;
};

absl::StatusOr<RowMajorMatrix> ReadMarketRows(const PlacedFile& file, const MarketHead& head, const Ownership& rows,
                                              MpiTeam& team) {
  RowExchange exchange(rows, head.columns, team);
  MarketShare share(file, head, team);
  do {
    if (share.HasMore()) share.Read(exchange);
    exchange.Send();
  } while (team.Any(share.HasMore()));
  if (absl::Status read = Agreed(share.status(), team); !read.ok()) return read;
  const double entries = team.Sum(static_cast<double>(share.entries()));
  if (entries != static_cast<double>(head.entries)) {
    return absl::InvalidArgumentError(fmt::format("{}, line {}: {} entries are announced, and {:.0f} follow",
                                                  file.path(), head.line, head.entries, entries));
  }
  try {
    return exchange.Finish();
  } catch (const std::length_error& error) {
    return TooManyEntries(file, error);
  }
}

// PETSc.

absl::StatusOr<PetscMatrixHead> ReadPetscHead(const PlacedFile& file) {
  const auto bytes = file.Read(0, PetscMatrixHead::kBytes);
  if (!bytes.ok()) return bytes.status();
  auto head = ParsePetscHead(*bytes);
  if (!head.ok()) {
    return absl::Status(head.status().code(), fmt::format("{} {}", file.path(), std::string(head.status().message())));
  }
  if (head->file_bytes() != file.size()) {
    return absl::InvalidArgumentError(fmt::format("{} has {} bytes; must have {} for {} rows and {} entries",
                                                  file.path(), file.size(), head->file_bytes(), head->rows,
                                                  head->entries));
  }
  return head;
}

// The lengths of the rows [begin, begin + count).
absl::StatusOr<std::vector<std::uint32_t>> ReadLengths(const PlacedFile& file, const PetscMatrixHead& head,
                                                       std::uint64_t begin, std::uint64_t count) {
  constexpr std::uint64_t kBytes = PetscMatrixHead::kIndexBytes;
  const auto bytes = file.Read(head.lengths_at() + kBytes * begin, kBytes * count);
  if (!bytes.ok()) return bytes.status();
  std::vector<std::uint32_t> lengths;
  for (std::size_t k = 0; k < count; ++k) lengths.push_back(PetscIndex(*bytes, k));
  return lengths;
}

// Rows from number `first` on whose entries begin with number `entry`.
absl::StatusOr<RowMajorMatrix> ReadPetscBlock(const PlacedFile& file, const PetscMatrixHead& head, std::uint64_t first,
                                              const std::vector<std::uint32_t>& lengths, std::uint64_t entry) {
  std::uint64_t entries = 0;
  for (const std::uint32_t length : lengths) entries += length;
  RowWriter writer(static_cast<Index>(lengths.size()), static_cast<Index>(head.columns), static_cast<Index>(entries));
  const auto refuse = [&](std::size_t row, const std::string& rule) {
    return absl::InvalidArgumentError(fmt::format("{} has in row {} (from 0) {}", file.path(), first + row, rule));
  };
  for (std::size_t begin = 0; begin < lengths.size();) {
    std::size_t end = begin;  // of rows that make a piece, one at least
    std::uint64_t count = 0;
    do count += lengths[end++];
    while (end < lengths.size() && (count + lengths[end]) * PetscMatrixHead::kValueBytes <= kPieceBytes);
    const auto columns =
        file.Read(head.columns_at() + PetscMatrixHead::kIndexBytes * entry, PetscMatrixHead::kIndexBytes * count);
    const auto values =
        file.Read(head.values_at() + PetscMatrixHead::kValueBytes * entry, PetscMatrixHead::kValueBytes * count);
    if (!columns.ok()) return columns.status();
    if (!values.ok()) return values.status();
    std::size_t k = 0;
    for (std::size_t row = begin; row < end; ++row) {
      for (std::uint32_t i = 0; i < lengths[row]; ++i, ++k) {
        const std::uint32_t column = PetscIndex(*columns, k);
        if (column >= head.columns) return refuse(row, fmt::format("column {}, and {} columns", column, head.columns));
        const auto value = NumberFromBytes(*values, kPetscValues, k);
        if (!value.ok())
          return refuse(row, fmt::format("column {}: {}", column, std::string(value.status().message())));
        writer.Add(static_cast<Index>(column), *value);
      }
      writer.EndRow();
    }
    entry += count;
    begin = end;
  }
  return writer.Finish();
}

absl::StatusOr<RowMajorMatrix> ReadPetscRows(const PlacedFile& file, const PetscMatrixHead& head, const Ownership& rows,
                                             MpiTeam& team) {
  const auto first = static_cast<std::uint64_t>(rows.first(team.rank()));
  const auto count = static_cast<std::uint64_t>(rows.count(team.rank()));
  auto lengths = ReadLengths(file, head, first, count);
  double own = 0;
  if (lengths.ok()) {
    for (const std::uint32_t length : *lengths) own += length;
  }
  if (absl::Status read = Agreed(lengths.status(), team); !read.ok()) return read;
  double before = 0, all = 0;
  const std::vector<double> counts = team.Gather(own);
  for (std::size_t rank = 0; rank < counts.size(); ++rank) {
    if (rank < static_cast<std::size_t>(team.rank())) before += counts[rank];
    all += counts[rank];
  }
  if (all != static_cast<double>(head.entries)) {
    return absl::InvalidArgumentError(
        fmt::format("{} is damaged: the lengths of its rows do not add up to {} entries", file.path(), head.entries));
  }
  try {
    CheckEntries(static_cast<Index>(*std::max_element(counts.begin(), counts.end())));
  } catch (const std::length_error& error) {
    return TooManyEntries(file, error);
  }
  auto block = ReadPetscBlock(file, head, first, *lengths, static_cast<std::uint64_t>(before));
  if (absl::Status read = Agreed(block.status(), team); !read.ok()) return read;
  return block;
}

// Both.

absl::Status FindSecondEntry(const std::string& path, const RowMajorMatrix& rows, Index first) {
  for (Index i = 0; i < rows.rows(); ++i) {
    for (int k = rows.outerIndexPtr()[i] + 1; k < rows.outerIndexPtr()[i + 1]; ++k) {
      if (rows.innerIndexPtr()[k] != rows.innerIndexPtr()[k - 1]) continue;
      return absl::InvalidArgumentError(
          fmt::format("{} has row {}, column {} twice (from 1); every position may occur only once", path,
                      first + i + 1, rows.innerIndexPtr()[k] + 1));
    }
  }
  return absl::OkStatus();
}

struct Shape {
  Index rows = 0, columns = 0;
};

bool BeginsAsMarket(const PlacedFile& file) {
  constexpr std::string_view kBegin = "%%MatrixMarket";
  const auto bytes = file.Read(0, kByteOrderMark.size() + kBegin.size());
  if (!bytes.ok()) return false;
  const std::string_view text = WithoutByteOrderMark(*bytes);
  return text.size() >= kBegin.size() &&
         std::equal(kBegin.begin(), kBegin.end(), text.begin(),
                    [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
}

}  // namespace

bool IsReadByRows(const std::string& path) {
  const PlacedFile file(path);
  if (file.size() == 0) return false;
  const auto bytes = file.Read(0, PetscMatrixHead::kBytes);
  if (!bytes.ok()) return false;
  if (ParsePetscHead(*bytes).ok()) return true;
  if (!BeginsAsMarket(file)) return false;
  const auto head = ReadMarketHead(file);
  return head.ok() && head->is_coordinate;
}

absl::StatusOr<std::shared_ptr<const DistributedOperator>> ReadByRows(const std::string& path, MpiTeam& team) {
  const PlacedFile file(path);
  std::optional<MarketHead> market;
  std::optional<PetscMatrixHead> petsc;
  absl::Status opened;
  if (BeginsAsMarket(file)) {
    const auto head = ReadMarketHead(file);
    if (head.ok()) market = *head;
    opened = head.status();
  } else {
    const auto head = ReadPetscHead(file);
    if (head.ok()) petsc = *head;
    opened = head.status();
  }
  if (absl::Status agreed = Agreed(opened, team); !agreed.ok()) return agreed;
  const Shape shape = market ? Shape{static_cast<Index>(market->rows), static_cast<Index>(market->columns)}
                             : Shape{static_cast<Index>(petsc->rows), static_cast<Index>(petsc->columns)};
  for (const auto size : {static_cast<double>(file.size()), static_cast<double>(shape.rows), market ? 1.0 : 0.0}) {
    if (team.Max(size) != -team.Max(-size)) {
      return absl::FailedPreconditionError(fmt::format("{} is not the same file for all ranks", path));
    }
  }
  Ownership rows = Ownership::Blocks(shape.rows, team.size());
  auto own = market ? ReadMarketRows(file, *market, rows, team) : ReadPetscRows(file, *petsc, rows, team);
  if (!own.ok()) return own.status();
  const absl::Status unique = Agreed(FindSecondEntry(path, *own, rows.first(team.rank())), team);
  if (!unique.ok()) return unique;
  return std::make_shared<const DistributedOperator>(*std::move(own), std::move(rows), team);
}

}  // namespace dlcs::client
