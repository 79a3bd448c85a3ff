// SPDX-License-Identifier: Apache-2.0
// The formats of NumPy. (client/files/npy_array.h says where they are described.)
#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <list>
#include <string_view>
#include <utility>

#include "client/cli/output/result_arrays.h"
#include "client/files/encoding.h"
#include "client/files/npy_array.h"

namespace dlcs::client {
namespace {

void WriteNumbers(std::span<const double> numbers, std::FILE* out) {
  std::fwrite(numbers.data(), sizeof(double), numbers.size(), out);
}

// Lets libzip write an archive to a stream, which it seeks in. libzip itself would write to another file and rename it.
class ZipStream {
 public:
  explicit ZipStream(std::FILE* out) : out_(out) { zip_error_init(&error_); }
  ~ZipStream() { zip_error_fini(&error_); }
  ZipStream(const ZipStream&) = delete;
  ZipStream& operator=(const ZipStream&) = delete;

  // What libzip calls.
  static zip_int64_t Call(void* self, void* data, zip_uint64_t size, zip_source_cmd_t command) {
    return static_cast<ZipStream*>(self)->Do(data, size, command);
  }

 private:
  zip_int64_t Do(void* data, zip_uint64_t size, zip_source_cmd_t command) {
    switch (command) {
      case ZIP_SOURCE_SUPPORTS:
        return zip_source_make_command_bitmap(ZIP_SOURCE_OPEN, ZIP_SOURCE_READ, ZIP_SOURCE_CLOSE, ZIP_SOURCE_STAT,
                                              ZIP_SOURCE_ERROR, ZIP_SOURCE_FREE, ZIP_SOURCE_SEEK, ZIP_SOURCE_TELL,
                                              ZIP_SOURCE_BEGIN_WRITE, ZIP_SOURCE_COMMIT_WRITE,
                                              ZIP_SOURCE_ROLLBACK_WRITE, ZIP_SOURCE_WRITE, ZIP_SOURCE_SEEK_WRITE,
                                              ZIP_SOURCE_TELL_WRITE, ZIP_SOURCE_REMOVE, -1);
      case ZIP_SOURCE_STAT: {  // the file is empty
        zip_stat_t about;
        zip_stat_init(&about);
        about.size = 0;
        about.valid = ZIP_STAT_SIZE;
        std::memcpy(data, &about, sizeof about);
        return sizeof about;
      }
      case ZIP_SOURCE_ERROR:
        return zip_error_to_data(&error_, data, size);
      case ZIP_SOURCE_WRITE:
        if (std::fwrite(data, 1, size, out_) == size) return static_cast<zip_int64_t>(size);
        return Failed(ZIP_ER_WRITE);
      case ZIP_SOURCE_SEEK_WRITE: {
        const std::int64_t now = std::ftell(out_);
        if (now < 0) return Failed(ZIP_ER_SEEK);
        length_ = std::max(length_, now);
        const std::int64_t target = zip_source_seek_compute_offset(
            static_cast<zip_uint64_t>(now), static_cast<zip_uint64_t>(length_), data, size, &error_);
        return target >= 0 && std::fseek(out_, target, SEEK_SET) == 0 ? 0 : Failed(ZIP_ER_SEEK);
      }
      case ZIP_SOURCE_TELL_WRITE:
        return std::ftell(out_);
      case ZIP_SOURCE_COMMIT_WRITE:
        return std::fflush(out_) == 0 ? 0 : Failed(ZIP_ER_WRITE);
      default:
        return 0;
    }
  }

  zip_int64_t Failed(int code) {
    zip_error_set(&error_, code, errno);
    return -1;
  }

  std::FILE* out_;
  std::int64_t length_ = 0;  // of the file, at the last seek
  zip_error_t error_;
};

// An archive that is being written.
class ZipWriter {
 public:
  explicit ZipWriter(std::FILE* out) : stream_(out) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_function_create(ZipStream::Call, &stream_, &error);
    archive_ = source != nullptr ? zip_open_from_source(source, ZIP_CREATE | ZIP_TRUNCATE, &error) : nullptr;
    if (archive_ == nullptr && source != nullptr) zip_source_free(source);
    zip_error_fini(&error);
  }
  ~ZipWriter() {
    if (archive_ != nullptr) zip_discard(archive_);
  }
  ZipWriter(const ZipWriter&) = delete;
  ZipWriter& operator=(const ZipWriter&) = delete;

  // A member `begin` and `rest`. `begin` is copied; `rest` must outlive Close().
  void Add(const std::string& name, std::string begin, std::span<const double> rest = {}) {
    if (archive_ == nullptr || failed_) return;
    const std::string& kept = kept_.emplace_back(std::move(begin));
    std::array<zip_buffer_fragment_t, 2> parts{};
    parts[0] = {reinterpret_cast<zip_uint8_t*>(const_cast<char*>(kept.data())), kept.size()};
    parts[1] = {reinterpret_cast<zip_uint8_t*>(const_cast<double*>(rest.data())), rest.size_bytes()};
    const std::size_t count = rest.empty() ? 1 : 2;
    zip_source_t* source = zip_source_buffer_fragment(archive_, parts.data(), count, /*freep=*/0);
    const zip_int64_t index = source != nullptr ? zip_file_add(archive_, name.c_str(), source, ZIP_FL_ENC_UTF_8) : -1;
    if (index < 0 && source != nullptr) zip_source_free(source);
    // Stored without compression: doubles hardly compress, and programs can map such files into memory. And with the
    // first day that zip knows: the same result is the same file.
    constexpr zip_uint16_t kFirstDay = 1 << 5 | 1;
    const auto member = static_cast<zip_uint64_t>(index);
    failed_ = index < 0 || zip_set_file_compression(archive_, member, ZIP_CM_STORE, 0) != 0 ||
              zip_file_set_dostime(archive_, member, 0, kFirstDay, 0) != 0;
  }

  absl::Status Close() {
    if (archive_ == nullptr) return absl::InternalError("cannot write a zip archive");
    if (!failed_ && zip_close(archive_) == 0) {
      archive_ = nullptr;
      return absl::OkStatus();
    }
    return absl::InternalError(fmt::format("cannot write a zip archive: {}", zip_strerror(archive_)));
  }

 private:
  ZipStream stream_;
  zip_t* archive_ = nullptr;
  std::list<std::string> kept_;
  bool failed_ = false;
};

// A list of names, each padded with zeros to the length of the longest: letters of 32 bits.
std::string NpyOfNames(const std::vector<std::string>& names) {
  std::vector<std::u32string> letters;
  std::size_t longest = 1;
  for (const std::string& name : names) longest = std::max(longest, letters.emplace_back(LettersOf(name)).size());
  const std::array<std::size_t, 1> shape = {names.size()};
  std::string npy = NpyHeader(fmt::format("U{}", longest), shape);
  for (const std::u32string& name : letters) {
    for (std::size_t k = 0; k < longest; ++k) {
      const std::uint32_t letter = k < name.size() ? name[k] : 0;
      std::array<char, sizeof letter> bytes;
      std::memcpy(bytes.data(), &letter, sizeof letter);
      npy.append(bytes.data(), bytes.size());
    }
  }
  return npy;
}

}  // namespace

absl::Status WriteNpy(const SolveResult& result, std::FILE* out) {
  const std::size_t columns = result.has_outputs() ? 1 + result.names.outputs.size()
                                                   : 1 + result.states + (ShowsW(result) ? 2 : 1) * result.constraints;
  const std::array<std::size_t, 2> shape = {result.times.size(), columns};
  const std::string header = NpyHeader("f8", shape);
  std::fwrite(header.data(), 1, header.size(), out);
  for (std::size_t k = 0; k < result.times.size() && std::ferror(out) == 0; ++k) {
    WriteNumbers({&result.times[k], 1}, out);
    if (result.has_outputs()) {
      WriteNumbers(result.outputs_at(k), out);
      continue;
    }
    WriteNumbers(result.x_at(k), out);
    WriteNumbers(result.y_at(k), out);
    WriteNumbers(result.w_at(k), out);
  }
  return absl::OkStatus();  // errors of `out` are reported when it is flushed
}

absl::Status WriteNpz(const ResultArrays& all, std::FILE* out) {
  ZipWriter archive(out);
  for (const ResultArray& array : all.arrays) {
    const std::array<std::size_t, 2> shape = {array.rows, array.columns};
    archive.Add(fmt::format("{}.npy", array.name), NpyHeader("f8", std::span(shape).first(array.is_list ? 1 : 2)),
                array.values);
  }
  for (const auto& [name, names] : all.names) archive.Add(fmt::format("{}.npy", name), NpyOfNames(names));
  archive.Add("summary.json", all.summary);
  return archive.Close();
}

}  // namespace dlcs::client
